"""From a package to a system of FMUs: where signals lie, what is connected, which values are set."""
