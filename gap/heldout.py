"""What a fit says about data it has not seen.

Folds leave out one run at a time, or with a single run every fifth stretch of time. The refit without a fold is linear
around the fit of all data, so it costs no simulation; runs that the campaign itself holds out are simulated.
"""

from __future__ import annotations

import numpy as np

from .fit import Fit, Linear
from .observations import Observations
from .problem import Problem

FOLDS = 5
NEAR = 0.5
"""How far a refit without a fold may move, in u: beyond, the model is not linear."""

STRETCH = 1.0
"""Length of a stretch of time [s] at least."""


def folds(obs: Observations, stretches: int = 0) -> list[np.ndarray]:
    """Masks (n,) of the entries left out in turn; together they are all entries.

    stretches: leave out every fifth of so many stretches of time, whatever the number of runs.
    """
    runs = np.unique(obs.run)
    if stretches:
        long = obs.time.max() / stretches
    elif len(runs) >= 3:
        return [obs.run == r for r in runs]
    else:
        long = max(obs.time.max() / (4 * FOLDS), min(STRETCH, obs.time.max() / FOLDS))
    stretch = (obs.time / long).astype(int) + obs.run
    return [stretch % FOLDS == k for k in range(FOLDS)]


def left_out(problem: Problem, fit: Fit, N: np.ndarray) -> np.ndarray:
    """Whitened residual (n,) of every entry, predicted by a refit without its fold."""
    lin = Linear(problem, fit.u, fit.model, fit.jacobian, N)
    made = np.empty(len(problem.obs))
    radius = np.full(len(fit.u), NEAR)
    for mask in folds(problem.obs):
        if not mask.any():
            continue
        d, q = lin.without(mask).step(fit.unknowns, fit.phi, radius)
        made[mask] = lin.left(d, q)[mask]
    return made


def rms(residual: np.ndarray) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(residual * residual)))
