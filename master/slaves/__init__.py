"""FMUs of all FMI versions behind one interface, a version a file."""
