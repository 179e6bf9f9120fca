"""Steps short enough for what is fitted: the fit step near the exact one, the macro step resolved."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ..estimation.linear import LinearisedModel
from ..problem.noise import rms
from ..problem.parameters import EffectCandidate, Point, point_of
from ..problem.problem import Problem
from ..selection.hypothesis import Hypothesis, is_adequate
from .polish import polish
from .rounds import best_of_each_set, search_cost
from .starts import corrected_for_step, exact_hypotheses_at


class AtStep(NamedTuple):
    """The problem with a macro step short enough for its best fit, and the hypotheses, the best first."""

    problem: Problem
    hypotheses: list[Hypothesis]


def refine_fit_step(problem: Problem, hypotheses: Sequence[Hypothesis], nuisance_jacobian: np.ndarray) -> AtStep:
    """Halve the step of a fit's runs while they are far from the exact ones at the best fit, and fit the best anew.

    It was chosen at the model as delivered; a machine that hunts about a dead zone does so from step to step of a long
    one, and derivatives from such runs lead nowhere.
    """
    refitted, polished, count = list(hypotheses), list(hypotheses), problem.settings.numerics.refitted
    while not problem.stop_requested:
        at_best = _exact_hypothesis(problem, refitted[0].candidates, refitted[0].fit.point, nuisance_jacobian)
        if at_best is None:
            break
        shorter, at_best = _with_resolving_step(problem, at_best, nuisance_jacobian)
        if shorter is problem:
            break
        problem = shorter
        next_best = [(h.candidates, h.fit.point) for h in refitted[1:count]]
        started = [at_best, *exact_hypotheses_at(problem, next_best, nuisance_jacobian)]
        polished = polish(problem, started, nuisance_jacobian, problem.settings.search.polish_rounds)
        refitted = best_of_each_set([*polished, *refitted])
    return AtStep(problem, corrected_for_step(problem, refitted, polished))


class _SetAtStep(NamedTuple):
    """A problem, and a set of effects as it stands at a point with its own exact run."""

    problem: Problem
    hypothesis: Hypothesis


def _with_resolving_step(problem: Problem, hypothesis: Hypothesis, nuisance_jacobian: np.ndarray) -> _SetAtStep:
    """The problem with the step of a fit's runs halved until they are near the exact one where a set stands, as far as
    runs of the halved step are to be had there."""
    settings, noise = problem.settings.numerics, problem.observations.noise_std
    while problem.discretisation.coarsening > 1 and rms(hypothesis.fit.correction / noise) > settings.coarse_error:
        shorter = problem.with_discretisation(coarsening=problem.discretisation.coarsening // 2)
        at_shorter = _exact_hypothesis(shorter, hypothesis.candidates, hypothesis.fit.point, nuisance_jacobian)
        if at_shorter is None:
            break
        problem, hypothesis = shorter, at_shorter
    return _SetAtStep(problem, hypothesis)


def _exact_hypothesis(
    problem: Problem, candidates: tuple[EffectCandidate, ...], point: Point, nuisance_jacobian: np.ndarray
) -> Hypothesis | None:
    return next(iter(exact_hypotheses_at(problem, [(candidates, point)], nuisance_jacobian)), None)


def refit_with_exact_step(problem: Problem, baseline: Hypothesis, nuisance_jacobian: np.ndarray) -> AtStep:
    """The baseline refitted with a shorter fit step where its derivatives foretell a gain that an exact run confirms
    and runs of the fit step do not.

    Runs of a long step may swing where the machine does not, close beside the way to the data: then the fit stops at
    that barrier, and a wrong effect takes up the rest.
    """
    fit, settings = baseline.fit, problem.settings
    linearised = LinearisedModel.around(problem, fit.normalised, fit.model, fit.jacobian, nuisance_jacobian)
    step = linearised.step(fit.parameters, fit.dispersion, np.full(len(fit.normalised), np.inf))
    u, residual = fit.normalised + step.d, linearised.predicted_residual(step)
    expected = replace(fit, normalised=u, nuisances=step.q, residual=residual)
    much = baseline.penalised_deviance - settings.search.exact_trial_gain
    if replace(baseline, fit=expected).penalised_deviance > much or is_adequate(problem, fit) or problem.stop_requested:
        return AtStep(problem, [baseline])
    hypothesis = _exact_hypothesis(problem, (), point_of(fit.parameters, u), nuisance_jacobian)
    if hypothesis is None or hypothesis.penalised_deviance > much:
        return AtStep(problem, [baseline])
    problem, hypothesis = _with_resolving_step(problem, hypothesis, nuisance_jacobian)
    return AtStep(problem, polish(problem, [hypothesis], nuisance_jacobian, settings.search.polish_rounds))


def refine_macro_step(problem: Problem, hypotheses: Sequence[Hypothesis], nuisance_jacobian: np.ndarray) -> AtStep:
    """Halve the macro step of exact runs while the best fit's extrapolated run depends on it, and fit the best anew;
    the step of a fit's runs stays."""
    refitted, settings = list(hypotheses), problem.settings.numerics
    for _ in range(settings.max_halvings):
        if problem.stop_requested:
            break
        best = refitted[0]
        halved = problem.with_discretisation(macro_step=problem.macro_step / 2.0)
        before, after = problem.exact([best.fit.point])[0], halved.exact([best.fit.point])[0]
        change = 0.0 if before is None or after is None else rms((after - before) / problem.observations.noise_std)
        if change < max(settings.unresolved, settings.unresolved_share * best.fit.rms):
            break
        d = halved.discretisation
        method_order = 2 if d.method == settings.second_order_method else 1
        problem = halved.with_discretisation(
            richardson_order=d.richardson_order or method_order, coarsening=2 * d.coarsening
        )  # fmt: skip
        count, rounds = settings.refitted, problem.settings.search.polish_rounds
        refitted = sorted(
            [*polish(problem, refitted[:count], nuisance_jacobian, rounds), *refitted[count:]], key=search_cost
        )
    return AtStep(problem, refitted)
