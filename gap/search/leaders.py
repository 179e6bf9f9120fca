"""What the judged fits rest on: derivatives that serve for larger moves, and a macro step short enough."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ..estimation.cross_validation import cross_validate
from ..estimation.linear import LinearisedModel
from ..estimation.scheduler import run_fits
from ..estimation.wide_jacobian import with_wide_jacobian
from ..problem.noise import rms
from ..problem.parameters import EffectCandidate, Point, point_of
from ..problem.problem import Problem
from ..selection.hypothesis import Hypothesis, is_adequate
from .polish import polish
from .rounds import best_of_each_set, search_cost
from .starts import exact_hypotheses_at


def widen_derivatives(
    problem: Problem, hypotheses: Sequence[Hypothesis], nuisance_jacobian: np.ndarray
) -> list[Hypothesis]:
    """The best few, and the baseline, with derivatives that serve for refits without a part of the data.

    Those over wide steps serve, unless the fit's own foretell better what is left out: where a machine sticks and
    slips, larger moves are another motion.
    """
    widened, settings = list(hypotheses), problem.settings.search
    near = search_cost(widened[0]) + settings.polish_within if widened else 0.0
    chosen = [
        k for k, h in enumerate(widened) if not h.candidates or (k < settings.wide_leaders and search_cost(h) < near)
    ]
    tasks = [with_wide_jacobian(problem, widened[k].fit, nuisance_jacobian) for k in chosen]
    for k, wide in zip(chosen, run_fits(problem, tasks), strict=True):
        if wide is not None:
            with_own_jacobian = replace(wide, jacobian=widened[k].fit.jacobian)
            validated = {f: cross_validate(problem, f, nuisance_jacobian) for f in (wide, with_own_jacobian)}
            best = min(validated, key=lambda f: validated[f].structured_energy)
            widened[k] = replace(widened[k], fit=best)
    return widened


class AtStep(NamedTuple):
    """The problem with a macro step short enough for its best fit, and the hypotheses, the best first."""

    problem: Problem
    hypotheses: list[Hypothesis]


def refine_fit_step(problem: Problem, hypotheses: Sequence[Hypothesis], nuisance_jacobian: np.ndarray) -> AtStep:
    """Halve the step of a fit's runs while they are far from the exact ones at the best fit, and fit the best anew.

    It was chosen at the model as delivered; a machine that hunts about a dead zone does so from step to step of a long
    one, and derivatives from such runs lead nowhere (four lands with a late sensor: 13.6 noises apart at 8 ms, and fits
    that stand still; 1.7 at 4 ms, and 1.34 times the noise become 1.02).
    """
    refitted, count = list(hypotheses), problem.settings.numerics.refitted
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
    return AtStep(problem, refitted)


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


def refit_past_wall(problem: Problem, baseline: Hypothesis, nuisance_jacobian: np.ndarray) -> AtStep:
    """The refit gone on with where its derivatives foretell much that its runs do not bear out, but exact ones do.

    Runs of a long step may swing where the machine does not, close beside the way to the data: a machine with nothing
    wrong was left at 1.94 times the noise with a wall of 48 around it, where exact runs lead to 0.98 in one step, and a
    wrong effect in a wrong form took up the rest. From there on runs take a step at which they resemble the exact ones.
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
    """Halve all macro steps while the best fit's extrapolated run depends on them, and fit the best anew."""
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
        count, looks = settings.refitted, problem.settings.search.polish_rounds
        refitted = sorted(
            [*polish(problem, refitted[:count], nuisance_jacobian, looks), *refitted[count:]], key=search_cost
        )
    return AtStep(problem, refitted)
