"""How much of a metric's variation each parameter of a sample makes, with SALib."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from typing import Any

import numpy as np

from ...core.cli import need
from .axes import Axis
from .cases import Case, problem

FEWEST = 50
"""Cases below which nothing is said."""


def sensitivities(
    axes: Sequence[Axis], kind: str, cases: Sequence[Case], values: Sequence[float | None]
) -> dict[str, Any] | str:
    """Shares of the metric's variance by parameter, first order and (after Saltelli) total, with 95 % half widths.

    `saltelli`: Sobol indices; other samples: first-order indices from the given data (RBD-FAST, Tarantola et al. 2006).
    A text that says why where there are none.
    """
    y = np.array([np.nan if v is None else v for v in values])
    seen = np.isfinite(y)
    if seen.sum() < FEWEST:
        return f"only {seen.sum()} cases have a value; {FEWEST} are needed"
    if np.ptp(y[seen]) <= 1e-12 * np.max(np.abs(y[seen])):
        return "it does not vary"
    if kind == "saltelli" and not seen.all():
        return f"{np.sum(~seen)} of {len(seen)} cases have no value, and Saltelli's method needs all (lhs:N does not)"
    need("study", "SALib")
    from SALib.analyze import rbd_fast, sobol

    names = [a.name for a in axes]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        if kind == "saltelli":
            found = sobol.analyze(problem(axes), y, calc_second_order=True, seed=0)
            kinds = {"first order": ("S1", "S1_conf"), "total": ("ST", "ST_conf")}
        else:
            X = np.array([[position(a, c[a.name]) for a in axes] for c in cases])[seen]
            found = rbd_fast.analyze(problem(axes), X, y[seen], seed=0)
            kinds = {"first order": ("S1", "S1_conf")}
    return {
        kind: {n: _share(v, c) for n, v, c in zip(names, found[a], found[b], strict=True)}
        for kind, (a, b) in kinds.items()
    }


def position(axis: Axis, value: Any) -> float:
    """Where a value lies on its axis, from 0 to 1."""
    if axis.is_range:
        return (value - axis.low) / (axis.high - axis.low)
    return (axis.values.index(value) + 0.5) / len(axis.values)


def _share(value: float, half_width: float) -> dict[str, float]:
    return {"value": float(min(max(value, 0.0), 1.0)), "half_width": float(half_width)}
