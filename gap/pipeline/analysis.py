"""Stages after the search: probabilities, where the gap lies, what to measure next."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ...core.errors import SimulationError
from ..analysis.component_replay import replay_components
from ..analysis.experiment_design import NextMeasurement, rank_measurements
from ..analysis.localisation import localise, regions
from ..analysis.residual_structure import residual_structure
from ..checks.sensor_consistency import check_sensors
from ..estimation.uncertainty import reduction_interval
from ..selection.calibration import Calibration
from ..selection.posterior import NONE, UNKNOWN, Cause, causes, features
from .remarks import remarks
from .state import State


def look_at_rest(state: State) -> State:
    """What of the best hypothesis' residual follows something."""
    problem, best = state.problem, state.ranked[0]
    rows = problem.rows([best.hypothesis.fit.point], problem.fit_step)[0]
    assert rows is not None
    return replace(state, structure=residual_structure(problem, best.held_out, rows, problem.fit_step))


def weigh_causes(state: State) -> State:
    """Probabilities."""
    calibration = Calibration.load()
    energies = state.ranked_baseline.structured_energy, state.ranked[0].structured_energy
    x = features(calibration, *energies, len(state.problem.observations))
    found = causes(state.ranked, calibration, x)
    most = state.problem.settings.analysis.causes_told
    found = [replace(c, told=k < most or c.effects in (NONE, UNKNOWN)) for k, c in enumerate(found)]
    warnings = state.warnings
    if state.unfinished:
        told = f"ended before everything was tried, while {state.unfinished}: probabilities are too sure"
        warnings = (*warnings, told)
    return replace(state, causes=tuple(found), features=tuple(float(v) for v in x), warnings=warnings)


def locate(state: State) -> State:
    """Where the gap lies, and which component has it."""
    state = replace(state, masks=_masks(state))
    found, failed = [], []
    for cause in state.causes:
        if cause.ranked is not None and cause.told and cause.ranked is not state.chosen:
            try:
                state.gap(cause.ranked)  # simulates the held-out runs
            except SimulationError as error:
                cause = replace(cause, told=False)
                failed.append(f"{' + '.join(cause.effects)}: {error}")
        found.append(cause)
    state = replace(state, causes=tuple(found))
    places = localise(state.scoring, state.after(state.ranked_baseline), state.masks)
    replays = replay_components(state.problem, state.refit.fit.point)
    warnings = [*state.warnings, *failed, *check_sensors(state.problem, state.nominal), *remarks(state)]
    interval = reduction_interval(state.scoring, state.before, state.after(state.chosen))
    return replace(
        state, places=tuple(places), replays=tuple(replays), warnings=tuple(warnings), reduction_ci=interval
    )  # fmt: skip


def _masks(state: State) -> dict[str, np.ndarray]:
    scoring, step = state.scoring, state.problem.fit_step
    wanted = state.problem.catalogue.regions
    record = tuple(dict.fromkeys(r.signal for r in wanted if r.signal in scoring.signals))
    if not record:
        return regions(scoring, (), (), [], scoring.fit_step)
    rows = scoring.rows([state.refit.fit.point], step, record, keep=False)[0]
    return {} if rows is None else regions(scoring, wanted, record, rows, step)


def design_experiment(state: State) -> State:
    """What to measure next."""
    return replace(state, next_measurements=tuple(_next(state, state.causes)))


def _next(state: State, found: Sequence[Cause]) -> list[NextMeasurement]:
    known = [c.ranked for c in found if c.ranked is not None]
    if len(known) < 2:
        return []
    first = known[0]
    others = [r for r in known[1:] if not set(r.hypothesis.ids or NONE) & set(first.hypothesis.ids or NONE)]
    second = others[0] if others else known[1]
    return rank_measurements(state.problem, first.hypothesis, second.hypothesis)
