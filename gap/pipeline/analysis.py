"""Stages after the budget: where the gap lies, what is left, what to measure next."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..analysis.all_samples import residuals_of_all_samples
from ..analysis.character import describe_residual
from ..analysis.component_replay import replay_components
from ..analysis.experiment_design import rank_measurements, rival
from ..analysis.localisation import localise, regions
from ..analysis.residual_structure import residual_structure
from ..estimation.uncertainty import reduction_interval
from ..settings import SCORING
from .state import State


def assess_structure(state: State) -> State:
    """What of the most probable hypothesis' residual follows something."""
    problem, best = state.problem, state.reported
    rows = problem.rows([best.hypothesis.fit.point], problem.fit_step)[0]
    if rows is None:
        return state
    return replace(state, structure=residual_structure(problem, best.cv_residual, rows, problem.fit_step))


def locate(state: State) -> State:
    """Where the gap lies, which component has it, and the character of what is unexplained."""
    masks, scoring = _masks(state), state.scoring
    residual = state.residual_of(state.reported)
    places = localise(scoring, state.left_by_calibration, masks)
    character = describe_residual(scoring, residual, localise(scoring, residual, masks), state.structure)
    interval = reduction_interval(scoring, state.nominal_residual, residual)
    return replace(
        state, masks=masks, places=tuple(places), character=character, reduction_ci=interval
    )


def replay(state: State) -> State:
    """Each component alone, driven with what was measured."""
    replays = replay_components(state.problem, state.required_baseline.fit.point)
    return replace(state, replays=tuple(replays))


def _masks(state: State) -> dict[str, np.ndarray]:
    scoring, step = state.scoring, state.problem.fit_step
    catalogue_regions = state.problem.catalogue.regions
    record = tuple(dict.fromkeys(r.signal for r in catalogue_regions if r.signal in scoring.signals))
    if not record or state.problem.stop_requested:
        return regions(scoring, (), (), [], scoring.fit_step)
    rows = scoring.rows([state.required_baseline.fit.point], step, record, keep=False)[0]
    return {} if rows is None else regions(scoring, catalogue_regions, record, rows, step)


def draw_swings(state: State) -> State:
    """All samples of what swings, to be drawn."""
    fits = [state.ranked_baseline.hypothesis.fit, state.reported.hypothesis.fit]
    problems = [state.problem, *([state.holdout.problem] if state.holdout else [])]
    residuals = [
        residuals_of_all_samples(p, fits, state.problem) if p.recorded is not None else () for p in problems
    ]
    return replace(state, all_samples=residuals[0], held_samples=residuals[1] if len(residuals) > 1 else ())


def design_experiment(state: State) -> State:
    """What to measure next to tell the most probable hypothesis from the next one that is about something else."""
    k = rival(state.ranked, state.probabilities, state.problem)
    if k is None:
        return state
    odds = state.probabilities[0] / max(state.probabilities[k], SCORING.min_probability)
    pair, baseline = (state.ranked[0], state.ranked[k]), state.ranked_baseline.structured_energy
    measurements = rank_measurements(state.problem, pair, odds, baseline, state.nuisance_jacobian)
    return replace(state, next_measurements=tuple(measurements))
