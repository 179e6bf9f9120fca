"""When a machine has done something: moments at which the course of a channel changes its level or its slope."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..settings import FaultSettings
from .table import FloatArray


def kinks(t: FloatArray, y: FloatArray, settings: FaultSettings) -> FloatArray:
    """How much the course of readings y (n,) at times t (n,) changes before each of them (n,) [unit of y].

    The larger of the jump between the straight lines through the readings of a window before and after, and of the
    difference of their slopes times its length. Near the ends, and where readings are missing, 0.
    """
    n, w = len(y), settings.event_window
    change = np.zeros(n)
    if n < 2 * w + 1:
        return change
    windows = np.lib.stride_tricks.sliding_window_view(y, w)
    k = np.arange(w) - (w - 1) / 2.0
    slope = windows @ k / (k @ k)
    mean = windows.mean(axis=1)
    before, after = slice(0, n - 2 * w + 1), slice(w, n - w + 1)
    half_window = w / 2.0  # from a window's middle to the middle between both
    jump = np.abs(mean[after] - slope[after] * half_window - (mean[before] + slope[before] * half_window))
    change[w : n - w + 1] = np.maximum(jump, np.abs(slope[after] - slope[before]) * w)
    for hole in np.flatnonzero(np.diff(t) > settings.hole * np.median(np.diff(t))):
        change[max(hole + 2 - w, 0) : hole + 1 + w] = 0.0
    return change


def has_event(kink: FloatArray, k: int, noise: float, settings: FaultSettings) -> bool:
    """Whether the course of a channel changes unusually at its sample k, and most just there; `noise` in its unit."""
    vicinity, w = settings.event_vicinity, settings.event_window
    size = _largest(kink, k, settings.event_at)
    around = np.r_[kink[max(k - vicinity, 0) : max(k - 10, 0)], kink[k + 10 : k + vicinity]]
    usual = float(np.median(around)) if len(around) else 0.0
    return size >= 0.8 * _largest(kink, k, w) and size > settings.event * (usual + noise)


def happens_elsewhere(kink: FloatArray, k: int, marked: Sequence[int], settings: FaultSettings) -> bool:
    """Whether the course of a channel changes as much as at its sample k at one that is far from k and all marked."""
    elsewhere = kink >= settings.event_alike * _largest(kink, k, settings.event_at)
    for sample in (k, *marked):
        elsewhere[max(sample - 2 * settings.event_window, 0) : sample + 2 * settings.event_window + 1] = False
    return bool(elsewhere.any())


def _largest(kink: FloatArray, k: int, reach: int) -> float:
    """The largest within `reach` samples of k."""
    return float(kink[max(k - reach, 0) : k + reach + 1].max(initial=0.0))
