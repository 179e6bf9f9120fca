"""Where a component leaves a rest by itself, and how much a difference grows there.

A machine may come to a rest that does not hold: oil that is trapped between a closed valve and a piston, a pendulum on
its head, a wheel that begins to slip. It stays for a while and then leaves, faster and faster, without anything that
drives it. How soon hangs on how far from that rest it was put, so the smallest differences decide what comes after.

The rates of change of a run that nothing drives grow as a small difference between two such runs does: both obey the
run's own linearised equations. So the record of one run shows what becomes of differences: the factor from where a
signal's rate is least to where it is greatest. That this happens by itself is seen from how rates grow: in equal
shares, each in about the time of the one before. What is driven jumps, or grows like a power of time.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..coupling.residual_energy import STILL

POINTS, MAX_WINDOWS = 8, 500
"""Rates are compared as the greatest ones of windows of time: so many points at least, so many windows about."""

JUMP = 4.0
"""Growth from a window to the next that is none of the machine's own."""

OVER, ENDED = 0.5, 0.1
"""Shares of the greatest rate below which growth is over, and below which the signal has got to where it goes."""

LEAST_WINDOWS, LEAST_FACTOR = 8, 10.0
"""What counts as growth."""

UNEVEN = 2.0
"""How much longer than the first half of the growth (in logarithms) the second one may take. By itself it takes as
long; a rate that goes as t^2 takes three times as long for the second half of a growth by 100."""

AT_REST = 0.1
"""Share of its range by which each output of the component may move in the first half of the time of the growth."""


@dataclass(frozen=True)
class Departure:
    """One signal leaves a rest."""

    column: int
    begin: float
    """Time from which on its rate grows [s]."""
    end: float
    """Time until which it does [s]."""
    factor: float
    """Growth of the rates, and so of differences."""
    change: float
    """How far the signal gets until it is slow again, as a share of its range over the run."""


def departures(time: np.ndarray, table: np.ndarray) -> list[Departure]:
    """The greatest departure of each column that has one.

    time: (n,) in s, rising; table: (n, columns), the outputs of one component, in any units.
    """
    width = max(POINTS, len(time) // MAX_WINDOWS)
    count = (len(time) - 1) // width
    if count <= LEAST_WINDOWS or not table.shape[1]:
        return []
    with np.errstate(all="ignore"):
        least, greatest = table.min(axis=0), table.max(axis=0)
        span, floor = greatest - least, STILL * np.maximum(np.abs(least), np.abs(greatest))
        moves = np.isfinite(span) & (span > floor)
        table, span, floor = table[: count * width + 1, moves], span[moves], floor[moves]
        change = np.maximum(np.abs(np.diff(table, axis=0)), floor) / span
        change /= np.diff(time[: count * width + 1])[:, None]
        rates = change.reshape(count, width, -1).max(axis=1)
    starts, leaving = time[: count * width + 1 : width], []
    for j, column in enumerate(np.flatnonzero(moves)):
        growth = _greatest(rates[:, j])
        if growth is None:
            continue
        first, last, arrived = growth
        begin, end = float(starts[first]), float(starts[last + 1])
        at_first = table[first * width : (first + last + 1) // 2 * width + 1]
        if (np.ptp(at_first, axis=0) / span).max() <= AT_REST:
            way = np.ptp(table[first * width : (arrived + 1) * width + 1, j]) / span[j]
            leaving.append(Departure(int(column), begin, end, float(rates[last, j] / rates[first, j]), float(way)))
    return leaving


def _greatest(rates: np.ndarray) -> tuple[int, int, int] | None:
    """First and last window of the greatest growth in the rates of one signal (windows,), if there is one, and the
    window in which the signal has got to where it goes."""
    values = rates.tolist()
    best, most = None, LEAST_FACTOR
    for low, top in _rises(values):
        if values[top] > most * values[low]:
            growth = _by_itself(rates[low : top + 1])
            if growth is not None and values[low + growth[1]] > most * values[low + growth[0]]:
                best = low + growth[0], low + growth[1], top
                most = values[best[1]] / values[best[0]]
    if best is None:
        return None
    first, last, arrived = best
    highest = values[arrived]
    while arrived + 1 < len(values) and ENDED * highest < values[arrived + 1] <= JUMP * values[arrived]:
        arrived += 1
    return first, last, arrived


def _rises(values: list[float]) -> list[tuple[int, int]]:
    """Lowest and highest window of each rise of rates without a jump."""
    rises, low, top = [], 0, 0
    for k in range(1, len(values)):
        if not values[k] <= JUMP * values[k - 1] or values[k] < OVER * values[top] or values[k] < values[low]:
            rises.append((low, top))
            low = top = k
        elif values[k] > values[top]:
            top = k
    return [*rises, (low, top)]


def _by_itself(rates: np.ndarray) -> tuple[int, int] | None:
    """First and last window of the longest part of a rise (windows,) that grows in equal shares in about equal times.

    A rate that changes its sign before it grows dips lower than its own growth begins, and slows down where the signal
    comes to its end: so the beginning is moved on until the rest is even, and the end may lie at less than the top.
    """
    for share in (1.0, 0.5, 0.25):
        last = int(np.argmax(rates >= share * rates[-1]))
        for first in range(last - LEAST_WINDOWS + 1):
            half = int(np.argmax(rates[first : last + 1] >= np.sqrt(rates[first] * rates[last])))
            if last - first - half <= UNEVEN * half and rates[last] > LEAST_FACTOR * rates[first]:
                return first, last
    return None
