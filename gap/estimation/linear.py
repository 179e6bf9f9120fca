"""The linearised problem around a point, with its priors and bounds."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.optimize import lsq_linear

from ..problem.parameters import EstimatedParameter
from ..problem.problem import Problem


class LinearStep(NamedTuple):
    """The change d (k,) of the normalised parameters that lowers the cost most, and the nuisances q (m,)."""

    d: np.ndarray
    q: np.ndarray


class LinearisedModel:
    """Whitened columns of parameters and nuisances around a point, and the residual without them.

    A (n, k + m), r (n,), u (k,); gram = A^T A, moment = A^T r.
    """

    def __init__(self, columns: np.ndarray, residual: np.ndarray, u: np.ndarray, gram: np.ndarray, rhs: np.ndarray):
        self.A, self.r, self.u, self.gram, self.rhs = columns, residual, u, gram, rhs

    @classmethod
    def around(
        cls, problem: Problem, u: np.ndarray, model: np.ndarray, jacobian: np.ndarray, nuisance_jacobian: np.ndarray,
        rows: slice | np.ndarray = slice(None), weights: np.ndarray | float = 1.0,
    ) -> LinearisedModel:  # fmt: skip
        """At normalised parameters u (k,) with the model's prediction (n,) and its derivative (n, k).

        rows: the readings that count; weights: by how much each of them counts.
        """
        noise = problem.observations.noise_std
        w = np.broadcast_to(weights / noise, noise.shape)[rows]
        columns = np.concatenate([jacobian[rows], nuisance_jacobian[rows]], axis=1) * w[:, None]
        residual = (problem.observations.y - model)[rows] * w
        return cls(columns, residual, u, columns.T @ columns, columns.T @ residual)

    def leave_out(self, mask: np.ndarray) -> LinearisedModel:
        """The same without the entries of the mask (n,), for `step` only."""
        part, r = self.A[mask], self.r[mask]
        return LinearisedModel(self.A, self.r, self.u, self.gram - part.T @ part, self.rhs - part.T @ r)

    def curvature(self, parameters: Sequence[EstimatedParameter], dispersion: float) -> np.ndarray:
        """Half the second derivative of the cost by parameters and nuisances (k + m, k + m), their priors included."""
        nuisances = self.A.shape[1] - len(parameters)
        prior = np.diag([*(1.0 / x.sd**2 for x in parameters), *[1.0] * nuisances])
        curvature: np.ndarray = self.gram / dispersion + prior
        return curvature

    def step(self, parameters: Sequence[EstimatedParameter], dispersion: float, radius: np.ndarray) -> LinearStep:
        """The step within bounds and radius (k,) that lowers the cost most."""
        k, m = len(parameters), self.A.shape[1] - len(parameters)
        sd = np.array([x.sd for x in parameters])
        H, g = self.curvature(parameters, dispersion), self.rhs / dispersion
        g[:k] -= self.u / sd**2
        low = np.maximum(np.array([x.low for x in parameters]) - self.u, -radius)
        high = np.minimum(np.array([x.high for x in parameters]) - self.u, radius)
        low, high = np.minimum(low, 0.0), np.maximum(high, 0.0)
        scale = 1.0 / np.sqrt(np.diag(H))
        L = np.linalg.cholesky(H * np.outer(scale, scale) + 1e-12 * np.eye(k + m))
        rhs = np.linalg.solve(L, g * scale)
        d = np.linalg.solve(L.T, rhs)
        lo = np.concatenate([low, np.full(m, -np.inf)]) / scale
        hi = np.concatenate([high, np.full(m, np.inf)]) / scale
        if np.any(d < lo) or np.any(d > hi):
            hi = np.where(hi - lo < 1e-12, lo + 1e-9, hi)
            d = lsq_linear(L.T, rhs, (lo, hi), method="bvls").x
        d = d * scale
        return LinearStep(d[:k], d[k:])

    def predicted_residual(self, step: LinearStep) -> np.ndarray:
        """Whitened residual (n,) after a step."""
        residual: np.ndarray = self.r - self.A @ np.concatenate(step)
        return residual


class ProfiledPoint(NamedTuple):
    """The nuisances (m,) that fit best at a point, and the whitened residual (n,) that is left with them."""

    nuisances: np.ndarray
    residual: np.ndarray


def profile_nuisances(
    problem: Problem, model: np.ndarray, nuisance_jacobian: np.ndarray, dispersion: float,
    weights: np.ndarray | float = 1.0,
) -> ProfiledPoint:  # fmt: skip
    """Nuisances and residual of the model's prediction (n,), of which each reading counts with its weight."""
    no_columns = np.zeros((len(model), 0))
    linearised = LinearisedModel.around(problem, np.zeros(0), model, no_columns, nuisance_jacobian, weights=weights)
    q = linearised.step((), dispersion, np.zeros(0)).q
    return ProfiledPoint(q, linearised.r - linearised.A @ q)
