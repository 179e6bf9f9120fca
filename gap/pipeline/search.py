"""Stages of the search: the baseline, rounds over sets of effects, what the best of them need to be judged."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ...core.errors import SimulationError
from ..estimation.nuisances import nuisance_jacobian_at
from ..search.baseline import explains_much, is_strained, refit_base, resume_refit, simulate_nominal, unfitted_baseline
from ..search.earlier import baseline_point, refit_sets
from ..search.forms import adopt_forms, any_forms_left
from ..search.forms import try_forms as search_forms
from ..search.relatives import fit_relatives_at_best
from ..search.relatives import swap_relatives as search_relatives
from ..search.rounds import (
    Round,
    best_of_each_set,
    drop_each_effect,
    drop_needless_sets,
    fit_leaders,
    look_first,
    next_start,
    polish_round,
    run_quick_round,
    search_cost,
    search_round,
)
from ..search.shorter_step import search_with_shorter_step
from ..search.starts import corrected_for_step
from ..search.step_refinement import refine_fit_step, refine_macro_step, refit_with_exact_step
from ..search.widening import widen_derivatives
from ..selection.evidence import rank_hypotheses
from ..selection.hypothesis import Hypothesis, is_adequate
from .state import State


def fit_baseline(state: State) -> State:
    """The refit of the base parameters, and where the first bank is made: there, or at the model as delivered where the
    refit explains little or strains many of them, for base parameters bent to what they cannot explain lead away from
    what can. The other one is for later. Where the refit needs runs of shorter steps, so does the search."""
    nominal = simulate_nominal(state.problem, state.nuisance_jacobian)
    baseline = None
    if state.earlier is not None and state.problem.base:
        point = baseline_point(state.problem, state.earlier.sets)
        baseline = resume_refit(state.problem, state.nuisance_jacobian, nominal, point)
    baseline = baseline or refit_base(state.problem, state.nuisance_jacobian, nominal)
    problem, (baseline,) = refit_with_exact_step(state.problem, baseline, state.nuisance_jacobian)
    if problem is not state.problem:
        state, nominal = replace(state, problem=problem), simulate_nominal(problem, state.nuisance_jacobian)
    start, later = nominal, baseline
    adequate = is_adequate(state.problem, baseline.fit)
    if explains_much(state.problem, baseline, nominal) and (adequate or not is_strained(state.problem, baseline)):
        start, later = later, start
    levels = f"from {nominal.fit.rms:.3g} to {baseline.fit.rms:.3g} times the noise{state.subset_text}"
    return replace(
        state, baseline=baseline, start=start, other_start=later,
        progress=f"so far: calibration brings the gap {levels}",
    )  # fmt: skip


def resume_search(state: State) -> State:
    """The sets of an earlier diagnosis, fitted anew from where they stood; the search goes on from the best of them,
    once if it had come to its end before."""
    if state.earlier is None:
        raise ValueError("there is no earlier diagnosis")
    refits = refit_sets(state.problem, state.earlier.sets, state.required_baseline, state.nuisance_jacobian)
    hypotheses = best_of_each_set([*state.hypotheses, *refits])
    return replace(
        state, fitted_sets=tuple(h for h in hypotheses if h.candidates), start=hypotheses[0],
        progress=describe_progress(state, hypotheses),
        other_start=None if state.earlier.finished else state.other_start,
    )  # fmt: skip


def look_at_sets(state: State) -> State:
    """A few steps of sets of effects that look best once each was run at its usual size: the first that can be said."""
    first = look_first(state.problem, state.nuisance_jacobian, state.start_or_baseline)
    hypotheses = best_of_each_set([*state.hypotheses, *first.hypotheses])
    return replace(
        state, first_look=first, fitted_sets=tuple(h for h in hypotheses if h.candidates),
        shares_alone=first.shares_alone, progress=describe_progress(state, hypotheses),
    )  # fmt: skip


def compare_sets_quickly(state: State) -> State:
    """Quick fits of sets of effects, from a bank where the search begins; what was said before is forgotten, for these
    were begun from more than usual sizes."""
    bank = state.first_look.bank if state.first_look else None
    quick = run_quick_round(state.problem, state.nuisance_jacobian, state.start_or_baseline, bank)
    hypotheses = best_of_each_set([state.required_baseline, *quick.hypotheses])
    return replace(
        state, first_look=None, quick_round=quick, fitted_sets=tuple(h for h in hypotheses if h.candidates),
        shares_alone=quick.shares_alone, progress=describe_progress(state, hypotheses),
    )  # fmt: skip


def fit_best_sets(state: State) -> State:
    """The best of these to the end."""
    polished = polish_round(state.problem, state.nuisance_jacobian, state.required_quick_round)
    return _after_round(replace(state, fitted_sets=(), quick_round=None), polished)


def compare_sets(state: State) -> State:
    """Sets of effects from a bank where the search stands, the best of them fitted to the end."""
    return _after_round(state, search_round(state.problem, state.nuisance_jacobian, state.start_or_baseline))


def _after_round(state: State, completed: Round) -> State:
    """The state with what a round has found, and where to look next."""
    incumbent = state.start_or_baseline
    hypotheses = best_of_each_set([*state.hypotheses, *completed.hypotheses])
    baseline = next(h for h in hypotheses if not h.candidates)
    bank_sets = (*state.bank_sets, incumbent.key)
    other_start = None if incumbent is state.other_start else state.other_start
    before = search_cost(best_of_each_set(state.hypotheses)[0])
    better = search_cost(hypotheses[0]) < before - state.problem.settings.search.min_round_gain
    return replace(
        state, baseline=baseline, fitted_sets=tuple(h for h in hypotheses if h.candidates), bank_sets=bank_sets,
        other_start=other_start, start=next_start(hypotheses, bank_sets, better, other_start),
        progress=describe_progress(state, hypotheses),
    )  # fmt: skip


def describe_progress(state: State, hypotheses: Sequence[Hypothesis]) -> str:
    """What the best set leaves of what calibration leaves."""
    best, before = hypotheses[0], next(h.fit.rms for h in hypotheses if not h.candidates)
    if not best.candidates:
        return f"so far: no effect does better than calibration, which leaves {before:.3g} times the noise"
    compared = f"{len(hypotheses) - 1} sets fitted{state.subset_text}"
    return f"so far: {best.label} leaves {best.fit.rms:.3g} of the {before:.3g} noises left by calibration; {compared}"


def can_continue(state: State) -> bool:
    """Whether another round may find something: the best leaves something, and there is a set to go on from."""
    best = best_of_each_set(state.hypotheses)[0]
    begun = bool(state.bank_sets) or state.earlier is not None
    return state.start is not None and begun and not is_adequate(state.problem, best.fit)


def _leaves_more_than(state: State, trifle: float) -> bool:
    """Whether what the best set leaves is more than that share of what calibration leaves, as energies."""
    best, refit = best_of_each_set(state.hypotheses)[0], state.required_baseline.fit
    energy, whole = (state.problem.observations.structured_energy(f.residual) for f in (best.fit, refit))
    return energy > trifle * whole


def is_worth_continuing(state: State) -> bool:
    """Whether another round may find something that is worth it."""
    return can_continue(state) and _leaves_more_than(state, state.problem.settings.search.min_energy_share)


def has_moved(state: State) -> bool:
    """Whether another round may find something that is worth it at the best set, around which there has been none: of
    nine rounds at a part of it none found anything."""
    best = best_of_each_set(state.hypotheses)[0]
    return is_worth_continuing(state) and state.start is not None and state.start.key == best.key


def has_long_steps(state: State) -> bool:
    """Whether something is left that runs of shorter steps might show."""
    best, settings = best_of_each_set(state.hypotheses)[0], state.problem.settings.search
    something_left = not is_adequate(state.problem, best.fit) and _leaves_more_than(state, settings.min_energy_share)
    return something_left and state.problem.discretisation.coarsening > 1


def look_at_shorter_steps(state: State) -> State:
    """Effects whose runs the long step spoils; where one of them is better, a round goes on from there."""
    refinement = search_with_shorter_step(state.problem, best_of_each_set(state.hypotheses), state.nuisance_jacobian)
    if refinement.problem is state.problem:
        return _with_fits(state, refinement.hypotheses)
    other = [] if state.other_start is None else [state.other_start]
    other_start = next(iter(corrected_for_step(refinement.problem, other, [])), None)
    state = replace(state, problem=refinement.problem, other_start=other_start)
    state = _with_fits(state, refinement.hypotheses)
    return compare_sets(state) if can_continue(state) else state


def fit_the_best(state: State) -> State:
    """Sets near the best to the end, the macro step that it needs, and it without each of its effects."""
    problem, nuisance_jacobian = state.problem, state.nuisance_jacobian
    hypotheses = fit_leaders(problem, best_of_each_set(state.hypotheses), nuisance_jacobian)
    problem, hypotheses = refine_macro_step(problem, hypotheses, nuisance_jacobian)
    problem, hypotheses = refine_fit_step(problem, hypotheses, nuisance_jacobian)
    hypotheses = fit_relatives_at_best(problem, hypotheses, nuisance_jacobian)
    hypotheses = drop_each_effect(problem, hypotheses, nuisance_jacobian)
    baseline = next(h for h in hypotheses if not h.candidates)
    return replace(state, problem=problem, baseline=baseline, fitted_sets=tuple(h for h in hypotheses if h.candidates))


def swap_relatives(state: State) -> State:
    """Effects that act alike in each other's place."""
    hypotheses = search_relatives(state.problem, best_of_each_set(state.hypotheses), state.nuisance_jacobian)
    return _with_fits(state, hypotheses)


