"""Campaigns of many runs: the search begins on some of them, and what it finds is fitted to all.

A set of effects takes as many simulations as there are runs, and what tells sets apart shows in a few that differ. The
runs to begin with are those that the model as delivered misses most, far from each other in what they state; where all
runs together are left with more than these were, the search goes on with those that the best set misses most.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from numbers import Real

import numpy as np

from ..estimation.dispersion import estimate_dispersion
from ..estimation.linear import profile_nuisances
from ..estimation.nuisances import nuisance_columns
from ..problem.noise import rms_of_runs
from ..problem.problem import Problem
from ..search.baseline import refit_again, refit_base, simulate_nominal
from ..search.refinement import exact_hypotheses_at
from ..search.rounds import best_of_each_set, polish_near, search_cost
from ..selection.hypothesis import Hypothesis, is_adequate
from .search import so_far
from .state import AllRuns, State


def has_many_runs(state: State) -> bool:
    """Whether there are so many that the search begins on some of them."""
    return len(state.problem.runs) > state.problem.settings.search.many_runs


def begin_with_some(state: State) -> State:
    """Only the runs to begin with."""
    residual = state.problem.observations.whiten(state.nominal)
    return _confined(state, choose_runs(state.problem, residual, state.problem.settings.search.some_runs))


def is_confined(state: State) -> bool:
    """Whether the search is confined to some runs."""
    return state.all_runs is not None


def fit_to_all(state: State) -> State:
    """All runs again: the refit and the best sets fitted to them from where they stand."""
    if (whole := state.all_runs) is None:
        raise ValueError("the search is not confined to some runs")
    part, best = state.problem, best_of_each_set(state.hypotheses)
    problem = replace(whole.problem, candidates=part.candidates, discretisation=part.discretisation)
    N = nuisance_columns(problem, whole.nominal)
    delivered = simulate_nominal(problem, N)
    again = refit_again(problem, N, delivered, state.refit.fit.point) if problem.base else None
    baseline = again or refit_base(problem, N, delivered)
    wanted = [(h.candidates, h.fit.point) for h in best if h.candidates][: problem.settings.search.fitted_to_all]
    begun = exact_hypotheses_at(problem, wanted, N)
    least = min((search_cost(h) for h in begun), default=0.0)
    found = best_of_each_set([baseline, *polish_near(problem, begun, least, N)])
    return replace(
        state, problem=problem, nominal=whole.nominal, step_change=whole.step_change, nuisance_jacobian=N,
        all_runs=None, left_by_some=best[0].fit.rms, baseline=baseline, start=None, elsewhere=None, banked=(),
        found=tuple(h for h in found if h.candidates), so_far=so_far(replace(state, all_runs=None), found),
    )  # fmt: skip


def leaves_more_than_some(state: State) -> bool:
    """Whether all runs are left with more than those were that the search was confined to."""
    best, settings = best_of_each_set(state.hypotheses)[0], state.problem.settings.search
    seen = state.left_by_some > 0.0 and not is_adequate(state.problem, best.fit)
    return seen and best.fit.rms > settings.more_left * state.left_by_some


def begin_where_most_is_left(state: State) -> State:
    """Only the runs that the best set misses most, with all that was fitted as it stands there."""
    best = best_of_each_set(state.hypotheses)[0]
    runs = choose_runs(state.problem, best.fit.residual, state.problem.settings.search.some_runs)
    made = _confined(state, runs)
    N = nuisance_columns(made.problem, made.nominal)
    at = state.problem.observations.entries(runs)
    own = {h.parts: _seen_by(made.problem, h, at, N) for h in state.hypotheses}
    found = tuple(h for h in own.values() if h.candidates)
    return replace(
        made, nuisance_jacobian=N, baseline=own[state.refit.parts], found=found, start=own[best.parts]
    )  # fmt: skip


def choose_runs(problem: Problem, residual: np.ndarray, count: int) -> list[int]:
    """So many runs in their order: the one with the largest residual (n,), then in turn the one whose residual, and
    whose distance from those that are chosen, are large together."""
    left = rms_of_runs(residual, problem.observations.run, len(problem.runs))
    place = _conditions(problem)
    chosen = [int(np.argmax(left))]
    while len(chosen) < min(count, len(left)):
        apart = np.min([np.abs(place - place[r]).max(axis=1) for r in chosen], axis=0)
        worth = left * (problem.settings.search.same_conditions + apart)
        worth[chosen] = -1.0
        chosen.append(int(np.argmax(worth)))
    return sorted(chosen)


def _conditions(problem: Problem) -> np.ndarray:
    """What the runs state (runs, k), each from 0 to 1; one column of zeros where they state nothing that differs."""
    stated = sorted({name for info in problem.runs for name in info.changes})
    columns = [np.zeros(len(problem.runs))]
    for name in stated:
        values = [info.changes.get(name, info.values.get(name)) for info in problem.runs]
        if all(isinstance(v, Real) for v in values):
            column = np.array(values, dtype=float)
            if (span := np.ptp(column)) > 0.0:
                columns.append((column - column.min()) / span)
    return np.stack(columns, axis=1)


def _confined(state: State, runs: Sequence[int]) -> State:
    problem, at = state.problem, state.problem.observations.entries(runs)
    change = state.step_change[at] if len(state.step_change) else state.step_change
    whole = AllRuns(problem, state.nominal, state.step_change)
    return replace(
        state, all_runs=whole, problem=problem.of_runs(runs), nominal=state.nominal[at], step_change=change
    )  # fmt: skip


def _seen_by(part: Problem, h: Hypothesis, at: np.ndarray, nuisance_jacobian: np.ndarray) -> Hypothesis:
    """A hypothesis of all runs as some of them, whose readings stand at these places, see it."""
    model = h.fit.model[at]
    q, residual = profile_nuisances(part, model, nuisance_jacobian, 1.0)
    fit = replace(
        h.fit, model=model, jacobian=h.fit.jacobian[at], correction=h.fit.correction[at], nuisances=q,
        residual=residual, dispersion=estimate_dispersion(part, residual),
    )  # fmt: skip
    return replace(h, fit=fit)
