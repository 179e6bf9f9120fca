"""How sure the figures are: intervals of parameters and of the reduction."""

from __future__ import annotations

import numpy as np

from .calibration import Calibration
from .fit import Fit, Linear
from .problem import Problem

BIN = 0.5
"""Stretch of time [s] that is drawn together at least."""

WIDTH = 1.96


def parameter_std(problem: Problem, fit: Fit, N: np.ndarray) -> np.ndarray:
    """Standard deviation of each u (k,): the curvature of the cost with base parameters and nuisances free.

    A reading counts for less than its noise allows. A machine whose effect is of another mathematical form than the
    library's leaves a residual of the energy that calibration knows (`discrepancy`, floors squared), which lasts, so
    that n readings are as few independent pieces as a wrong model's (`independent`): n energies over that number.
    """
    calibration = Calibration.load()
    form = calibration.discrepancy * len(problem.obs) / calibration.independent
    H = Linear(problem, fit.u, fit.model, fit.jacobian, N).curvature(fit.unknowns, fit.phi + form)
    return np.sqrt(np.maximum(np.diag(np.linalg.inv(H))[: len(fit.u)], 0.0))


def reduction_interval(problem: Problem, before: np.ndarray, after: np.ndarray) -> tuple[float, float]:
    """95 % interval of 1 - RMS(after) / RMS(before), by a stationary block bootstrap over time; -1 at least."""
    from arch.bootstrap import StationaryBootstrap, optimal_block_length

    obs = problem.obs
    place = (obs.time / BIN).astype(int) + obs.run * (int(obs.time.max() / BIN) + 1)
    _, place = np.unique(place, return_inverse=True)
    sums = np.stack([np.bincount(place, before**2), np.bincount(place, after**2)], axis=1)
    sums = sums[sums.sum(1) > 0.0]  # limits that are kept say nothing
    if len(sums) < 2:
        return -1.0, 1.0

    def reduction(x: np.ndarray) -> float:
        total = x.sum(0)
        return max(-1.0, float(1.0 - np.sqrt(total[1] / max(total[0], 1e-300))))

    length = 2.0
    if len(sums) > 10 and np.ptp(sums[:, 1]) > 0:
        length = float(np.clip(optimal_block_length(sums[:, 1])["stationary"].iloc[0], 1.0, len(sums) / 3))
    draws = StationaryBootstrap(length, sums, seed=0).apply(reduction, 400)[:, 0]
    low, high = np.quantile(draws, [0.025, 0.975])
    return float(low), float(high)
