"""What is measured of a run; a number each, or None where there is none (a signal that never arrives).

x is a signal (n,) at the times t (n,) [s]. Between samples it is taken to be straight; `mean`, `rms` and `integral` are
over time, by the trapezoidal rule.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np


def _integral(t: np.ndarray, x: np.ndarray) -> float:
    return float(np.sum(0.5 * (x[1:] + x[:-1]) * np.diff(t)))


def _mean(t: np.ndarray, x: np.ndarray) -> float:
    return _integral(t, x) / float(t[-1] - t[0])


def _at(t: np.ndarray, x: np.ndarray, when: float) -> float | None:
    return float(np.interp(when, t, x)) if t[0] <= when <= t[-1] else None


def reaches(t: np.ndarray, x: np.ndarray, target: float, within: float, after: float = 0.0) -> float | None:
    """Time [s] from `after` until x (n,) at t (n,) is within `within` of `target` for the first time; None if never."""
    after = max(after, float(t[0]))
    t, x = _from(t, x, after)
    far = x - target
    passed = np.append(False, far[1:] * far[:-1] < 0.0)  # between two points, if not at one
    arrived = np.flatnonzero((np.abs(far) <= within) | passed)
    if not len(arrived):
        return None
    k = int(arrived[0])
    return 0.0 if k == 0 else _enters(t, far, within, k - 1) - after


def _settles(
    t: np.ndarray, x: np.ndarray, target: float, within: float, after: float = 0.0, until: float = np.inf
) -> float | None:
    after = max(after, float(t[0]))
    if until < after:
        return None
    if until < t[-1]:  # which need not be a sample's time either
        t, x = np.append(t[t < until], until), np.append(x[t < until], np.interp(until, t, x))
    t, x = _from(t, x, after)
    if not len(t):
        return None
    far = x - target
    outside = np.flatnonzero(np.abs(far) > within)
    if not len(outside):
        return 0.0
    k = int(outside[-1])
    return None if k == len(t) - 1 else _enters(t, far, within, k) - after


def _from(t: np.ndarray, x: np.ndarray, after: float) -> tuple[np.ndarray, np.ndarray]:
    """The signal from a time on, which need not be that of a sample."""
    if not len(t) or after <= t[0]:
        return t, x
    start = int(np.searchsorted(t, after))
    if start == len(t) or t[start] == after:
        return t[start:], x[start:]
    return np.append(after, t[start:]), np.append(np.interp(after, t, x), x[start:])


def _enters(t: np.ndarray, far: np.ndarray, within: float, k: int) -> float:
    """When the straight line from sample k, which is more than `within` from 0, to the next one has come that near."""
    edge = np.copysign(within, far[k])
    return float(t[k] + (t[k + 1] - t[k]) * (far[k] - edge) / (far[k] - far[k + 1]))


def _above(t: np.ndarray, x: np.ndarray, level: float) -> float:
    """Straight lines between samples."""
    a, b = x[:-1] - level, x[1:] - level
    share = np.where((a > 0) & (b > 0), 1.0, 0.0)
    crossing = (a > 0) != (b > 0)
    share[crossing] = np.maximum(a, b)[crossing] / np.abs(b - a)[crossing]
    return float(np.sum(share * np.diff(t)))


FUNCTIONS: Mapping[str, tuple[Callable[..., float | None], int, int]] = {
    "initial": (lambda t, x: float(x[0]), 0, 0),
    "final": (lambda t, x: float(x[-1]), 0, 0),
    "min": (lambda t, x: float(x.min()), 0, 0),
    "max": (lambda t, x: float(x.max()), 0, 0),
    "mean": (_mean, 0, 0),
    "rms": (lambda t, x: _mean(t, x * x) ** 0.5, 0, 0),
    "range": (lambda t, x: float(np.ptp(x)), 0, 0),
    "integral": (_integral, 0, 0),
    "at": (_at, 1, 1),
    "reaches": (reaches, 2, 3),
    "settles": (_settles, 2, 4),
    "above": (_above, 1, 1),
}
"""Function, least and most numbers after the connector."""
