"""Marks that stand for missing values, such as -9999: often the same, and away from all that was read."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .table import FloatArray


def is_mark(read: FloatArray, marks: Sequence[float]) -> np.ndarray:
    """Which readings (n,) of a channel, in its own unit, are one of the usual marks or its negative."""
    return np.isin(np.abs(np.round(read, 6)), marks)


def repeated_mark(read: FloatArray, marks: Sequence[float], least: int, away: float) -> float | None:
    """The mark that at least so many readings (n,) have, and all others are away from by that share of their span."""
    marked = is_mark(read, marks)
    rest = read[~marked]
    if not len(rest):
        return None
    reach = away * float(np.ptp(rest))
    values, counts = np.unique(read[marked], return_counts=True)
    for value in values[counts >= least]:
        if not rest.min() - reach <= value <= rest.max() + reach:
            return float(value)
    return None
