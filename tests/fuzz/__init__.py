"""A minute of the fuzz suite."""
