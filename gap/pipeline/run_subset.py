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
from ..estimation.nuisances import nuisance_jacobian_at
from ..problem.noise import rms_of_runs
from ..problem.problem import Problem
from ..search.baseline import refit_base, resume_refit, simulate_nominal
from ..search.rounds import best_of_each_set, polish_near, search_cost
from ..search.starts import exact_hypotheses_at
from ..selection.hypothesis import Hypothesis, is_adequate
from .search import describe_progress
from .state import AllRuns, State


def has_many_runs(state: State) -> bool:
    """Whether there are so many that the search begins on some of them."""
    return len(state.problem.runs) > state.problem.settings.search.many_runs


def restrict_to_subset(state: State) -> State:
    """Only the runs to begin with."""
    residual = state.problem.observations.whiten(state.nominal)
    return _restrict(state, choose_runs(state.problem, residual, state.problem.settings.search.some_runs))


def is_on_subset(state: State) -> bool:
    """Whether the search is confined to some runs."""
    return state.all_runs is not None


def fit_to_all(state: State) -> State:
    """All runs again: the refit and the best sets fitted to them from where they stand."""
    if (all_runs := state.all_runs) is None:
        raise ValueError("the search is not confined to some runs")
    some_runs, best = state.problem, best_of_each_set(state.hypotheses)
    problem = replace(all_runs.problem, candidates=some_runs.candidates, discretisation=some_runs.discretisation)
    nuisance_jacobian = nuisance_jacobian_at(problem, all_runs.nominal)
    nominal = simulate_nominal(problem, nuisance_jacobian)
    resumed = None
    if problem.base:
        resumed = resume_refit(problem, nuisance_jacobian, nominal, state.required_baseline.fit.point)
    baseline = resumed or refit_base(problem, nuisance_jacobian, nominal)
    sets = [(h.candidates, h.fit.point) for h in best if h.candidates][: problem.settings.search.fitted_to_all]
    started = exact_hypotheses_at(problem, sets, nuisance_jacobian)
    least = min((search_cost(h) for h in started), default=0.0)
    hypotheses = best_of_each_set([baseline, *polish_near(problem, started, least, nuisance_jacobian)])
    return replace(
        state, problem=problem, nominal=all_runs.nominal, step_change=all_runs.step_change,
        nuisance_jacobian=nuisance_jacobian,
        all_runs=None, rms_on_subset=best[0].fit.rms, baseline=baseline, start=None, other_start=None, bank_sets=(),
        fitted_sets=tuple(h for h in hypotheses if h.candidates),
        progress=describe_progress(replace(state, all_runs=None), hypotheses),
    )  # fmt: skip


def fits_all_runs_worse(state: State) -> bool:
    """Whether all runs are left with more than those were that the search was confined to."""
    best, settings = best_of_each_set(state.hypotheses)[0], state.problem.settings.search
    comparable = state.rms_on_subset > 0.0 and not is_adequate(state.problem, best.fit)
    return comparable and best.fit.rms > settings.more_left * state.rms_on_subset


def restart_on_worst_runs(state: State) -> State:
    """Only the runs that the best set misses most, with all that was fitted as it stands there."""
    best = best_of_each_set(state.hypotheses)[0]
    runs = choose_runs(state.problem, best.fit.residual, state.problem.settings.search.some_runs)
    restricted = _restrict(state, runs)
    nuisance_jacobian = nuisance_jacobian_at(restricted.problem, restricted.nominal)
    entries = state.problem.observations.entries(runs)
    by_key = {h.key: _restricted(restricted.problem, h, entries, nuisance_jacobian) for h in state.hypotheses}
    fitted = tuple(h for h in by_key.values() if h.candidates)
    return replace(
        restricted, nuisance_jacobian=nuisance_jacobian, baseline=by_key[state.required_baseline.key],
        fitted_sets=fitted,
        start=by_key[best.key],
    )  # fmt: skip


def choose_runs(problem: Problem, residual: np.ndarray, count: int) -> list[int]:
    """So many runs in their order: the one with the largest residual (n,), then in turn the one whose residual, and
    whose distance from those that are chosen, are large together."""
    rms_left = rms_of_runs(residual, problem.observations.run, len(problem.runs))
    place = _conditions(problem)
    chosen = [int(np.argmax(rms_left))]
    while len(chosen) < min(count, len(rms_left)):
        distance = np.min([np.abs(place - place[r]).max(axis=1) for r in chosen], axis=0)
        worth = rms_left * (problem.settings.search.same_conditions + distance)
        worth[chosen] = -1.0
        chosen.append(int(np.argmax(worth)))
    return sorted(chosen)


def _conditions(problem: Problem) -> np.ndarray:
    """What the runs state (runs, k), each from 0 to 1; one column of zeros where they state nothing that differs."""
    stated = sorted({name for conditions in problem.runs for name in conditions.stated})
    columns = [np.zeros(len(problem.runs))]
    for name in stated:
        values = [conditions.stated.get(name, conditions.values.get(name)) for conditions in problem.runs]
        if all(isinstance(v, Real) for v in values):
            column = np.array(values, dtype=float)
            if (span := np.ptp(column)) > 0.0:
                columns.append((column - column.min()) / span)
    return np.stack(columns, axis=1)


def _restrict(state: State, runs: Sequence[int]) -> State:
    problem, entries = state.problem, state.problem.observations.entries(runs)
    change = state.step_change[entries] if len(state.step_change) else state.step_change
    all_runs = AllRuns(problem, state.nominal, state.step_change)
    return replace(
        state, all_runs=all_runs, problem=problem.of_runs(runs), nominal=state.nominal[entries], step_change=change
    )  # fmt: skip


def _restricted(some_runs: Problem, h: Hypothesis, entries: np.ndarray, nuisance_jacobian: np.ndarray) -> Hypothesis:
    """A hypothesis of all runs as some of them, whose readings stand at these places, see it."""
    model = h.fit.model[entries]
    q, residual = profile_nuisances(some_runs, model, nuisance_jacobian, 1.0)
    fit = replace(
        h.fit, model=model, jacobian=h.fit.jacobian[entries], correction=h.fit.correction[entries], nuisances=q,
        residual=residual, dispersion=estimate_dispersion(some_runs, residual),
    )  # fmt: skip
    return replace(h, fit=fit)
