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
from .polish import polish
from .response_bank import begin_bank
from .sets import Proposal
from .sizes import grid, variants
from .starts import FitStart, fit_proposals, hypotheses_at


def nominal_hypothesis(
    problem: Problem, nominal: np.ndarray, coarse: np.ndarray, nuisance_jacobian: np.ndarray
) -> Hypothesis:
    """The model as delivered, without derivatives: its prediction from exact runs and from those at the fit's step."""
    q, residual = profile_nuisances(problem, nominal, nuisance_jacobian, 1.0)
    count, dispersion = len(problem.base), estimate_dispersion(problem, residual)
    fit = Fit(
        problem.base, np.zeros(count), nominal, np.zeros((len(nominal), count)), q, len(problem.observations.span),
        residual, nominal - coarse, dispersion,
    )  # fmt: skip
    return Hypothesis((), fit)


def unfitted_baseline(problem: Problem, nominal: np.ndarray, nuisance_jacobian: np.ndarray) -> Hypothesis:
    """The model as delivered (n,) in place of a refit for which there was no time."""
    h = nominal_hypothesis(problem, nominal, nominal, nuisance_jacobian)
    return replace(h, fit=replace(h.fit, unfinished=True))


def simulate_nominal(problem: Problem, nuisance_jacobian: np.ndarray) -> Hypothesis:
    """The model as delivered, simulated."""
    (coarse,), (exact,) = problem.evaluate_both([{}], [{}])
    if coarse is None or exact is None:
        failure = problem.simulator.failure
        raise SimulationError(f"{problem.campaign.system.name}: the model as delivered does not run: {failure}")
    return nominal_hypothesis(problem, exact, coarse, nuisance_jacobian)


def resume_refit(
    problem: Problem, nuisance_jacobian: np.ndarray, nominal: Hypothesis, point: Point
) -> Hypothesis | None:
    """The base parameters alone, from where an earlier refit stood; None where the model does not run there."""
    (start,) = hypotheses_at(problem, [FitStart((), point, nominal.fit.correction)], nuisance_jacobian)
    if start is None:
        return None
    walked = _improve(problem, nuisance_jacobian, start)
    return polish(problem, [walked], nuisance_jacobian, problem.settings.search.polish_rounds)[0]


def refit_base(problem: Problem, nuisance_jacobian: np.ndarray, nominal: Hypothesis) -> Hypothesis:
    """The base parameters alone, from the model as delivered.

    Where that stops far from the data, each parameter alone is tried over its range, and fits start at what is nearer:
    a machine that begins to swing, or swings at another pitch, is a barrier between two points.
    """
    settings = problem.settings.search
    if not problem.base:
        return replace(nominal, fit=replace(nominal.fit, converged=True))
    looks = settings.polish_rounds
    start = _with_accepted(problem, nuisance_jacobian, nominal)
    baseline = polish(problem, [_improve(problem, nuisance_jacobian, start)], nuisance_jacobian, looks)[0]
    if explains_much(problem, baseline, nominal):
        return baseline
    starts = _nearer_points(problem, nuisance_jacobian, baseline, start)
    refits = [_improve(problem, nuisance_jacobian, h) for h in starts if not problem.stop_requested]
    if refits:
        best = min(refits, key=lambda h: h.fit.rms)
        best = polish(problem, [best], nuisance_jacobian, looks)[0]
        if best.fit.rms < baseline.fit.rms and best.penalised_deviance < baseline.penalised_deviance:
            return best
    return baseline


def explains_much(problem: Problem, baseline: Hypothesis, nominal: Hypothesis) -> bool:
    """Whether a refit of the base parameters leaves little of the delivered gap, or nothing to explain."""
    near = problem.settings.search.max_baseline_ratio * nominal.fit.rms
    return baseline.fit.rms < near or is_adequate(problem, baseline.fit)


def is_strained(problem: Problem, baseline: Hypothesis) -> bool:
    """Whether so many base parameters stand at the ends of their tolerances that they are bent to what they cannot
    explain: around such a point right effects do not show."""
    return sum(baseline.fit.at_bound) > problem.settings.search.max_share_at_tolerance * len(problem.base)


def _with_accepted(problem: Problem, nuisance_jacobian: np.ndarray, nominal: Hypothesis) -> Hypothesis:
    """The model as delivered with each accepted effect in turn at the size of the grid that serves best: at none, what
    begins to act at a threshold has no derivative."""
    settings, best = problem.settings.search, nominal
    for c in problem.accepted:
        points = [{**best.fit.point, **values} for values in variants(c, grid(c.main, settings), settings)]
        hypotheses = hypotheses_at(
            problem, [FitStart((), p, nominal.fit.correction) for p in points], nuisance_jacobian
        )
        best = min([best, *(h for h in hypotheses if h is not None)], key=lambda h: h.fit.rms)
    return best


def _improve(problem: Problem, nuisance_jacobian: np.ndarray, incumbent: Hypothesis) -> Hypothesis:
    """A quick fit from a hypothesis without effects, with derivatives anew where it has gone far."""
    settings = problem.settings.search
    for _ in range(settings.baseline_rounds):
        fit = incumbent.fit
        bank = begin_bank(problem, fit.point, fit.model - fit.correction, fit.correction)
        start = Proposal((), fit.point, 0.0)
        refined = fit_proposals(problem, bank, [start], nuisance_jacobian, settings.quick_fit_steps)
        if not refined or refined[0].penalised_deviance > incumbent.penalised_deviance - settings.min_round_gain:
            break
        incumbent = refined[0]
    return incumbent


def _nearer_points(
    problem: Problem, nuisance_jacobian: np.ndarray, baseline: Hypothesis, nominal: Hypothesis
) -> list[Hypothesis]:
    """Points that differ from what is stated in one parameter only and are nearer to the data than a fit, the best of
    each parameter, the best first."""
    nominal_point = nominal.fit.point
    points = [
        (x.name, {**nominal_point, x.name: u})
        for x in problem.base
        for share in problem.settings.search.base_alone
        if (u := share * (x.high if share > 0.0 else -x.low))
    ]
    starts = [FitStart((), point, nominal.fit.correction) for _, point in points]
    best: dict[str, Hypothesis] = {}
    for (name, _), h in zip(points, hypotheses_at(problem, starts, nuisance_jacobian), strict=True):
        if h is not None and h.fit.rms < best.get(name, baseline).fit.rms:  # not what merely strains the biases less
            best[name] = h
    return sorted(best.values(), key=lambda h: h.fit.rms)[: problem.settings.search.base_starts]
