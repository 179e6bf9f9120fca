"""Where two series of a signal differ: the first time, the greatest difference, and what share of its range that is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf

import numpy as np

LEAST_RANGE = 1e-6
"""Least range of a signal as a share of its greatest absolute value: what varies less is constant but for rounding."""

LEVEL = 0.3
"""Greatest range of a signal in each run, as a share of how far they are apart, where they differ by a level."""

Value = float | str
Column = np.ndarray | Sequence[str]


@dataclass(frozen=True)
class Moment:
    """A time [s] and the two values there."""

    time: float
    a: Value
    b: Value


@dataclass(frozen=True)
class Difference:
    """How far a signal of one run is from that of another."""

    name: str
    unit: str
    """Of both values; '' where there is none."""
    difference: float
    """The greatest [unit]; 0 where there is none, infinite where one is no number; of texts the share of the rows."""
    relative: float
    """It as a share of the signal's range; of texts the share of the rows that differ."""
    first: Moment | None = None
    """Where they differ by more than the tolerance; None if they never do."""
    most: Moment | None = None
    """Where they differ most; None where they do not differ at all."""
    remark: str = ""
    """Why they cannot be compared, which counts as different."""
    is_level: bool = False
    """Whether the runs differ by a level: each varies far less than they are apart."""

    @property
    def differs(self) -> bool:
        """Whether they do by more than the tolerance."""
        return self.first is not None or bool(self.remark)


def range_of(*columns: np.ndarray) -> float:
    """Greatest less least finite value of all columns together, at least `LEAST_RANGE` of the greatest size; 0 where
    all values are 0, or none is finite."""
    finite = np.concatenate([column[np.isfinite(column)] for column in columns])
    if not len(finite):
        return 0.0
    low, high = float(finite.min()), float(finite.max())
    return max(high - low, LEAST_RANGE * max(abs(low), abs(high)))


def difference(name: str, unit: str, times: np.ndarray, a: np.ndarray, b: np.ndarray, tolerance: float) -> Difference:
    """Of numbers a (n,) and b (n,) at the times (n,) [s]; tolerance: a share of the signal's range.

    Values that are no numbers, or infinite, equal each other where both are the same of these.
    """
    with np.errstate(invalid="ignore", over="ignore"):  # what is farther apart than a number can be is infinitely so
        apart = np.abs(b - a)
    apart[(a == b) | (np.isnan(a) & np.isnan(b))] = 0.0
    apart[np.isnan(apart)] = inf
    if not len(apart) or not apart.any():
        return Difference(name, unit, 0.0, 0.0)
    span = range_of(a, b)
    with np.errstate(invalid="ignore"):
        relative = np.where(np.isinf(apart) | (span == 0.0) & (apart > 0.0), inf, apart / (span or 1.0))
    beyond, k = np.flatnonzero(relative > tolerance), int(np.argmax(apart))

    def at(i: int) -> Moment:
        return Moment(float(times[i]), float(a[i]), float(b[i]))

    first = at(int(beyond[0])) if len(beyond) else None
    level = all(range_of(x) <= LEVEL * apart[k] for x in (a, b))
    return Difference(name, unit, float(apart[k]), float(relative[k]), first, at(k), is_level=bool(level))


def difference_of_texts(name: str, times: np.ndarray, a: Sequence[str], b: Sequence[str]) -> Difference:
    """Of texts (n,) each: any difference counts, and none is greater than another."""
    differing = [i for i, (one, other) in enumerate(zip(a, b, strict=True)) if one != other]
    if not differing:
        return Difference(name, "", 0.0, 0.0)
    i, share = differing[0], len(differing) / len(a)
    first = Moment(float(times[i]), a[i], b[i])
    return Difference(name, "", share, share, first, first)
