"""Whether the time of a run that measured inputs drive is in the unit that the campaign says.

The length of such a run says little, but whoever measures a machine reads it about as often as its model has to step,
within a factor of a hundred. Where readings are farther apart than that, or nearer, and would not be in another unit,
the model as delivered is run over the first part with either: it tells, unless it is as right at any speed.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...core.units import unit
from ...master.parallel.pool import Failure, Job
from ..campaign.campaign import CampaignError
from ..problem.problem import Problem
from .unit_mistakes import missed_share

UNITS_OF_TIME = ("s", "ms", "us")


class _Suspicion(NamedTuple):
    """A run whose times would rather be in another unit: f of it make one of the unit that they are taken to be in."""

    run: int
    better_unit: str
    f: float
    interval: float
    """Between readings, as their times are taken [s]."""


def check_time(problem: Problem) -> list[str]:
    """Raise `CampaignError` where time is in another unit; returns warnings of where it may be.

    The shortest run that is suspected speaks for all, for simulating it costs least.
    """
    order = sorted(range(len(problem.runs)), key=lambda r: problem.runs[r].stop)
    suspicion = next((x for r in order if (x := _suspicion(problem, r)) is not None), None)
    return [] if suspicion is None else _weigh_suspicion(problem, suspicion)


def _suspicion(problem: Problem, r: int) -> _Suspicion | None:
    run, most = problem.campaign.runs[r], problem.settings.sanity.steps_between_readings
    times = [run.series[c.connector][0] for c in problem.campaign.outputs if c.connector in run.series]
    if not problem.runs[r].inputs or not times:
        return None
    interval = min(float(np.median(np.diff(t))) for t in times)
    stated = run.time_unit or "s"
    for better_unit in UNITS_OF_TIME:
        factor = unit(stated).factor / unit(better_unit).factor
        apart = interval / problem.macro_step
        if not 1.0 / most <= apart <= most and 1.0 / most <= apart / factor <= most:
            return _Suspicion(r, better_unit, factor, interval)
    return None


def _weigh_suspicion(problem: Problem, x: _Suspicion) -> list[str]:
    settings, run, stop = problem.settings.sanity, problem.campaign.runs[x.run], problem.runs[x.run].stop
    first = min(float(b.t[0]) for b in problem.observations.series if b.run == x.run)
    until = min(stop, first + settings.steps_of_first_part * problem.macro_step * min(1.0, x.f))
    after = _missed_shares(problem, x.run, until, x.f)
    if after is None:
        return []
    before = _missed_shares(problem, x.run, until, 1.0) or [settings.most_movement] * len(after)
    gain = float(np.log(before).sum() - np.log(after).sum())
    recovered = any(
        b > settings.movement_lost and a < settings.movement_found for b, a in zip(before, after, strict=True)
    )
    is_better = recovered and gain > settings.as_good
    if gain < -settings.no_worse:
        return []
    key, scenario = f'time_unit = "{x.better_unit}" in the run', problem.scenario_stop
    keep = "" if run.time_unit else ', time_unit = "s" that it is not'
    apart = f"{x.interval:g} s apart, {x.interval / problem.macro_step:.3g} macro steps"
    text = f"{problem.campaign.file}: run '{run.name}': its readings are {apart}"
    if is_better:
        text += f", and the model follows them far better with time in {x.better_unit}: {key} says so{keep}"
        if run.time_unit != "s":  # who states seconds has been asked
            raise CampaignError(text)
        return [text]
    text += f"; is time in {x.better_unit}? {key} says so"
    if run.time_unit is None and scenario is not None and 0.5 < stop / (x.f * scenario) < 1.5:
        raise CampaignError(f"{text} and makes it as long as the scenario{keep}")
    return [text + keep]


def _missed_shares(problem: Problem, r: int, until: float, factor: float) -> list[float] | None:
    """Share of each channel's movement up to a time [s] that the model as delivered misses, if the times in the run's
    files are of 1/f s; None where it does not run."""
    step, conditions = problem.macro_step, problem.runs[r]
    inputs = {c: (t / factor, x) for c, (t, x) in conditions.inputs.items()}
    stop = float(max(1.0, np.ceil(until / factor / step)) * step)
    record, method = tuple(problem.connectors), problem.discretisation.method
    (rows,) = problem.simulator.simulate([Job(record, stop, step, problem.overrides(r, {}), inputs, method=method)])
    if isinstance(rows, Failure):
        return None
    shares = []
    for b in problem.observations.series:
        in_time = b.t <= until
        if b.run == r and in_time.any():
            signal = rows[:, record.index(b.connector)]
            model = np.interp(b.t[in_time] / factor, np.arange(len(signal)) * step, signal)
            shares.append(missed_share([b.y[in_time]], [model], b.noise_std, problem.settings.sanity))
    return shares or None
