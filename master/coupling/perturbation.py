"""Small changes of inputs on the board, to see what answers to them."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from ..engine.values import REAL, Signal
from ..system.system import System


@contextmanager
def nudged(system: System, signal: Signal, place: int, size: float) -> Iterator[float]:
    """A slot of an input with another value, within what its FMU allows; the change.

    A real changes by `size`, relative to 1 + its own, a boolean to its opposite, an integer by one, an enumeration to a
    neighbour; by 0 where nothing else is allowed.
    """
    slave = system.slaves[signal.component]
    low, high = slave.bounds(signal.name)
    items = slave.items(signal.name)
    board: np.ndarray
    change: float
    if signal.family == REAL:
        board, change = system.board.reals, size * (1.0 + abs(float(system.board.reals[place])))
    else:
        board, change = system.board.integers, 1
        low, high = (0, 1) if signal.type == "Boolean" else (low, high)
    u = board[place]
    others = (u + change, u - change) if items is None else sorted({*items.values()} - {u}, key=lambda v: abs(v - u))
    board[place] = next((v for v in others if low <= v <= high), u)
    try:
        yield float(board[place] - u)
    finally:
        board[place] = u
