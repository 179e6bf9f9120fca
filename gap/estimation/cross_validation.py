"""What a fit says about data it has not seen.

Folds leave out one twentieth of the time of every run in turn. The refit without a fold is linear around the fit of all
data, so it costs no simulation; runs that the campaign itself holds out are simulated.
"""

from __future__ import annotations

import numpy as np

from ..problem.noise import rms
from ..problem.observations import Observations
from ..problem.problem import Problem
from .gauss_newton import Fit, Linear

FOLDS = 20
NEAR = 0.5
"""How far a refit without a fold may move, in u: beyond, the model is not linear."""


def folds(obs: Observations, stretches: int = FOLDS, count: int = FOLDS) -> list[np.ndarray]:
    """Masks (n,) of the entries left out in turn; together they are all entries.

    Each run is cut into so many stretches of time, which are dealt out to `count` folds, runs shifted to each other.
    Readings that are single moments are dealt out run by run.
    """
    long = max(float(obs.time.max()), 1e-12) / stretches * (1.0 + 1e-12)
    alone = np.zeros(len(obs), bool)
    for b in obs.blocks:
        alone[b.place] = b.moment is not None
    place = np.where(alone, 0, (obs.time / long).astype(int)) + np.where(alone, 1, 7) * obs.run
    return [mask for k in range(count) if (mask := place % count == k).any()]


def left_out(problem: Problem, fit: Fit, N: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(residual, spread) of every entry (n,), predicted by a refit without its fold, both in floors.

    The spread is what the prediction can be trusted with: the floor and what the readings that were not left out leave
    open of the unknowns. With long records of several channels it is the floor alone; of a few single moments, or of
    the one run that shows a parameter, each matters to the fit and is not well predicted by the others.
    """
    lin = Linear(problem, fit.u, fit.model, fit.jacobian, N)
    residual, spread = np.empty(len(problem.obs)), np.empty(len(problem.obs))
    radius = np.full(len(fit.u), NEAR)
    for mask in folds(problem.obs):
        rest, part = lin.without(mask), lin.A[mask]
        d, q = rest.step(fit.unknowns, fit.phi, radius)
        residual[mask] = lin.left(d, q)[mask]
        covariance = np.linalg.inv(rest.curvature(fit.unknowns, 1.0))
        spread[mask] = np.sqrt(1.0 + np.einsum("ij,jk,ik->i", part, covariance, part))
    return residual, spread


def by_run(problem: Problem, fit: Fit, N: np.ndarray) -> list[float]:
    """RMS of each run, in floors, as the fit of all others foretells it; linear around the fit, as `left_out` is."""
    lin = Linear(problem, fit.u, fit.model, fit.jacobian, N)
    radius, made = np.full(len(fit.u), NEAR), []
    for r in range(len(problem.runs)):
        mask = problem.obs.run == r
        made.append(rms(lin.left(*lin.without(mask).step(fit.unknowns, fit.phi, radius))[mask]))
    return made


def held_out(problem: Problem, fit: Fit, N: np.ndarray) -> tuple[np.ndarray, float]:
    """The left-out residual (n,) in floors, and the energy that it shares in units of its spread."""
    residual, spread = left_out(problem, fit, N)
    return residual, max(0.0, problem.obs.shared(residual / spread))
