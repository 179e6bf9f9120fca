"""Two runs at the same times, whose own times may differ."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...core.errors import UsageError

ROUNDING = 1e-9
"""Times that lie nearer to each other than this share of a step are the same."""


@dataclass(frozen=True)
class CommonTimes:
    """The times at which two runs are compared."""

    times: np.ndarray
    """(n,) [s]"""
    a: np.ndarray
    """Times of the first run (rows,) [s], and of the second."""
    b: np.ndarray
    same: bool
    """Whether both have just these times."""

    @property
    def shared(self) -> bool:
        """Whether both have a row at each of the times, so that nothing has to be resampled."""
        return self.same or all(self._is_row(own).all() for own in (self.a, self.b))

    def numbers(self, own: np.ndarray, column: np.ndarray, held: bool) -> np.ndarray:
        """A column of the run whose times are `own` at the common times: on straight lines between its rows, or, where
        that would make values that are none (switches, whole numbers), as it was held."""
        if self.same:
            return column
        as_held: np.ndarray = column[self._held(own)]
        if held:
            return as_held
        # rows as they are, be it beside a value that is none
        return np.asarray(np.where(self._is_row(own), as_held, np.interp(self.times, own, column)))

    def texts(self, own: np.ndarray, column: Sequence[str]) -> list[str]:
        """Likewise of texts, which are held."""
        return list(column) if self.same else [column[k] for k in self._held(own)]

    def _is_row(self, own: np.ndarray) -> np.ndarray:
        return np.asarray(np.abs(own[self._held(own)] - self.times) <= ROUNDING * _step(own))

    def _held(self, own: np.ndarray) -> np.ndarray:
        return np.asarray(np.maximum(np.searchsorted(own, self.times + ROUNDING * _step(own), side="right") - 1, 0))


def _step(times: np.ndarray) -> float:
    return float(times[-1] - times[0]) / max(1, len(times) - 1)


def common_times(a: np.ndarray, b: np.ndarray) -> CommonTimes:
    """Of runs with times a and b [s]: the rows, in the time that both have, of the one with fewer of them.

    So a run that was recorded more coarsely is compared at its own rows. Raises `UsageError` for runs without a time in
    common.
    """
    if not len(a) or not len(b):
        raise UsageError("there are no rows to compare")
    if len(a) == len(b) and np.abs(a - b).max() <= ROUNDING * _step(a):
        return CommonTimes(a, a, b, True)
    low, high = max(a[0], b[0]), min(a[-1], b[-1])
    if low > high:
        raise UsageError(f"they have no time in common: {a[0]:g} to {a[-1]:g} s, and {b[0]:g} to {b[-1]:g} s")
    slack = ROUNDING * max(_step(a), _step(b))
    inside = [own[(own >= low - slack) & (own <= high + slack)] for own in (a, b)]
    fewer = min((times for times in inside if len(times)), key=len, default=np.array([low]))
    return CommonTimes(fewer, a, b, False)
