"""The baseline: the base parameters fitted within their tolerances, without any effect."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..estimation.dispersion import estimate_dispersion
from ..estimation.fit import Fit
from ..estimation.gauss_newton import fit, robust_fit
from ..estimation.linear import profile_nuisances
from ..estimation.scheduler import run_fit
from ..problem.noise import rms
from ..problem.parameters import EstimatedParameter, penalty, point_of
from ..problem.problem import Problem
from ..settings import BaselineSettings
from .hypothesis import Hypothesis, is_adequate, penalised_deviance


def refit_base(problem: Problem, nuisance_jacobian: np.ndarray) -> Hypothesis:
    """The base parameters fitted from what is stated, on a way that may leave their tolerance in between.

    Where that stops away from the data, each parameter alone is tried over its range, and fits start at what is nearer:
    a machine that begins to swing stands like a wall between two points.
    """
    settings = problem.settings.baseline
    start, room, iterations = np.zeros(len(problem.base)), settings.room, settings.iterations
    roomy = tuple(
        replace(x, low=max(room * x.low, _least(x, settings)), high=room * x.high)
        for x in problem.base
    )
    far = run_fit(problem, robust_fit(problem, roomy, start, nuisance_jacobian, iterations)).normalised
    within = np.clip(far, [x.low for x in problem.base], [x.high for x in problem.base])
    baseline = fitted_base(problem, within, nuisance_jacobian)
    if is_adequate(problem, baseline.fit) or problem.stop_requested:
        return baseline
    for u in _nearer_points(problem, baseline, nuisance_jacobian):
        other = fitted_base(problem, u, nuisance_jacobian)
        baseline = min(baseline, other, key=lambda h: h.penalised_deviance)
        if is_adequate(problem, baseline.fit) or problem.stop_requested:
            break
    return baseline


def _least(x: EstimatedParameter, settings: BaselineSettings) -> float:
    """The lowest normalised value on the way: none changes sign, which a logarithmic scale never does."""
    return min(x.low, settings.least_change / x.scale) if x.factor is None else -np.inf


def fitted_base(problem: Problem, u: np.ndarray, nuisance_jacobian: np.ndarray) -> Hypothesis:
    """The baseline as a fit from the normalised base parameters u (k,)."""
    iterations = problem.settings.baseline.iterations
    return Hypothesis((), run_fit(problem, fit(problem, problem.base, u, nuisance_jacobian, iterations)))


def unfitted_base(problem: Problem, nominal: np.ndarray, nuisance_jacobian: np.ndarray) -> Hypothesis:
    """The model as delivered (n,) in place of a refit for which there was no time."""
    q, residual = profile_nuisances(problem, nominal, nuisance_jacobian, 1.0)
    count, dispersion = len(problem.base), estimate_dispersion(problem, residual)
    fit = Fit(
        problem.base, np.zeros(count), nominal, np.zeros((len(nominal), count)), q, len(problem.observations.span),
        residual, np.zeros(len(nominal)), dispersion, unfinished=True,
    )  # fmt: skip
    return Hypothesis((), fit)


def _nearer_points(problem: Problem, baseline: Hypothesis, nuisance_jacobian: np.ndarray) -> list[np.ndarray]:
    """Points that differ from what is stated in one parameter only, nearer to the data than a fit; the best first."""
    settings = problem.settings.baseline
    points = [
        np.where(np.arange(len(problem.base)) == k, size, 0.0)
        for k, x in enumerate(problem.base)
        for share in settings.alone_at
        if (size := share * (x.high if share > 0 else -x.low))
    ]
    models = problem.evaluate([point_of(problem.base, u) for u in points])
    costs = []
    for u, model in zip(points, models, strict=True):
        if model is not None:
            q, residual = profile_nuisances(problem, model, nuisance_jacobian, 1.0)
            strain = penalty(problem.base, u, q[: baseline.fit.channels])
            costs.append((penalised_deviance(rms(residual), strain), u))
    costs.sort(key=lambda entry: entry[0])
    return [u for cost, u in costs if cost < baseline.penalised_deviance][: settings.starts]
