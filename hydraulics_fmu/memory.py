"""What an instance remembers from slice to slice beside the states of its differential equations."""

from __future__ import annotations

import numpy as np

from ..core.jit import kernel
from ..core.records import record, size_of

LENGTH = 1024
"""Entries of the controller's history, which reach back over its delay however short the steps (`march.told`); the
latest stands at `count` - 1, modulo this."""

MEMORY = record((
    "count", "held", "sampled_at", "u", "u_rate", "P_s", "P_r",
    "spool", "play", "silt", "bristle", "bristle_coulomb", "rest",
    f"times[{LENGTH}]", f"outputs[{LENGTH}]",
))  # fmt: skip
"""The controller: entries made, the output held [mA], when it was sampled last [s], the output in the present slice
[mA] (NaN: that of the present state) and its rate; pressures of a supply from outside [Pa]; what holds the spool back:
where it stood at the start of the slice, how far it is caught [share of the stroke], how silted up it is; the piston's
friction: deflection of the bristles of presliding and of Coulomb friction [m], how long it rested (0..1); the
controller's history: times [s], outputs [mA]."""

SIZE = size_of(MEMORY)
"""How many numbers these are."""


@kernel
def remembering(memory: object) -> object:
    """The memory (`SIZE`,) as a record."""
    return memory.view(MEMORY)[0]


def new_memory() -> np.ndarray:
    """The memory (`SIZE`,) of an instance that rested for long."""
    made = np.zeros(SIZE)
    m = made.view(MEMORY)[0]
    m.u, m.silt, m.rest = np.nan, 1.0, 1.0
    return made
