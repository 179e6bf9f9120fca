"""Runs laid over each other: where each signal differs first and most, in the terminal and as a page."""
