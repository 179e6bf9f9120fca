"""The time series behind the pictures: measured, as delivered, refitted, with the best cause."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..analysis.component_replay import smooth
from ..estimation.cross_validation import folds
from ..pipeline.diagnosis import Diagnosis
from ..problem.noise import rms
from ..problem.observations import Observations
from ..problem.problem import Problem
from .numbers import Shown


@dataclass(frozen=True)
class Quantity:
    """What is compared: a channel, or the time of an event (which has no connector of its own)."""

    name: str
    connector: str
    shown: Shown


def quantities(problem: Problem) -> dict[str, Quantity]:
    """Quantities by label, in the order of the channels of the observations."""
    outputs = problem.campaign.outputs
    made = {
        c.connector: Quantity(c.column, c.connector, Shown(c.unit, problem.units.get(c.connector))) for c in outputs
    }
    made.update({label: Quantity(label, "", Shown("s", "s")) for label in problem.labels[len(outputs) :]})
    return made


@dataclass
class Timing:
    """An event of a run: durations [s] measured and simulated, or a limit of the former."""

    name: str
    limit: str
    """≤ or ≥ where only a limit was measured."""
    measured: float
    nominal: float
    refitted: float
    best: float
    floor: float


@dataclass
class Trace:
    """A channel in a run, everything in the unit in which it was measured; floor is one noise floor."""

    column: str
    connector: str
    unit: str
    t: np.ndarray
    measured: np.ndarray
    nominal: np.ndarray
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
    events: list[Timing]


def runs(d: Diagnosis) -> list[Run]:
    """All runs in the order of the campaign, those that it holds out last."""
    s = d.state
    problem, observations = s.problem, s.problem.observations
    fitted = d.state.chosen.hypothesis.fit
    made = _runs(d, problem, s.nominal, s.refit.fit.residual, fitted.residual, held=False)
    assert len(observations) == len(fitted.residual)
    if s.holdout is not None:
        made += _runs(
            d, s.holdout.problem, s.holdout.nominal, s.after(s.ranked_baseline), s.after(d.state.chosen), held=True
        )
    return made


def _runs(
    d: Diagnosis, problem: Problem, nominal: np.ndarray, refitted: np.ndarray, best: np.ndarray, held: bool
) -> list[Run]:
    """Runs of a problem; delivered is a model's long vector, refitted and best are whitened residuals."""
    observations: Observations = problem.observations
    before = (observations.y - nominal) / observations.noise_std
    changes: dict[tuple[str, str], list[float]] = {}
    for p in d.state.places:
        for run, t in p.changes:
            changes.setdefault((run, p.channel), []).append(t)
    known = list(quantities(problem).values())
    made = []
    for r, info in enumerate(problem.runs):
        traces, events = [], []
        for b in sorted((b for b in observations.blocks if b.run == r), key=lambda b: b.channel):
            c, at = known[b.channel], b.place
            shown = c.shown
            if b.event is not None:
                y, floor = float(b.y[0]), float(observations.noise_std[at][0])
                models = (float(nominal[at][0]), y - float(refitted[at][0]) * floor, y - float(best[at][0]) * floor)
                limit = "≤ " if b.event.low == y else "≥ " if b.event.high == y else ""
                events.append(Timing(c.name, limit, y, *models, floor))
                continue
            traces.append(
                Trace(
                    c.name, c.connector, shown.unit, b.t,
                    shown.value(b.y), shown.value(nominal[at]),
                    shown.value(b.y - refitted[at] * observations.noise_std[at]), shown.value(b.y - best[at] * observations.noise_std[at]),
                    shown.difference(observations.noise_std[at]), rms(before[at]), rms(best[at]),
                    tuple(changes.get((info.name, c.connector), ())),
                )
            )  # fmt: skip
        mine = observations.run == r
        gaps = (rms(x[mine]) for x in (before, refitted, best))
        made.append(Run(info.name, held, dict(problem.campaign.runs[r].parameters), info.stop, *gaps, traces, events))
    return made


SMOOTH = 0.02
"""Standard deviation of the kernel with which measured inputs are smoothed [s]."""

NARROW = 48
"""Intervals of a signal in which a dependence is looked for."""


