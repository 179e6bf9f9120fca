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
