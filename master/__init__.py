"""The master: runs the system of an SSP package as a fixed-step co-simulation. Knows nothing of physics."""
