"""The formats of result files, one a file; each has a `FORMAT`, which is all that anything else knows of it."""
