"""The baseline: the base parameters fitted within their tolerances, without any effect."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...core.errors import SimulationError
from ..estimation.dispersion import estimate_dispersion
from ..estimation.fit import Fit
from ..estimation.linear import profile_nuisances
from ..problem.parameters import Point
from ..problem.problem import Problem
from ..selection.hypothesis import Hypothesis, is_adequate
from .bank import without_responses
from .refinement import Place, polish, refine, stand_at
from .sets import Proposal
from .sizes import grid, variants


def as_delivered(
    problem: Problem, nominal: np.ndarray, coarse: np.ndarray, nuisance_jacobian: np.ndarray
) -> Hypothesis:
    """The model as delivered, without derivatives: its long vector from exact runs and from those at the fit's step."""
    q, residual = profile_nuisances(problem, nominal, nuisance_jacobian, 1.0)
    count, dispersion = len(problem.base), estimate_dispersion(problem, residual)
    fit = Fit(
        problem.base, np.zeros(count), nominal, np.zeros((len(nominal), count)), q, len(problem.observations.span),
        residual, nominal - coarse, dispersion,
    )  # fmt: skip
    return Hypothesis((), fit)


def unfitted_base(problem: Problem, nominal: np.ndarray, nuisance_jacobian: np.ndarray) -> Hypothesis:
    """The model as delivered (n,) in place of a refit for which there was no time."""
    h = as_delivered(problem, nominal, nominal, nuisance_jacobian)
    return replace(h, fit=replace(h.fit, unfinished=True))


def deliver(problem: Problem, nuisance_jacobian: np.ndarray) -> Hypothesis:
    """The model as delivered, simulated."""
    (coarse,), (exact,) = problem.evaluate_both([{}], [{}])
    if coarse is None or exact is None:
        failure = problem.simulator.failure
        raise SimulationError(f"{problem.campaign.system.name}: the model as delivered does not run: {failure}")
    return as_delivered(problem, exact, coarse, nuisance_jacobian)


def refit_again(
    problem: Problem, nuisance_jacobian: np.ndarray, delivered: Hypothesis, point: Point
) -> Hypothesis | None:
    """The base parameters alone, from where an earlier refit stood; None where the model does not run there."""
    (start,) = stand_at(problem, [Place((), point, delivered.fit.correction)], nuisance_jacobian)
    if start is None:
        return None
    at = _walked(problem, nuisance_jacobian, start)
    return polish(problem, [at], nuisance_jacobian, problem.settings.search.polish_looks)[0]


def refit_base(problem: Problem, nuisance_jacobian: np.ndarray, delivered: Hypothesis) -> Hypothesis:
    """The base parameters alone, from the model as delivered.

    Where that stops far from the data, each parameter alone is tried over its range, and fits start at what is nearer:
    a machine that begins to swing, or swings at another pitch, stands like a wall between two points.
    """
    settings = problem.settings.search
    if not problem.base:
        return replace(delivered, fit=replace(delivered.fit, converged=True))
    looks = settings.polish_looks
    start = _with_accepted(problem, nuisance_jacobian, delivered)
    baseline = polish(problem, [_walked(problem, nuisance_jacobian, start)], nuisance_jacobian, looks)[0]
    if explains_much(problem, baseline, delivered):
        return baseline
    starts = _nearer_points(problem, nuisance_jacobian, baseline, start)
    others = [_walked(problem, nuisance_jacobian, h) for h in starts if not problem.stop_requested]
    if others:
        best = min(others, key=lambda h: h.fit.rms)
        best = polish(problem, [best], nuisance_jacobian, looks)[0]
        if best.fit.rms < baseline.fit.rms and best.penalised_deviance < baseline.penalised_deviance:
            return best
    return baseline


def explains_much(problem: Problem, baseline: Hypothesis, delivered: Hypothesis) -> bool:
    """Whether a refit of the base parameters leaves little of the delivered gap, or nothing to explain."""
    near = problem.settings.search.near * delivered.fit.rms
    return baseline.fit.rms < near or is_adequate(problem, baseline.fit)


def is_strained(problem: Problem, baseline: Hypothesis) -> bool:
    """Whether so many base parameters stand at the ends of their tolerances that they are bent to what they cannot
    explain: around such a point right effects do not show."""
    return sum(baseline.fit.at_bound) > problem.settings.search.strained * len(problem.base)


def _with_accepted(problem: Problem, nuisance_jacobian: np.ndarray, delivered: Hypothesis) -> Hypothesis:
    """The model as delivered with each accepted effect in turn at the size of the grid that serves best: at none, what
    begins to act at a threshold has no derivative."""
    settings, best = problem.settings.search, delivered
    for c in problem.accepted:
        points = [{**best.fit.point, **values} for values in variants(c, grid(c.main, settings), settings)]
        tried = stand_at(problem, [Place((), p, delivered.fit.correction) for p in points], nuisance_jacobian)
        best = min([best, *(h for h in tried if h is not None)], key=lambda h: h.fit.rms)
    return best


def _walked(problem: Problem, nuisance_jacobian: np.ndarray, at: Hypothesis) -> Hypothesis:
    """A quick fit from a hypothesis without effects, with derivatives anew where it has gone far."""
    settings = problem.settings.search
    for _ in range(settings.base_looks):
        fit = at.fit
        bank = without_responses(problem, fit.point, fit.model - fit.correction, fit.correction)
        found = refine(problem, bank, [Proposal((), fit.point, 0.0)], nuisance_jacobian, settings.steps)
        if not found or found[0].penalised_deviance > at.penalised_deviance - settings.better:
            break
        at = found[0]
    return at


def _nearer_points(
    problem: Problem, nuisance_jacobian: np.ndarray, baseline: Hypothesis, delivered: Hypothesis
) -> list[Hypothesis]:
    """Points that differ from what is stated in one parameter only and are nearer to the data than a fit, the best of
    each parameter, the best first."""
    known = delivered.fit.point
    tried = [
        (x.name, {**known, x.name: u})
        for x in problem.base
        for share in problem.settings.search.base_alone
        if (u := share * (x.high if share > 0.0 else -x.low))
    ]
    places = [Place((), point, delivered.fit.correction) for _, point in tried]
    best: dict[str, Hypothesis] = {}
    for (name, _), h in zip(tried, stand_at(problem, places, nuisance_jacobian), strict=True):
        if h is not None and h.fit.rms < best.get(name, baseline).fit.rms:  # not what merely strains the biases less
            best[name] = h
    return sorted(best.values(), key=lambda h: h.fit.rms)[: problem.settings.search.base_starts]
