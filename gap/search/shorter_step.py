"""Effects whose runs a long step spoils, looked at with a shorter one.

The step of a fit's runs was chosen at the model as delivered. What takes milliseconds, a rod that knocks in its eye,
may do something else at such a step; then the bank has no response of that effect, and no set asks for it, however
large it is.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..problem.noise import rms, rms_of_runs
from ..problem.parameters import EffectCandidate, Point
from ..problem.problem import Problem
from ..selection.hypothesis import Hypothesis
from .response_bank import evaluate_in_batches
from .rounds import best_of_each_set, polish_near, search_cost
from .sizes import grid, usual_sizes, variants
from .starts import FitStart, corrected_for_step, exact_hypotheses_at, hypotheses_at
from .step_refinement import AtStep


def search_with_shorter_step(
    problem: Problem, hypotheses: Sequence[Hypothesis], nuisance_jacobian: np.ndarray
) -> AtStep:
    """The hypotheses, the best first, with those effects that runs of the long step spoil, alone and beside the best
    set where that may have another; the problem has half of that step if one of them is in the best then."""
    best, refit = hypotheses[0], next(h for h in hypotheses if not h.candidates)
    shorter = problem.with_discretisation(coarsening=problem.discretisation.coarsening // 2)
    rms_left = rms_of_runs(best.fit.residual, problem.observations.run, len(problem.runs))
    run = [int(np.argmax(rms_left))]  # what a step spoils in one run of a machine it does in others
    effects = step_sensitive_effects(problem.of_runs(run), shorter.of_runs(run), best)
    if not effects or problem.stop_requested:
        return AtStep(problem, list(hypotheses))
    room = [h for h in (best, refit) if len(h.candidates) < problem.settings.search.most_effects]
    sets = {h.labels: (h.candidates, h.fit.point) for h in room}
    fitted = []
    for incumbent in exact_hypotheses_at(shorter, list(sets.values()), nuisance_jacobian):
        fitted += _best_sizes(shorter, incumbent, effects, nuisance_jacobian)
    polished = polish_near(shorter, fitted, search_cost(best), nuisance_jacobian)
    after = best_of_each_set([*hypotheses, *polished])
    if search_cost(after[0]) < search_cost(best) - problem.settings.search.min_round_gain:
        return AtStep(shorter, corrected_for_step(shorter, after, polished))
    return AtStep(problem, corrected_for_step(problem, after, hypotheses))


def step_sensitive_effects(problem: Problem, shorter: Problem, best: Hypothesis) -> list[EffectCandidate]:
    """The effects that, at a usual size beside the best set, do by runs of the long step what they do not by shorter
    ones."""
    settings, noise = problem.settings, problem.observations.noise_std
    candidates = [c for c in problem.candidates if c.label not in best.labels and c.main.kind != "sensor"]
    points = [best.fit.point, *(_at_usual_size(problem, best.fit.point, c) for c in candidates)]
    long, short = (list(evaluate_in_batches(p, points)) for p in (problem, shorter))
    if long[0] is None or short[0] is None:
        return []
    effects = []
    for c, a, b in zip(candidates, long[1:], short[1:], strict=True):
        if b is None:
            continue
        response = (b - short[0]) / noise
        wrong = np.inf if a is None else rms((a - long[0]) / noise - response)
        if wrong > max(settings.numerics.coarse_error, settings.search.step_sensitive * rms(response)):
            effects.append(c)
    return effects


def _at_usual_size(problem: Problem, point: Point, c: EffectCandidate) -> Point:
    settings = problem.settings.search
    return {**point, **variants(c, usual_sizes(c.main, settings)[:1], settings)[0]}


def _best_sizes(
    problem: Problem, beside: Hypothesis, effects: Sequence[EffectCandidate], nuisance_jacobian: np.ndarray
) -> list[Hypothesis]:
    """Each effect beside a set, at the size of its grid that leaves least."""
    settings, best = problem.settings.search, dict[str, Hypothesis]()
    trials = [(c, values) for c in effects for values in variants(c, grid(c.main, settings), settings)]
    starts = [
        FitStart((*beside.candidates, c), {**beside.fit.point, **v}, beside.fit.correction, beside.fit)
        for c, v in trials
    ]
    for (c, _), h in zip(trials, hypotheses_at(problem, starts, nuisance_jacobian), strict=True):
        if h is not None and (c.label not in best or search_cost(h) < search_cost(best[c.label])):
            best[c.label] = h
    return list(best.values())
