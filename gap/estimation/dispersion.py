"""How many readings a residual counts for: what a model misses lasts, and its neighbours say the same again."""

from __future__ import annotations

import numpy as np

from ..problem.problem import Problem


def correlation_time(x: np.ndarray) -> float:
    """1 + 2 sum of the autocorrelations of x (n,), windowed after Sokal; at least 1."""
    n = len(x)
    if n < 8 or not np.any(x):
        return 1.0
    size = 1 << (2 * n - 1).bit_length()
    f = np.fft.rfft(x, size)
    acf = np.fft.irfft(f * np.conj(f), size)[: n // 2]
    acf = acf / acf[0]
    tau = 2.0 * np.cumsum(acf) - 1.0
    window = np.flatnonzero(np.arange(len(tau)) >= 5.0 * tau)
    return float(max(1.0, tau[window[0]] if len(window) else tau[-1]))


def estimate_dispersion(problem: Problem, residual: np.ndarray) -> float:
    """Mean square of a normalised residual (n,) times its correlation time, over all blocks; at least 1.

    As if `fit.min_independent` readings counted at least, however long the residual stays on one side.
    """
    total = 0.0
    for b in problem.observations.blocks:
        part = residual[b.place]
        total += float(part @ part) * correlation_time(part)
    least = problem.settings.fit.min_independent
    most = float(residual @ residual) / max(1.0, min(least, len(residual)))
    return max(1.0, min(total / len(residual), most))


def robust_weights(problem: Problem, residual: np.ndarray) -> np.ndarray:
    """By how much each reading of a normalised residual (n,) counts in the next step, from 0 to 1.

    Where a machine swings or rests a second longer than the model, the residual is large whatever the parameters are,
    and says nothing about the way to go: there, where its RMS over a window is more than some times the channel's usual
    one, and than the noise, it counts no more than that. (An M-estimator with weights of windows.)
    """
    observations, settings = problem.observations, problem.settings.fit
    local = np.abs(residual)
    for b in observations.blocks:
        m = min(len(b.t), 1 + round(settings.outlier_window / b.interval)) if b.interval > 0.0 else 1
        if m > 1:
            ones = np.ones(m)
            power = np.convolve(residual[b.place] ** 2, ones, "same") / np.convolve(np.ones(len(b.t)), ones, "same")
            local[b.place] = np.sqrt(power)
    weights = np.ones(len(residual))
    for k in range(len(observations.span)):
        in_channel = observations.channel == k
        if not in_channel.any():
            continue
        usual = settings.outlier_from * max(1.0, float(np.median(local[in_channel])))
        weights[in_channel] = np.minimum(1.0, usual / np.maximum(local[in_channel], usual))
    return weights
