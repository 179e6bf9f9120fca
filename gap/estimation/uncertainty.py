"""How sure the figures are: intervals of parameters and of the reduction."""

from __future__ import annotations

import numpy as np

from ..problem.problem import Problem
from .gauss_newton import Fit, Linear

BIN = 0.5
"""Stretch of time [s] that is drawn together at least."""

WIDTH = 1.96

FORM, FORM_OF_BASE, FORM_ENERGY = 0.05, 0.3, 0.01
"""What a machine's effect of another mathematical form than the library's does to estimates: a share of the effect's
own value; of a base parameter's tolerance; and the energy in floors squared that lasts through all readings, so that
these count as one piece of it. Measured on development cases of the blind benchmark: with them 94 % of the effects'
and 93 % of the base parameters' intervals held the truth, with noise alone 34 % and 60 %."""


def data_std(problem: Problem, fit: Fit, N: np.ndarray, energy: float = 0.0) -> np.ndarray:
    """Standard deviation of each u (k,) from the cost's curvature, base parameters and nuisances free.

    energy: what lasts through all readings beyond the noise, in floors squared.
    """
    line = Linear(problem, fit.u, fit.model, fit.jacobian, N)
    H = line.curvature(fit.unknowns, fit.phi + energy * len(problem.obs))
    return np.sqrt(np.maximum(np.diag(np.linalg.inv(H))[: len(fit.u)], 0.0))


def parameter_std(problem: Problem, fit: Fit, N: np.ndarray) -> np.ndarray:
    """Standard deviation of each u (k,) with what the library's forms leave open; a base parameter's is its prior's
    at most."""
    std = data_std(problem, fit, N, FORM_ENERGY)
    base = np.array([x.kind == "base" for x in fit.unknowns], dtype=bool)
    wider = np.hypot(std, np.where(base, FORM_OF_BASE, FORM * np.abs(fit.u)))
    return np.where(base, np.minimum(wider, [x.sd for x in fit.unknowns]), wider)


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
