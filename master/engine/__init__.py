"""The inner loop: a program of FMI calls and copies, compiled once for all systems."""
