"""Many rows as few points: of each group of rows the least and the greatest value, in the order in which they came.

Rows come block by block, and memory stays constant: when there are too many points, four of them become two, and the
groups of rows to come are twice as large.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Reduced:
    """Points of a record; where `group` is 1 they are its rows, else every two of them are a group of so many rows."""

    times: np.ndarray
    """(points,) [s]: the first and the last row's of a group, so that what rises is drawn as a line, not as stairs."""
    values: np.ndarray
    """(points, columns), each a value that stands in the file; the last point is the last row."""
    rows: int
    group: int


def _extremes(times: np.ndarray, values: np.ndarray, size: int) -> tuple[np.ndarray, np.ndarray]:
    """Of each `size` rows two; the number of rows is a multiple of it."""
    groups, columns = len(times) // size, values.shape[1]
    grouped = values.reshape(groups, size, columns)
    low, high = np.fmin.reduce(grouped, axis=1), np.fmax.reduce(grouped, axis=1)
    falls = np.argmax(grouped, axis=1) < np.argmin(grouped, axis=1)
    made = np.empty((groups, 2, columns))
    made[:, 0], made[:, 1] = np.where(falls, high, low), np.where(falls, low, high)
    return times.reshape(groups, size)[:, [0, -1]].ravel(), made.reshape(2 * groups, columns)


class Reducer:
    """Takes rows, keeps at most `limit` points of them (and the last row), at least half as many where there are more
    rows than that."""

    def __init__(self, columns: int, limit: int):
        self._limit = max(8, limit - limit % 4)
        self._times = np.empty(self._limit)
        self._values = np.empty((self._limit, columns))
        self._points, self._group, self._rows = 0, 1, 0
        self._rest = np.empty(0), np.empty((0, columns))
        """Rows that do not make a group yet."""
        self._last = self._rest

    def add(self, times: np.ndarray, values: np.ndarray) -> None:
        """Rows: times (n,), values (n, columns)."""
        if not len(times):
            return
        self._rows += len(times)
        self._last = times[-1:].copy(), values[-1:].copy()
        times = np.concatenate([self._rest[0], times])
        values = np.concatenate([self._rest[1], values])
        while True:
            if self._points == self._limit and len(times):
                self._halve()
            per_point = 1 if self._group == 1 else self._group // 2
            room = (self._limit - self._points) * per_point
            count = min(len(times) - len(times) % self._group, room)
            if count == 0:
                break
            self._put(*self._points_of(times[:count], values[:count], self._group))
            times, values = times[count:], values[count:]
        self._rest = times.copy(), values.copy()

    def _points_of(self, times: np.ndarray, values: np.ndarray, size: int) -> tuple[np.ndarray, np.ndarray]:
        return (times, values) if size == 1 else _extremes(times, values, size)

    def _put(self, times: np.ndarray, values: np.ndarray) -> None:
        end = self._points + len(times)
        self._times[self._points : end], self._values[self._points : end] = times, values
        self._points = end

    def _halve(self) -> None:
        times, values = _extremes(self._times, self._values, 4)
        self._points = 0
        self._put(times, values)
        self._group = 4 if self._group == 1 else 2 * self._group

    def reduced(self) -> Reduced:
        """What has come so far."""
        times, values = [self._times[: self._points]], [self._values[: self._points]]
        if len(self._rest[0]) > 1:
            t, v = _extremes(*self._rest, len(self._rest[0]))
            times.append(t)
            values.append(v)
        if self._group > 1:
            times.append(self._last[0])
            values.append(self._last[1])
        return Reduced(np.concatenate(times), np.concatenate(values), self._rows, self._group)
