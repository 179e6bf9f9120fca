"""The FMI version that this copy of the code is for."""

FMI = 2
