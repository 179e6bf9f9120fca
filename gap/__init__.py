"""The diagnosis of the gap between measurement and simulation. Meets physics only through FMU files."""
