"""Fits of parameters, how they run side by side, what they say about unseen data, how sure they are."""
