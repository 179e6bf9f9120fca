"""Start values that this copy of the code has instead of the variable tables'; `container` writes a scenario's."""

STARTS: dict[str, float] = {}