@dataclass
class Dependence:
    """What is left of a channel against a signal of the simulation."""

    column: str
    unit: str
    x_name: str
    x_unit: str
    x: np.ndarray
    residual: np.ndarray
    way: np.ndarray
    """1 where the signal rises, -1 where it falls, 0 where it rests."""
    fold: np.ndarray
    """Runs or stretches of time, numbered."""
    floor: float
    given: bool = False
    """The signal is an input as it was measured, not one of the simulation."""
    share: float = 0.0
    """Share of the residual's energy that the mean at that signal predicts, on folds it was not taken from."""
    odd: bool = False
    """The residual turns its sign with the direction, like friction."""

    def __post_init__(self) -> None:
        even, odd = self._predicted(self.residual), self._predicted(self.residual * self.way)
        self.odd = odd > even
        self.share = max(0.0, even, odd)

    def _predicted(self, e: np.ndarray) -> float:
        edges = np.unique(np.quantile(self.x, np.linspace(0.0, 1.0, NARROW + 1)[1:-1]))
        place, total = np.digitize(self.x, edges), float(self.residual @ self.residual)
        left = total
        size = len(edges) + 1
        sums, counts = np.bincount(place, e, size), np.bincount(place, minlength=size)
        for k in np.unique(self.fold):
            test = self.fold == k
            n = counts - np.bincount(place[test], minlength=size)
            mean = (sums - np.bincount(place[test], e[test], size)) / np.maximum(n, 1)
            mean = mean * (n >= 3)
            told = mean[place[test]]
            left += float(told @ told - 2.0 * told @ e[test])
        return 1.0 - left / total if total > 0.0 else 0.0

    def means(self, way: int) -> tuple[np.ndarray, np.ndarray]:
        """Signal and mean residual in narrow intervals, while the signal goes that way; 0: whichever way."""
        mine = np.flatnonzero(self.way == way) if way else np.arange(len(self.x))
        mine = mine[np.argsort(self.x[mine], kind="stable")]
        parts = np.array_split(mine, int(np.clip(len(mine) // 6, 1, NARROW))) if len(mine) >= 24 else []
        return np.array([self.x[p].mean() for p in parts]), np.array([self.residual[p].mean() for p in parts])


def dependences(d: Diagnosis, connector: str) -> list[Dependence]:
    """The residual of the best hypothesis in a channel against the signal that predicts it best, and against the one
    that `structure` names, if that is another one."""
    campaign = d.state.problem.campaign
    names = [c.connector for c in (*campaign.outputs, *campaign.inputs)]
    known = {}
    for name in (n for x in names for n in (x, f"rate of {x}")):
        found = dependence(d, connector, name)
        if found is not None and np.ptp(found.x) > 0.0:
            known[name] = found
    if not known:
        return []
    told = known.get(d.state.structure.varies_with.get(connector, ""))
    best = max(known.values(), key=lambda x: x.share)
    if told is None or told is best:
        return [best]
    if best.share < 0.05:
        return [told]
    return [best, told] if told.share > 0.05 else [best]


def dependence(d: Diagnosis, connector: str, name: str) -> Dependence | None:
    """The residual of the best hypothesis in a channel against a signal or its rate; None where there is none.

    The signal is that of the simulation, or an input as it was measured.
    """
    s = d.state
    problem, observations = s.problem, s.problem.observations
    best = s.ranked[0]
    rate, source = name.startswith("rate of "), name.removeprefix("rate of ")
    known = quantities(problem)
    for c in problem.campaign.inputs:
        known[c.connector] = Quantity(c.column, c.connector, Shown(c.unit, problem.units.get(c.connector)))
    if source not in known or connector not in known:
        return None
    model = best.hypothesis.fit.model
    numbers = np.zeros(len(observations), int)
    for k, mask in enumerate(folds(observations)):
        numbers[mask] = k
    signals = {b.run: (b.t, model[b.place]) for b in observations.series if b.connector == source}
    signals.update({r: info.inputs[source] for r, info in enumerate(problem.runs) if source in info.inputs})
    x, way, where = [], [], []
    for b in observations.series:
        if b.connector != connector or b.run not in signals:
            continue
        t, signal = signals[b.run]
        if source in problem.runs[b.run].inputs:
            signal, slope = smooth(t, signal, b.t, max(SMOOTH, 2.0 * float(np.median(np.diff(t)))))
        else:
            signal, slope = np.interp(b.t, t, signal), np.interp(b.t, t, np.gradient(signal, t))
        if rate:
            signal, slope = slope, np.gradient(slope, b.t)
        x.append(signal)
        way.append(np.sign(slope) * (np.abs(slope) > 0.1 * np.quantile(np.abs(slope), 0.9)))
        where.append(np.arange(b.place.start, b.place.stop))
    if not x:
        return None
    here, there = known[connector].shown, known[source].shown
    at = np.concatenate(where)
    xs = np.concatenate(x)
    xs = there.difference(xs) if rate else there.value(xs)
    x_name = f"rate of {known[source].name}" if rate else known[source].name
    x_unit = (f"{there.unit}/s" if there.unit else "1/s") if rate else there.unit
    return Dependence(
        known[connector].name, here.unit, x_name, x_unit, xs,
        here.difference(best.held_out[at] * observations.noise_std[at]), np.concatenate(way).astype(int), numbers[at],
        float(here.difference(rms(observations.noise_std[at]))), source not in problem.connectors,
    )  # fmt: skip
