"""Smoothing of measured signals, and signals of a model that are the rate of another one."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from .noise import rms


class Smoothed(NamedTuple):
    """Value and slope (n,) of a smoothed signal."""

    value: np.ndarray
    slope: np.ndarray


def smooth(t: np.ndarray, y: np.ndarray, at: np.ndarray, kernel: float) -> Smoothed:
    """Value and slope at times `at` of a local straight line with Gaussian weights of standard deviation
    `kernel`; t increasing, all in s."""
    value, slope = np.empty(len(at)), np.empty(len(at))
    low, high = np.searchsorted(t, at - 4 * kernel), np.searchsorted(t, at + 4 * kernel, side="right")
    for i, x in enumerate(at):
        a, b = low[i], high[i]
        if b - a < 3:
            a, b = max(0, a - 2), min(len(t), b + 2)
        d = t[a:b] - x
        w = np.exp(-0.5 * (d / kernel) ** 2) + 1e-9
        s0, s1, s2 = w.sum(), w @ d, w @ (d * d)
        m0, m1 = w @ y[a:b], w @ (d * y[a:b])
        det = s0 * s2 - s1 * s1
        value[i], slope[i] = (s2 * m0 - s1 * m1) / det, (s0 * m1 - s1 * m0) / det
    return Smoothed(value, slope)


def rate_pairs(names: Sequence[str], rows: np.ndarray, step: float) -> list[tuple[str, str]]:
    """(a, b) where signal a is the rate of signal b, found in rows (n, names) of the model itself."""
    pairs = []
    for i, a in enumerate(names):
        for j, b in enumerate(names):
            v, dx = rows[:, i], np.gradient(rows[:, j], step)
            if i != j and np.ptp(v) > 0 and np.ptp(dx) > 0 and rms(v - dx) < 0.05 * np.std(v):
                pairs.append((a, b))
    return pairs
