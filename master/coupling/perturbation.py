"""Small changes of inputs in the buffer, to see what answers to them."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from ..engine.values import REAL, Signal, in_slot, of_slot
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
    u: float  # Python's own numbers, which know no end: an integer may be the last of its type
    change: float
    if signal.family == REAL:
        buffer, u = system.buffer.reals, float(system.buffer.reals[place])
        change = size * (1.0 + abs(u))
    else:
        buffer, u = system.buffer.integers, of_slot(int(system.buffer.integers[place]), signal.type)
        change = 1
        low, high = (0, 1) if signal.type == "Boolean" else (low, high)
    nearest = (u + change, u - change) if items is None else sorted({*items.values()} - {u}, key=lambda v: abs(v - u))
    other = next((v for v in nearest if low <= v <= high), u)
    kept = buffer[place]
    buffer[place] = other if signal.family == REAL else in_slot(int(other))
    try:
        yield float(other - u)
    finally:
        buffer[place] = kept
