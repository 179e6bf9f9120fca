"""Quasi-Newton fits of sets of effects, many side by side, with one simulation a step each.

At u a fit has the prediction m of all readings, their derivatives J and the linear nuisances q that belong to it. Its
cost is

    C(u) = D ln(mean(r^2)) + sum((u / sd)^2) + sum(q^2),   r = (measured - m - N q) / noise

with D = `deviance_readings`, as many as a wrong model's residual counts for, and only biases among the q of the sum.

A step d is the least of the linearised cost within |d| <= radius * max(|u|, min_trust_scale); it is taken where C
falls, and the radius grows then, else it shrinks. Either way what the simulation there has found mends the derivatives
(Broyden 1965):

    J <- J + (m(u + d) - m(u) - J d) d' / (d' d)

So a step costs one simulation. Simulations take the fit step; what exact runs add to them (the correction) is that of
the bank's point, or of where an exact run was last made, all along.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from ..estimation.dispersion import estimate_dispersion
from ..estimation.fit import Fit
from ..estimation.linear import LinearisedModel, profile_nuisances
from ..problem.noise import rms
from ..problem.parameters import EffectCandidate, EstimatedParameter, penalty, point_of
from ..problem.problem import Problem
from ..selection.hypothesis import Hypothesis, penalised_deviance
from .response_bank import evaluate_in_batches


@dataclass(eq=False)
class QuickFit:
    """One set on its way: parameters (k,), the prediction of all readings (n,), what exact runs add to it, derivatives
    (n, k)."""

    candidates: tuple[EffectCandidate, ...]
    parameters: tuple[EstimatedParameter, ...]
    u: np.ndarray
    model: np.ndarray
    correction: np.ndarray
    jacobian: np.ndarray
    nuisances: np.ndarray
    residual: np.ndarray
    cost: float
    radius: float
    step: np.ndarray = field(default_factory=lambda: np.zeros(0))
    rejected: int = 0
    """Steps in a row that were not taken."""
    finished: bool = False


def begin_fit(
    problem: Problem, candidates: tuple[EffectCandidate, ...], parameters: tuple[EstimatedParameter, ...],
    u: np.ndarray, model: np.ndarray, correction: np.ndarray, jacobian: np.ndarray, nuisance_jacobian: np.ndarray,
) -> QuickFit:  # fmt: skip
    """A fit where it begins."""
    q, residual = profile_nuisances(problem, model, nuisance_jacobian, 1.0)
    cost, radius = _cost(problem, parameters, u, q, residual), problem.settings.search.initial_trust_radius
    return QuickFit(candidates, parameters, u, model, correction, jacobian, q, residual, cost, radius)


def iterate(
    problem: Problem, quick_fits: Sequence[QuickFit], rows: slice, nuisance_jacobian: np.ndarray, steps: int
) -> None:
    """At most so many steps of each fit; rows: readings that are counted in a step."""
    for _ in range(steps):
        active = [f for f in quick_fits if not f.finished]
        if not active or problem.stop_requested:
            break
        for f in active:
            _propose_step(problem, rows, f, nuisance_jacobian)
        active = [f for f in active if not f.finished]
        models = problem.evaluate([point_of(f.parameters, f.u + f.step) for f in active])
        for f, model in zip(active, models, strict=True):
            _take_step(problem, f, None if model is None else model + f.correction, nuisance_jacobian)


def _propose_step(problem: Problem, rows: slice, f: QuickFit, nuisance_jacobian: np.ndarray) -> None:
    """The next step; none where little is to be gained."""
    dispersion = estimate_dispersion(problem, f.residual)
    linearised = LinearisedModel.around(problem, f.u, f.model, f.jacobian, nuisance_jacobian, rows)
    reach = f.radius * np.maximum(problem.settings.search.min_trust_scale, np.abs(f.u))
    weight = dispersion * linearised.r.size / len(problem.observations)
    step = linearised.step(f.parameters, weight, reach)
    expected = _cost(problem, f.parameters, f.u + step.d, step.q, linearised.predicted_residual(step))
    f.step = step.d
    f.finished = f.cost - expected < problem.settings.search.least_gain


def _take_step(problem: Problem, f: QuickFit, model: np.ndarray | None, nuisance_jacobian: np.ndarray) -> None:
    """Go there if it is better; what was found mends the derivatives either way."""
    settings = problem.settings.search
    if model is None:
        f.radius *= settings.trust_shrinkage
        return
    length = float(f.step @ f.step)
    if length > 1e-12:
        f.jacobian = f.jacobian + np.outer(model - f.model - f.jacobian @ f.step, f.step) / length
    q, residual = profile_nuisances(problem, model, nuisance_jacobian, 1.0)
    cost = _cost(problem, f.parameters, f.u + f.step, q, residual)
    if cost < f.cost:
        f.u, f.model, f.nuisances, f.residual, f.cost = f.u + f.step, model, q, residual, cost
        f.radius = min(1.0, settings.trust_growth * f.radius)
        f.rejected = 0
    else:
        f.radius *= settings.trust_shrinkage
        f.rejected += 1
        f.finished = f.rejected >= settings.max_rejected_steps


def differentiate(
    problem: Problem, quick_fits: Sequence[QuickFit], h: float = 0.0, missing_only: bool = False
) -> None:
    """Derivatives at the fits' points from small steps, or from steps of h, where these change anything; where they do
    not, the former ones stay."""
    h = h or max(problem.settings.search.polish_difference_step, problem.discretisation.difference_step)
    points, owners = [], []
    for f in quick_fits:
        f.jacobian = f.jacobian.copy()
        for k, x in enumerate(f.parameters):
            if missing_only and np.any(f.jacobian[:, k]):
                continue
            size = min(h, x.longest_difference(float(f.u[k]), problem.settings.search.period_difference))
            step = x.step_inside(float(f.u[k]), size)
            shifted = f.u.copy()
            shifted[k] += step
            points.append(point_of(f.parameters, shifted))
            owners.append((f, k, step))
    for (f, k, step), model in zip(owners, evaluate_in_batches(problem, points), strict=True):
        if model is None:
            continue
        change = model + f.correction - f.model
        if np.any(change):
            f.jacobian[:, k] = change / step


def _cost(
    problem: Problem, parameters: Sequence[EstimatedParameter], u: np.ndarray, q: np.ndarray, residual: np.ndarray
) -> float:
    channels = len(problem.observations.span)
    return penalised_deviance(rms(residual), penalty(parameters, u, q[:channels]))


def as_hypothesis(problem: Problem, f: QuickFit, converged: bool = False, quick: bool = False) -> Hypothesis:
    """The hypothesis where its fit stands; quick: what it says rests on the fit step's error elsewhere."""
    fit = Fit(
        f.parameters, f.u, f.model, f.jacobian, f.nuisances, len(problem.observations.span), f.residual,
        f.correction, estimate_dispersion(problem, f.residual), converged,
    )  # fmt: skip
    return Hypothesis(f.candidates, fit, quick=quick)
