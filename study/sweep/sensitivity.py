"""How much of a metric's variation each parameter of a sample makes."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.polynomial import legendre

from ...core.cli import need
from .axes import Axis
from .cases import Case, problem

FEWEST = 50
"""Cases below which nothing is said."""

DEGREE = 10
"""Highest degree of the polynomials in one parameter."""

CASES_A_VALUE = 5
"""Least cases for each number that is fitted to them."""

RESAMPLES = 200
"""Of the bootstrap that half widths come from."""


def sensitivities(
    axes: Sequence[Axis], kind: str, cases: Sequence[Case], values: Sequence[float | None]
) -> dict[str, Any] | str:
    """Shares of the metric's variance by parameter, first order and (after Saltelli) total, with 95 % half widths.

    `saltelli`: Sobol indices by SALib; other samples: first-order indices by regression on each parameter alone.
    (RBD-FAST orders the sample anew; in a Sobol sequence, which is ordered already, that mixes up the parameters: it is
    off by up to 0.5 for a linear model.) A text that says why where there are none.
    """
    y = np.array([np.nan if v is None else v for v in values])
    seen = np.isfinite(y)
    if seen.sum() < FEWEST:
        return f"only {seen.sum()} cases have a value; {FEWEST} are needed"
    if np.ptp(y[seen]) <= 1e-12 * np.max(np.abs(y[seen])):
        return "it does not vary"
    if kind != "saltelli":
        alone = {}
        for axis in axes:
            x = np.array([position(axis, c[axis.name]) for c in cases])[seen]
            alone[axis.name] = _share(*explained(x, y[seen], not axis.is_range))
        return {"first order": alone}
    if not seen.all():
        return f"{np.sum(~seen)} of {len(seen)} cases have no value, and Saltelli's method needs all (lhs:N does not)"
    need("study", "SALib")
    from SALib.analyze import sobol

    names = [a.name for a in axes]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        found = sobol.analyze(problem(axes), y, calc_second_order=True, seed=0)
    return {
        kind: {n: _share(v, c) for n, v, c in zip(names, found[a], found[f"{a}_conf"], strict=True)}
        for kind, a in (("first order", "S1"), ("total", "ST"))
    }


def explained(x: np.ndarray, y: np.ndarray, levels: bool) -> tuple[float, float]:
    """(share of the variance of y (n,) that the mean of y at given x (n,) in [0, 1] makes, its 95 % half width).

    levels: x is of a list, and where that has few values the mean is that of each; else it is a polynomial whose degree
    foretells best what is left out one by one. The share is adjusted for the degrees of freedom, so that what has no
    part in y has none on average.
    """
    levels = levels and len(np.unique(x)) <= len(y) // CASES_A_VALUE
    basis = _levels(x) if levels else legendre.legvander(2.0 * x - 1.0, min(DEGREE, len(y) // CASES_A_VALUE - 1))
    if basis.shape[1] < 2:
        return 0.0, 0.0
    count = basis.shape[1] if levels else _columns(basis, y)
    basis = basis[:, :count]
    rng = np.random.default_rng(0)
    draws = []
    for _ in range(RESAMPLES):
        rows = rng.integers(0, len(y), len(y))
        if np.ptp(y[rows]) > 0.0:
            draws.append(_adjusted(basis[rows], y[rows]))
    return _adjusted(basis, y), 1.96 * float(np.std(draws)) if draws else 0.0


def _levels(x: np.ndarray) -> np.ndarray:
    return (x[:, None] == np.unique(x)).astype(float)


def _columns(basis: np.ndarray, y: np.ndarray) -> int:
    """How many of the basis' columns foretell best what is left out."""
    Q, _ = np.linalg.qr(basis)
    parts = Q * (Q.T @ y)
    fits, leverage = np.cumsum(parts, axis=1), np.cumsum(Q * Q, axis=1)
    errors = np.mean(((y[:, None] - fits) / (1.0 - np.minimum(leverage, 0.99))) ** 2, axis=0)
    return int(np.argmin(errors)) + 1


def _adjusted(basis: np.ndarray, y: np.ndarray) -> float:
    n, p = len(y), basis.shape[1]
    if p < 2 or n <= p:
        return 0.0
    left = y - basis @ np.linalg.lstsq(basis, y, rcond=None)[0]
    return float(1.0 - (left @ left / (n - p)) / np.var(y, ddof=1))


def position(axis: Axis, value: Any) -> float:
    """Where a value lies on its axis, from 0 to 1."""
    if axis.is_range:
        return (value - axis.low) / (axis.high - axis.low)
    return (axis.values.index(value) + 0.5) / len(axis.values)


def _share(value: float, half_width: float) -> dict[str, float]:
    return {"value": float(min(max(value, 0.0), 1.0)), "half_width": float(half_width)}
