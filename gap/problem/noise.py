"""How finely a channel can be read: noise and quantisation, from the data alone."""

from __future__ import annotations

import numpy as np

from ..measurements.clock import jitters
from ..settings import NoiseSettings


def rms(residual: np.ndarray) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(residual * residual)))


def rms_of_runs(residual: np.ndarray, run: np.ndarray, count: int) -> np.ndarray:
    """That of each of so many runs (count,); residual, and which run each of it is of (n,)."""
    return np.array([rms(residual[run == r]) for r in range(count)])


def quantisation_step(y: np.ndarray, settings: NoiseSettings) -> float:
    """The step of the converter if the readings y (n,) lie on a grid of not too many steps, otherwise 0."""
    levels = np.unique(y)
    if len(levels) < 3 or len(levels) > 0.8 * len(y):
        return 0.0
    gaps = np.diff(levels)
    step = float(gaps.min())
    span = float(levels[-1] - levels[0])
    if step <= 1e-9 * max(abs(levels[0]), abs(levels[-1])) or span / step > settings.max_quantisation_levels:
        return 0.0
    whole = gaps / step
    return step if np.mean(np.abs(whole - np.round(whole)) < 0.05) > 0.95 else 0.0


def estimate_noise_std(y: np.ndarray, settings: NoiseSettings, t: np.ndarray | None = None) -> float:
    """Standard deviation of white noise on a smooth signal y (n,), in its unit; t (n,): its times, if not even.

    Third differences remove what a parabola can follow; a window in which the signal itself is rough says too much, so
    the quieter half of the windows counts. For white noise the estimate is unbiased.
    """
    if len(y) < 8:
        return 0.0
    d = np.diff(y, 3) / np.sqrt(20.0) if t is None or not jitters(t) else _third_differences(t, y)
    count = max(1, len(d) // settings.window)
    powers = np.array([np.mean(part * part) for part in np.array_split(d, count)])
    still = powers > 1e-30 * max(1.0, float(np.max(np.abs(y))) ** 2)
    if not still.any():
        return 0.0
    powers = np.sort(powers[still])
    # the expectation of the quieter half's mean, for white noise with the correlation of third differences
    quiet = powers[: max(1, (len(powers) + 1) // 2)].mean()
    return float(np.sqrt(quiet / _quiet_share(len(powers))))


def _third_differences(t: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Divided differences (n - 3,) of readings y (n,) at uneven times t (n,), of the noise's standard deviation.

    A clock that jitters by 3 % of an interval makes a position that moves look six times as noisy as it is, where its
    readings are taken as even.
    """
    times = np.stack([t[i : len(t) - 3 + i] for i in range(4)])
    readings = np.stack([y[i : len(y) - 3 + i] for i in range(4)])
    weights = np.stack([1.0 / np.prod([times[i] - times[j] for j in range(4) if j != i], axis=0) for i in range(4)])
    differences: np.ndarray = (weights * readings).sum(0) / np.sqrt((weights * weights).sum(0))
    return differences


def _quiet_share(windows: int) -> float:
    """Mean of the lower half of the windows' powers over the mean of all, for white noise; tends to 0.74 for many."""
    if windows == 1:
        return 1.0
    return 0.74 + 0.26 / windows


def estimate_channel_noise(y: np.ndarray, settings: NoiseSettings, t: np.ndarray | None = None) -> float:
    """Noise of a channel's readings y (n,) in their unit: white noise or the converter's step, never zero.

    t (n,): their times, if these are not even.
    """
    step = quantisation_step(y, settings) / np.sqrt(12.0)
    noise = max(estimate_noise_std(y, settings, t), step)
    tiny = 1e-6 * float(np.ptp(y)) or 1e-9 * float(np.max(np.abs(y))) or 1e-12
    return float(max(noise, tiny))
