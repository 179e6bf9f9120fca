"""Local least squares in the unit cube for a function that costs much: a Jacobian, then Broyden's updates of it.

Six unknowns meet four residuals, so the step is the shortest one: each start goes to a solution near it, and what comes
of many starts is spread over the set of solutions as they were.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

STEPS = 16
"""Most steps of a fit, the differences for a Jacobian not counted."""

AHEAD = 0.01
"""Step of the finite differences, of the cube's edge."""

RADIUS = 0.2
"""How far a step may go at first; a step that makes it worse halves that."""

SHORT = 1e-2
"""Weight of the step's length beside residuals in percent."""

Residuals = Callable[[np.ndarray], np.ndarray | None]
"""Residuals (m,) of a point (n,); None where there are none."""


def fit(residuals: Residuals, start: np.ndarray, free: np.ndarray, good: float) -> tuple[np.ndarray, float]:
    """The point (n,) that is found from the start and its greatest residual, infinite where the start has none.

    free: which coordinates (n,) move; good: greatest residual that is small enough.
    """
    u, r = start, residuals(start)
    slopes = None if r is None else _slopes(residuals, u, r, free)
    if r is None or slopes is None:
        return u, np.inf
    radius, fresh = RADIUS, True
    for _ in range(STEPS):
        if np.abs(r).max() <= good or radius < 1e-3:
            break
        step = _step(slopes, r, u, radius)
        after = residuals(u + step)
        worse = after is None or after @ after > 0.5 * (r @ r)
        if after is not None:
            slopes = slopes + np.outer(after - r - slopes @ step, step) / max(step @ step, 1e-12)
            slopes[:, ~free] = 0.0
            if after @ after < r @ r:
                u, r, fresh = u + step, after, False
            else:
                radius = 0.5 * float(np.abs(step).max())
        else:
            radius *= 0.25
        if worse and not fresh:  # the updates lead nowhere any more
            slopes, fresh = _slopes(residuals, u, r, free), True
            if slopes is None:
                break
    return u, float(np.abs(r).max())


def _slopes(residuals: Residuals, u: np.ndarray, r: np.ndarray, free: np.ndarray) -> np.ndarray | None:
    found = np.zeros((len(r), len(u)))
    for k in np.flatnonzero(free):
        ahead = u.copy()
        ahead[k] += AHEAD if u[k] < 0.5 else -AHEAD
        there = residuals(ahead)
        if there is None:
            return None
        found[:, k] = (there - r) / (ahead[k] - u[k])
    return found


def _step(slopes: np.ndarray, r: np.ndarray, u: np.ndarray, radius: float) -> np.ndarray:
    """The short step (n,) that makes the linear residuals least within the cube and the radius."""
    from scipy.optimize import lsq_linear

    n = len(u)
    matrix = np.vstack([slopes, SHORT * np.eye(n)])
    low, high = np.maximum(-u, -radius), np.minimum(1.0 - u, radius)
    low, high = np.minimum(low, -1e-12), np.maximum(high, 1e-12)  # at a wall; the solver wants an interval
    step: np.ndarray = lsq_linear(matrix, np.concatenate([-r, np.zeros(n)]), (low, high)).x
    step = np.clip(u + step, 0.0, 1.0) - u
    return step
