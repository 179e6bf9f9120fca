"""A simulation from its start to what it leaves behind."""
