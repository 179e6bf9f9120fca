"""How finely a channel can be read: noise and quantisation, from the data alone."""

from __future__ import annotations

import numpy as np

WINDOW = 40
"""Samples of a window within which the noise is estimated."""


def rms(residual: np.ndarray) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(residual * residual)))


def quantum(y: np.ndarray) -> float:
    """The step of the converter if the readings y (n,) lie on a grid of fewer than 2^14 steps, otherwise 0."""
    levels = np.unique(y)
    if len(levels) < 3 or len(levels) > 0.8 * len(y):
        return 0.0
    gaps = np.diff(levels)
    step = float(gaps.min())
    span = float(levels[-1] - levels[0])
    if step <= 1e-9 * max(abs(levels[0]), abs(levels[-1])) or span / step > 2**14:
        return 0.0
    whole = gaps / step
    return step if np.mean(np.abs(whole - np.round(whole)) < 0.05) > 0.95 else 0.0


def noise_std(y: np.ndarray) -> float:
    """Standard deviation of white noise on a smooth signal y (n,), in its unit.

    Third differences remove what a parabola can follow; a window in which the signal itself is rough says too much, so
    the quieter half of the windows counts. For white noise the estimate is unbiased.
    """
    if len(y) < 8:
        return 0.0
    d = np.diff(y, 3) / np.sqrt(20.0)
    count = max(1, len(d) // WINDOW)
    powers = np.array([np.mean(part * part) for part in np.array_split(d, count)])
    still = powers > 1e-30 * max(1.0, float(np.max(np.abs(y))) ** 2)
    if not still.any():
        return 0.0
    powers = np.sort(powers[still])
    # the expectation of the quieter half's mean, for white noise with the correlation of third differences
    quiet = powers[: max(1, (len(powers) + 1) // 2)].mean()
    return float(np.sqrt(quiet / _quiet_share(len(powers))))


def _quiet_share(windows: int) -> float:
    """Mean of the lower half of the windows' powers over the mean of all, for white noise; tends to 0.74 for many."""
    if windows == 1:
        return 1.0
    return 0.74 + 0.26 / windows


def spread(y: np.ndarray) -> float:
    """Floor of a channel (its unit): noise and quantisation, never zero."""
    q = quantum(y)
    floor = np.hypot(noise_std(y), q / np.sqrt(12.0)) if q == 0.0 else max(noise_std(y), q / np.sqrt(12.0))
    tiny = 1e-6 * float(np.ptp(y)) or 1e-9 * float(np.max(np.abs(y))) or 1e-12
    return float(max(floor, tiny))
