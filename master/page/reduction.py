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
    """(columns, points), each a value that stands in the file; the last point is the last row."""
    rows: int
    group: int


def _extremes(times: np.ndarray, values: np.ndarray, size: int) -> tuple[np.ndarray, np.ndarray]:
    """Of each `size` rows two; the number of rows is a multiple of it."""
    groups = len(times) // size
    grouped = values.reshape(len(values), groups, size)
    low, high = grouped, grouped
    if np.isnan(grouped).any():  # no extreme, unless the group has nothing else
        low, high = (np.where(np.isnan(grouped), other, grouped) for other in (np.inf, -np.inf))
    places = np.stack([low.argmin(axis=2), high.argmax(axis=2)], axis=2)
    places.sort(axis=2)
    made = np.take_along_axis(grouped, places, axis=2)
    return times.reshape(groups, size)[:, [0, -1]].ravel(), made.reshape(len(values), 2 * groups)


class Reducer:
    """Takes rows, keeps at most `limit` points of them (and the last row), at least half as many where there are more
    rows than that."""

    def __init__(self, columns: int, limit: int):
        self._limit = max(8, limit - limit % 4)
        self._times = np.empty(self._limit)
        self._values = np.empty((columns, self._limit))
        self._points, self._group, self._rows = 0, 1, 0
        self._rest = np.empty(0), np.empty((columns, 0))
        """Rows that do not make a group yet."""
        self._last = self._rest

    def add(self, times: np.ndarray, values: np.ndarray) -> None:
        """Rows: times (n,), values (columns, n)."""
        if not len(times):
            return
        self._rows += len(times)
        self._last = times[-1:].copy(), values[:, -1:].copy()
        times = np.concatenate([self._rest[0], times])
        values = np.concatenate([self._rest[1], values], axis=1)
        while True:
            if self._points == self._limit and len(times):
                self._halve()
            per_point = 1 if self._group == 1 else self._group // 2
            room = (self._limit - self._points) * per_point
            count = min(len(times) - len(times) % self._group, room)
            if count == 0:
                break
            self._put(*self._points_of(times[:count], values[:, :count], self._group))
            times, values = times[count:], values[:, count:]
        self._rest = times.copy(), values.copy()

    def _points_of(self, times: np.ndarray, values: np.ndarray, size: int) -> tuple[np.ndarray, np.ndarray]:
        return (times, values) if size == 1 else _extremes(times, values, size)

    def _put(self, times: np.ndarray, values: np.ndarray) -> None:
        end = self._points + len(times)
        self._times[self._points : end], self._values[:, self._points : end] = times, values
        self._points = end

    def _halve(self) -> None:
        times, values = _extremes(self._times, self._values, 4)
        self._points = 0
        self._put(times, values)
        self._group = 4 if self._group == 1 else 2 * self._group

    def reduced(self) -> Reduced:
        """What has come so far."""
        times, values = [self._times[: self._points]], [self._values[:, : self._points]]
        if len(self._rest[0]) > 1:
            t, v = _extremes(*self._rest, len(self._rest[0]))
            times.append(t)
            values.append(v)
        if self._group > 1:
            times.append(self._last[0])
            values.append(self._last[1])
        return Reduced(np.concatenate(times), np.concatenate(values, axis=1), self._rows, self._group)
