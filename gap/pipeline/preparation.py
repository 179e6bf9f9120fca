"""Stages before the search: the step's error, what betrays a campaign, held-out runs, finite differences."""

from __future__ import annotations

from dataclasses import replace

from ..checks.campaign_sanity import check_campaign
from ..checks.run_mistakes import check_runs
from ..checks.sensor_consistency import check_sensors
from ..checks.time_unit import check_time
from ..estimation.nuisances import nuisance_jacobian_at
from ..problem.find_swings import as_compared, compare_swings
from ..problem.step_size import assess_step_error, choose_difference_step, choose_fit_step
from .holdout import build_holdout
from .state import State


def assess_steps(state: State) -> State:
    """Macro steps of exact runs and of fits, the noise with the step's error in it, and the campaign checked."""
    time_warnings = check_time(state.problem)  # before runs a thousand times too long are simulated
    assessed = assess_step_error(state.problem)
    warnings = [*time_warnings, *check_campaign(assessed.problem, assessed.nominal)]
    problem = choose_fit_step(assessed.problem, assessed.nominal, state.package_step)
    return replace(
        state, problem=problem, nominal=assessed.nominal, step_change=assessed.change,
        nominal_macro_step=problem.macro_step,
        warnings=(*state.warnings, *warnings, *([assessed.unresolved] if assessed.unresolved else [])),
        noise_widened=assessed.unresolved,
    )  # fmt: skip


def compare_sensors(state: State) -> State:
    """Whether sensors contradict each other, and runs what is said of them; before swings are described, for that
    needs samples."""
    mistakes = tuple(f.in_one_line for f in check_runs(state.problem, state.nominal))
    warnings = (*state.warnings, *check_sensors(state.problem, state.nominal), *mistakes)
    return replace(state, warnings=warnings, run_mistakes=mistakes)


def describe_swings(state: State) -> State:
    """What swings by itself described by its trend, amplitude and frequency."""
    problem = compare_swings(state.problem, state.nominal)
    nominal, change = as_compared(problem, state.nominal), state.step_change
    if len(change):
        change = nominal - as_compared(problem, state.nominal - change)
    return replace(state, problem=problem, nominal=nominal, step_change=change)


def build_held_out_runs(state: State) -> State:
    """The held-out runs, simulated as the others."""
    assert state.holdout_campaign is not None
    holdout = build_holdout(state.problem, state.holdout_campaign)
    return replace(state, holdout=holdout, warnings=(*state.warnings, *holdout.warnings))


def prepare_fits(state: State) -> State:
    """The nuisances' columns and the step of finite differences."""
    nuisance_jacobian = nuisance_jacobian_at(state.problem, state.nominal)
    return replace(state, nuisance_jacobian=nuisance_jacobian, problem=choose_difference_step(state.problem))