def try_forms(state: State) -> State:
    """Effects that are in, in other forms than the plain one; the best set's forms are those of its effects from then
    on."""
    hypotheses = search_forms(state.problem, best_of_each_set(state.hypotheses), state.nuisance_jacobian)
    problem = adopt_forms(state.problem, hypotheses[0])
    return replace(_with_fits(state, hypotheses), problem=problem)


def try_curves(state: State) -> State:
    """Effects that are in, as free curves in the place of their formulas."""
    return _with_fits(
        state, search_forms(state.problem, best_of_each_set(state.hypotheses), state.nuisance_jacobian, curves=True)
    )


def has_curves(state: State) -> bool:
    """Whether something is left, and an effect that is in could be a free curve."""
    hypotheses = best_of_each_set(state.hypotheses)
    possible = any_forms_left(hypotheses, curves=True) and not is_adequate(state.problem, hypotheses[0].fit)
    return possible and _leaves_more_than(state, state.problem.settings.search.curve_min_energy_share)


def has_forms(state: State) -> bool:
    """Whether something is left, and an effect that is in could be in another form."""
    hypotheses = best_of_each_set(state.hypotheses)
    return any_forms_left(hypotheses) and not is_adequate(state.problem, hypotheses[0].fit)


def _with_fits(state: State, hypotheses: Sequence[Hypothesis]) -> State:
    """The state with fits that came between two rounds; where they are better, the next one begins there."""
    baseline = next(h for h in hypotheses if not h.candidates)
    better = search_cost(hypotheses[0]) < search_cost(best_of_each_set(state.hypotheses)[0])
    start = next_start(hypotheses, state.bank_sets, True, state.other_start) if better else state.start
    return replace(
        state, baseline=baseline, fitted_sets=tuple(h for h in hypotheses if h.candidates), start=start,
        progress=describe_progress(state, hypotheses),
    )  # fmt: skip


