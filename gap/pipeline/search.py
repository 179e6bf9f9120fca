"""Stages of the search: the baseline, then the greedy search over single effects and pairs."""

from __future__ import annotations

from dataclasses import replace

from ..selection import greedy_stages
from ..selection.baseline import refit_base
from ..selection.greedy import finish_fit
from ..selection.greedy_screening import screen_effects
from ..selection.greedy_steps import refine_macro_step
from ..selection.hypothesis import is_adequate
from .state import State


def fit_baseline(state: State) -> State:
    """The refit of the base parameters."""
    return replace(state, baseline=refit_base(state.problem, state.nuisance_jacobian))


def screen(state: State) -> State:
    """Every effect's response against what the refit leaves."""
    curves = screen_effects(state.problem, state.refit.fit, state.nuisance_jacobian)
    return replace(state, curves=tuple(curves))


def fit_singles(state: State) -> State:
    """Single effects."""
    singles = greedy_stages.fit_singles(state.problem, state.refit, state.curves, state.nuisance_jacobian)
    return replace(state, singles=tuple(singles))


def may_be_large(state: State) -> bool:
    """Whether large effects are to be looked for."""
    return greedy_stages.may_be_large(state.problem, state.refit, state.singles)


def fit_large(state: State) -> State:
    """Large effects, from the model as delivered."""
    before = greedy_stages.Singles(state.problem, state.refit, list(state.curves), list(state.singles))
    problem, baseline, curves, singles = greedy_stages.fit_large(before, state.nuisance_jacobian)
    return replace(state, problem=problem, baseline=baseline, curves=tuple(curves), singles=tuple(singles))


def refine_singles(state: State) -> State:
    """The macro step of the best single effects; the best first."""
    problem, (baseline, *singles) = refine_macro_step(state.problem, state.hypotheses, state.nuisance_jacobian)
    singles.sort(key=lambda h: h.penalised_deviance)
    return replace(state, problem=problem, baseline=baseline, singles=tuple(singles))


def something_is_left(state: State) -> bool:
    """Whether the best single effect leaves something to explain."""
    return bool(state.singles) and not is_adequate(state.problem, state.singles[0].fit)


def fit_pairs(state: State) -> State:
    """Pairs of effects, and the macro step that the best of all needs."""
    problem, N = state.problem, state.nuisance_jacobian
    pairs = greedy_stages.fit_pairs(problem, state.refit, state.singles, state.curves, N)
    swapped = greedy_stages.swap_effects(problem, state.singles, pairs, N)
    every = [state.refit, *state.singles, *pairs, *swapped]
    problem, (baseline, *others) = refine_macro_step(problem, every, N)
    count = len(state.singles)
    return replace(
        state, problem=problem, baseline=baseline, singles=tuple(others[:count]), pairs=tuple(others[count:])
    )  # fmt: skip


def finish_best(state: State) -> State:
    """What may win is fitted to its end, with the macro steps that it needs."""
    problem, warnings = state.problem, list(state.warnings)
    if problem.macro_step < state.chosen_step:
        told = "the gap's model depends on its macro step more than the delivered one: fits rest on steps of"
        package = f"the package's is {1e3 * state.package_step:g} ms"
        warnings.append(f"{told} {1e3 * problem.macro_step:g} ms, {package}")
    holdout = state.holdout.like(problem) if state.holdout else None
    baseline = finish_fit(problem, state.refit, state.nuisance_jacobian)
    state = replace(state, baseline=baseline, holdout=holdout, warnings=tuple(warnings))
    ranked = greedy_stages.finish_best(problem, state.hypotheses, state.nuisance_jacobian)
    return replace(state, ranked=tuple(ranked))


def try_alike(state: State) -> State:
    """Effects like those of the best hypothesis in their place."""
    ranked = greedy_stages.try_alike(state.problem, state.ranked, state.curves, state.nuisance_jacobian)
    return replace(state, ranked=tuple(ranked))


def drop_each(state: State) -> State:
    """The best hypothesis without each of its effects."""
    ranked = greedy_stages.drop_each(state.problem, state.ranked, state.nuisance_jacobian)
    return replace(state, ranked=tuple(ranked))
