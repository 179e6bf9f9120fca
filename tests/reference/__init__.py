"""Independent reference solutions that the tests compare the co-simulation with."""
