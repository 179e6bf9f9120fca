"""What the coupling of FMUs needs to know and to solve: feed-through, algebraic loops, initialisation, power."""
