"""The report's signals from the state of a diagnosis: the one place where the report meets the pipeline."""

from __future__ import annotations

import numpy as np

from ...core.units import convert, unit
from ..analysis.all_samples import among_all_samples
from ..analysis.verdict import NO_GAP
from ..campaign.campaign import Channel as Measured
from ..campaign.campaign import si
from ..pipeline.holdout import HoldoutRuns
from ..pipeline.state import State
from ..problem.problem import Problem
from .section import SHOWN
from .signals import (
    Array,
    Channel,
    Condition,
    Dependence,
    InputTrace,
    MeanCurve,
    RunSignals,
    Signals,
    Trace,
    unit_of_parameter,
)


def collect(state: State) -> Signals:
    """All that the report needs beside diagnosis.json."""
    problem = state.problem
    channels = [_channel(problem, c) for c in problem.campaign.outputs]
    channels += [Channel(label, label, "s") for label in problem.labels[len(channels) :]]
    runs = _runs(problem, *_residuals(state), False)
    if state.holdout is not None:
        runs += _runs(state.holdout.problem, *_held_out_residuals(state, state.holdout), True)
    neutral = {x.name: x.start for c in problem.candidates for x in c.parameters}
    return Signals(
        problem.campaign.system.name, tuple(channels), tuple(runs), tuple(_dependences(state)),
        dict(problem.parameter_units), neutral,
    )  # fmt: skip


def _fmu_unit(problem: Problem, c: Measured) -> str:
    """Unit of a channel's connector in its FMU."""
    return problem.units.get(c.connector) or si(c.unit)


def _channel(problem: Problem, c: Measured) -> Channel:
    return Channel(c.connector, c.column, c.unit, _factor(problem, c))


def _factor(problem: Problem, c: Measured) -> float:
    """A difference in the unit in which a channel was measured for one in that of its FMU."""
    return unit(_fmu_unit(problem, c)).factor / unit(c.unit).factor


def _shown(problem: Problem, c: Measured, values: Array) -> Array:
    """Values in the FMU's unit as they were measured."""
    return np.asarray(convert(values, _fmu_unit(problem, c), c.unit))


def _residuals(state: State) -> tuple[Array, Array, Array | None]:
    """As delivered, calibrated and with the effects, of all samples of the runs that were learned from."""
    baseline, chosen = state.ranked_baseline.hypothesis.fit, state.reported.hypothesis
    residuals = (state.problem.observations.whiten(state.nominal), baseline.residual, chosen.fit.residual)
    return _drawn(state.problem, state.all_samples, residuals, bool(chosen.candidates))


def _held_out_residuals(state: State, holdout: HoldoutRuns) -> tuple[Array, Array, Array | None]:
    """The same of the held-out runs."""
    residuals = (holdout.nominal_residual, state.residual_of(state.ranked_baseline), state.residual_of(state.reported))
    return _drawn(holdout.problem, state.held_samples, residuals, bool(state.reported.hypothesis.candidates))


def _drawn(
    problem: Problem, simulated: tuple[Array, ...], residuals: tuple[Array, ...], effects: bool
) -> tuple[Array, Array, Array | None]:
    """What was simulated anew where something swings, else, where there was no time for it, the rest of the samples;
    effects: whether the last has any."""
    before, calibrated, with_effects = simulated or tuple(among_all_samples(problem, x) for x in residuals)
    return before, calibrated, with_effects if effects else None


def _runs(
    problem: Problem, before: Array, calibrated: Array, explained: Array | None, held_out: bool
) -> list[RunSignals]:
    """Runs of a problem with what its models leave: normalised residuals of all samples (n,)."""
    observations, outputs, run_signals = problem.samples, problem.campaign.outputs, []
    for r, run in enumerate(problem.runs):
        traces = []
        for b in sorted((b for b in observations.series if b.run == r), key=lambda b: b.channel):
            c, at = outputs[b.channel], b.place
            noise = observations.noise_std[at]
            models = [None if x is None else _shown(problem, c, b.y - x[at] * noise)
                      for x in (before, calibrated, explained)]  # fmt: skip
            assert models[0] is not None
            assert models[1] is not None
            traces.append(
                Trace(c.connector, b.t, _shown(problem, c, b.y), models[0], models[1], models[2],
                      noise * _factor(problem, c))
            )  # fmt: skip
        inputs = [
            InputTrace(c.column, c.unit, run.inputs[c.connector][0], _shown(problem, c, run.inputs[c.connector][1]))
            for c in problem.campaign.inputs if c.connector in run.inputs
        ]  # fmt: skip
        stated, units = problem.campaign.runs[r].parameters, problem.parameter_units
        conditions = tuple(Condition(name, value, unit_of_parameter(units, name)) for name, value in stated.items())
        run_signals.append(RunSignals(run.name, held_out, run.stop, conditions, tuple(traces), tuple(inputs)))
    return run_signals


def _dependences(state: State) -> list[Dependence]:
    """What is left of the channel that is left most, against the signal that it varies with."""
    structure, character = state.structure, state.character
    if structure is None or character is None or not character.channel or state.verdict == NO_GAP:
        return []
    name = structure.varies_with.get(character.channel, "")
    dependence = _dependence(state, character.channel, name, structure.channels.get(character.channel, 0.0))
    return [] if dependence is None else [dependence]


def _dependence(state: State, label: str, name: str, share: float) -> Dependence | None:
    problem = state.problem
    rate, source = name.startswith("rate of "), name.removeprefix("rate of ")
    channels = {c.connector: c for c in problem.campaign.channels}
    if source not in channels or label not in channels:
        return None
    observations, model = problem.observations, state.reported.hypothesis.fit.model
    signals = {b.run: (b.t, model[b.place]) for b in observations.series if b.connector == source}
    x, places = [], []
    for b in observations.series:
        if b.connector == label and b.run in signals:
            t, signal = signals[b.run]
            x.append(np.interp(b.t, t, np.gradient(signal, t) if rate else signal))
            places.append(np.arange(b.place.start, b.place.stop))
    if not x:
        return None
    c, s, at = channels[label], channels[source], np.concatenate(places)
    factor = _factor(problem, c)
    xs = np.concatenate(x) * _factor(problem, s) if rate else _shown(problem, s, np.concatenate(x))
    residual = state.reported.cv_residual[at] * observations.noise_std[at] * factor
    noise = float(np.sqrt(np.mean(observations.noise_std[at] ** 2))) * factor
    shown = f"rate of {s.column}" if rate else s.column
    shown_unit = (f"{s.unit}/s" if s.unit != "1" else "1/s") if rate else s.unit
    return Dependence(label, shown, shown_unit, xs, residual, noise, share, _mean_curve(xs, residual))


def _mean_curve(x: Array, residual: Array) -> MeanCurve:
    """Mean residual in narrow intervals of the signal, with equally many readings in each."""
    parts = np.array_split(np.argsort(x, kind="stable"), int(np.clip(len(x) // 6, 1, SHOWN.mean_intervals)))
    means = [(x[p].mean(), residual[p].mean()) for p in parts if len(p)]
    return MeanCurve(np.array([a for a, _ in means]), np.array([b for _, b in means]))
