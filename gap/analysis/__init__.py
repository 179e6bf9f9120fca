"""What the gap looks like: where it lies, which component has it, what it follows, what to measure next."""