def has_relatives(state: State) -> bool:
    """Whether the best set has effects that others act like; an earlier search that came to its end has tried them."""
    if state.earlier is not None and state.earlier.finished:
        return False
    groups = [c.group for c in state.problem.candidates]
    return any(groups.count(c.group) > 1 for c in best_of_each_set(state.hypotheses)[0].candidates)


def rank_fitted(state: State) -> State:
    """All hypotheses ranked, with the derivatives that judging needs."""
    problem, warnings = state.problem, list(state.warnings)
    if problem.macro_step < state.nominal_macro_step:
        reason = "the gap's model depends on its macro step more than the delivered one: fits rest on steps of"
        package = f"the package's is {1e3 * state.package_step:g} ms"
        warnings.append(f"{reason} {1e3 * problem.macro_step:g} ms, {package}")
    holdout = state.holdout.like(problem) if state.holdout else None
    needed = drop_needless_sets(problem, best_of_each_set(state.hypotheses))
    widened = widen_derivatives(problem, needed, state.nuisance_jacobian)
    ranked = rank_hypotheses(problem, widened, state.nuisance_jacobian)
    return replace(state, ranked=tuple(ranked), holdout=holdout, warnings=tuple(warnings))


def rank_unfinished(state: State) -> State:
    """What was fitted before it was asked to stop, as it stands: no simulation is begun for it."""
    if not len(state.nominal):
        system = state.problem.campaign.system.name
        raise SimulationError(f"{system}: stopped before the model as delivered had run once; nothing can be said")
    nuisance_jacobian = state.nuisance_jacobian
    if not len(nuisance_jacobian):
        nuisance_jacobian = nuisance_jacobian_at(state.problem, state.nominal)
    baseline = state.baseline or unfitted_baseline(state.problem, state.nominal, nuisance_jacobian)
    caution = [f"Stopped before all runs were looked at: what is said here was found{state.subset_text}"]
    warnings = (*state.warnings, *(caution if state.all_runs else []))
    state = replace(state, nuisance_jacobian=nuisance_jacobian, baseline=baseline, holdout=None, warnings=warnings)
    return replace(state, ranked=tuple(rank_hypotheses(state.problem, state.hypotheses, nuisance_jacobian)))
