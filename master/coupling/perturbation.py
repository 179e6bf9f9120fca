"""Small changes of inputs in the buffer, to see what answers to them."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from ..engine.values import REAL, Signal
from ..system.system import System


@contextmanager
def perturbed(system: System, signal: Signal, place: int, size: float) -> Iterator[float]:
    """A slot of an input with another value, within what its FMU allows; the change.

    A real changes by `size`, relative to 1 + its own, a boolean to its opposite, an integer by one, an enumeration to a
    neighbour; by 0 where nothing else is allowed.
    """
    instance = system.instances[signal.component]
    low, high = instance.bounds(signal.name)
    items = instance.items(signal.name)
    buffer: np.ndarray
    change: float
    if signal.family == REAL:
        buffer, change = system.buffer.reals, size * (1.0 + abs(float(system.buffer.reals[place])))
    else:
        buffer, change = system.buffer.integers, 1
        low, high = (0, 1) if signal.type == "Boolean" else (low, high)
    u = buffer[place]
    nearest = (u + change, u - change) if items is None else sorted({*items.values()} - {u}, key=lambda v: abs(v - u))
    buffer[place] = next((v for v in nearest if low <= v <= high), u)
    try:
        yield float(buffer[place] - u)
    finally:
        buffer[place] = u
