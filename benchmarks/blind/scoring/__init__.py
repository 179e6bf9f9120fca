"""What a diagnosis says of a case against what is true of it; see `score`."""
