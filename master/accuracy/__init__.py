"""How far a run can be trusted: what it shows by itself, and by being repeated with half the step."""
