"""A fit with derivatives over wide steps, which serve for larger moves: refits without a fold of the data."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..problem.problem import Problem
from ..problem.stop import StopRequested
from .differences import FiniteDifferences
from .fit import Fit, FitFailed, FitTask, SimulationRequest
from .linear import profile_nuisances


def with_wide_jacobian(problem: Problem, fitted: Fit, nuisance_jacobian: np.ndarray) -> FitTask:
    """The fit where it stands, run exactly, with derivatives that serve for larger moves."""
    coarse = fitted.model - fitted.correction
    all_columns = range(len(fitted.normalised))
    differences = FiniteDifferences(problem, fitted.parameters, fitted.normalised, all_columns, coarse)
    try:
        jacobian = yield from differences.compute(problem.settings.fit.wide_step)
        model = (yield SimulationRequest([], [fitted.point])).exact[0]
    except StopRequested:
        return replace(fitted, unfinished=True)
    if model is None:
        raise FitFailed
    q, residual = profile_nuisances(problem, model, nuisance_jacobian, fitted.dispersion)
    return replace(
        fitted, jacobian=jacobian, model=model, correction=model - coarse, nuisances=q, residual=residual
    )  # fmt: skip
