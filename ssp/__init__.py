"""System Structure and Parameterization (SSP 1.0): reader, packer, the shipped scenarios. Simulates nothing."""
