"""The oracle: the true set of effects fitted with the library, from the truth; see `__main__`."""
