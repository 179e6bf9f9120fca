"""The time series behind the pictures: measured, as delivered, refitted, with the best cause."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..heldout import rms
from ..observations import Observations
from ..problem import Problem
from ..result import Diagnosis
from .numbers import Shown


@dataclass
class Trace:
    """A channel in a run, everything in the unit in which it was measured; floor is one noise floor."""

    column: str
    connector: str
    unit: str
    t: np.ndarray
    measured: np.ndarray
    delivered: np.ndarray
    refitted: np.ndarray
    best: np.ndarray
    floor: np.ndarray
    before: float
    after: float
    """Gaps in floors."""
    changes: tuple[float, ...]
    """Times [s] at which the residual of the refitted model changes its level."""


@dataclass
class Run:
    """The channels of a run, and its gaps in floors."""

    name: str
    held: bool
    conditions: dict[str, object]
    seconds: float
    before: float
    refitted: float
    after: float
    traces: list[Trace]


def runs(d: Diagnosis) -> list[Run]:
    """All runs in the order of the campaign, those that it holds out last."""
    s = d.study
    problem, obs = s.problem, s.problem.obs
    fitted = d.chosen.hypothesis.fit
    made = _runs(d, problem, s.delivered, s.null.fit.residual, fitted.residual, held=False)
    assert len(obs) == len(fitted.residual)
    if s.held is not None:
        made += _runs(d, s.held.problem, s.held.delivered, s.after(s.null_judged), s.after(d.chosen), held=True)
    return made


def _runs(
    d: Diagnosis, problem: Problem, delivered: np.ndarray, refitted: np.ndarray, best: np.ndarray, held: bool
) -> list[Run]:
    """Runs of a problem; delivered is a model's long vector, refitted and best are whitened residuals."""
    obs: Observations = problem.obs
    before = (obs.y - delivered) / obs.floor
    changes: dict[tuple[str, str], list[float]] = {}
    for p in d.places:
        for run, t in p.changes:
            changes.setdefault((run, p.channel), []).append(t)
    made = []
    for r, info in enumerate(problem.runs):
        traces = []
        for b in sorted((b for b in obs.blocks if b.run == r), key=lambda b: b.channel):
            c = problem.campaign.outputs[b.channel]
            shown = Shown(c, problem.units.get(c.connector))
            at = b.place
            traces.append(
                Trace(
                    c.column, c.connector, shown.unit, b.t,
                    shown.value(b.y), shown.value(delivered[at]),
                    shown.value(b.y - refitted[at] * obs.floor[at]), shown.value(b.y - best[at] * obs.floor[at]),
                    shown.difference(obs.floor[at]), rms(before[at]), rms(best[at]),
                    tuple(changes.get((info.name, c.connector), ())),
                )
            )  # fmt: skip
        mine = obs.run == r
        gaps = (rms(x[mine]) for x in (before, refitted, best))
        made.append(Run(info.name, held, dict(problem.campaign.runs[r].parameters), info.stop, *gaps, traces))
    return made


@dataclass
class Dependence:
    """What is left of a channel against the signal that it varies with most."""

    column: str
    unit: str
    x_name: str
    x_unit: str
    x: np.ndarray
    residual: np.ndarray
    floor: float


def dependence(d: Diagnosis, connector: str) -> Dependence | None:
    """The residual of the best hypothesis in a channel against what `structure` found; None where there is nothing."""
    s = d.study
    problem, obs = s.problem, s.problem.obs
    best = s.judged[0]
    name = s.structure.varies_with.get(connector)
    if name is None:
        return None
    rate, source = name.startswith("rate of "), name.removeprefix("rate of ")
    channels = {c.connector: c for c in problem.campaign.outputs}
    if source not in channels or connector not in channels:
        return None
    model = best.hypothesis.fit.model
    by_run = {b.run: b for b in obs.blocks if b.connector == source}
    x, e, f = [], [], []
    for b in obs.blocks:
        if b.connector != connector or b.run not in by_run:
            continue
        other = by_run[b.run]
        signal = model[other.place]
        signal = np.gradient(signal, other.t) if rate else signal
        x.append(np.interp(b.t, other.t, signal))
        e.append(best.held_out[b.place] * obs.floor[b.place])
        f.append(obs.floor[b.place])
    if not x:
        return None
    here = Shown(channels[connector], problem.units.get(connector))
    there = Shown(channels[source], problem.units.get(source))
    xs = np.concatenate(x)
    xs = there.difference(xs) if rate else there.value(xs)
    x_unit = (f"{there.unit}/s" if there.unit else "1/s") if rate else there.unit
    return Dependence(
        channels[connector].column, here.unit, f"rate of {channels[source].column}" if rate else channels[source].column,
        x_unit, xs, here.difference(np.concatenate(e)), float(here.difference(rms(np.concatenate(f)))),
    )  # fmt: skip
