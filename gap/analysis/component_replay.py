"""Each FMU alone, driven with what was measured at its inputs: is the fault inside it or does it only pass it on?

A measured signal is smoothed with a Gaussian kernel before it drives a stiff model; a rate that was not measured is the
derivative of the smoothed signal. What the noise that is left does to the outputs is found with disturbed copies and
added to the channel's noise. Inputs that nobody measured keep what the whole model says.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...master.parallel.pool import Failure, Job
from ...master.simulation.session import Session
from ..problem.observations import Block
from ..problem.parameters import Point
from ..problem.problem import Problem
from ..problem.signals import Smoothed, rate_pairs, smooth


@dataclass(frozen=True)
class Replay:
    """An FMU alone: its normalised RMS residual by connector, and how much noise the inputs pass on."""

    component: str
    driven_by: tuple[str, ...]
    assumed: tuple[str, ...]
    rms: dict[str, float]
    amplification: dict[str, float]
    """Propagated noise over the channel's own noise."""


@dataclass(frozen=True, eq=False)
class _Whole:
    """The whole model's signals at the point: what the replayed component gets where nobody measured."""

    point: Point
    sources: tuple[str, ...]
    rows: list[np.ndarray]
    rates: Mapping[str, str]
    """Signals that are the rate of another one."""


class _Link(NamedTuple):
    """A connection: its source, the input, and by what the value is multiplied, and what is added to it, on the way."""

    start: str
    end: str
    factor: float
    offset: float


@dataclass(frozen=True, eq=False)
class _Component:
    """A component with the connections into it and its measured outputs."""

    name: str
    connections: Sequence[_Link]
    outputs: tuple[str, ...]


def replay_components(problem: Problem, point: Point) -> list[Replay]:
    """A replay of every component whose inputs were measured at least in part, at the given point."""
    with Session(problem.campaign.system) as session:
        links = [
            _Link(".".join(x.start), ".".join(x.end), x.conversion.factor, x.conversion.offset)
            for x in session.system.links
        ]
        names = list(session.system.instances)
    if len(names) < 2:
        return []
    sources = tuple(dict.fromkeys(link.start for link in links))
    rows = problem.rows([point], problem.fit_step, sources, keep=False)[0]
    if rows is None:
        return []
    whole = _Whole(point, sources, rows, dict(rate_pairs(sources, rows[0], problem.fit_step)))
    measured = {b.connector for b in problem.samples.series}
    replays = []
    for name in names:
        connections = [link for link in links if link.end.startswith(f"{name}.")]
        component = _Component(name, connections, tuple(c for c in problem.connectors if c.startswith(f"{name}.")))
        varying = [x.start for x in connections if any(np.ptp(w[:, sources.index(x.start)]) > 0 for w in rows)]
        driven = [s for s in varying if s in measured or whole.rates.get(s) in measured]
        if varying and component.outputs and len(driven) == len(varying):
            replays.append(_replay(problem, component, whole))
    return [replay for replay in replays if replay is not None]


def _replay(problem: Problem, component: _Component, whole: _Whole) -> Replay | None:
    rng = np.random.default_rng(0)
    copies = 1 + problem.settings.analysis.replay_copies
    jobs: list[Job] = []
    assumed: set[str] = set()
    for r in range(len(problem.runs)):
        for copy in range(copies):
            jobs.append(_job(problem, component, whole, r, rng if copy else None, assumed))
    rows = [x for x in problem.simulator.simulate(jobs) if not isinstance(x, Failure)]
    if len(rows) < len(jobs):
        return None
    missed, amplification = {}, {}
    for k, connector in enumerate(component.outputs):
        blocks = [b for b in problem.samples.series if b.connector == connector]
        if blocks:
            signals = [[x[:, k] for x in rows[b.run * copies : (b.run + 1) * copies]] for b in blocks]
            missed[connector], amplification[connector] = _residual_and_amplification(problem, blocks, signals)
    if not missed:
        return None
    driven = tuple(x.start for x in component.connections if x.start not in assumed)
    return Replay(component.name, driven, tuple(sorted(assumed)), missed, amplification)


def _step(problem: Problem) -> float:
    """Macro step of a component alone [s]."""
    return problem.macro_step * min(2, problem.discretisation.coarsening)


def _job(
    problem: Problem, component: _Component, whole: _Whole, r: int, rng: np.random.Generator | None, assumed: set[str]
) -> Job:
    """A run of the component driven with run r's measurements, disturbed by their noise if there is a generator; what
    nobody measured is added to `assumed`."""
    conditions, blocks = problem.runs[r], problem.samples.of_run(r)
    grid = problem.grid(r, problem.fit_step)
    changes = {k: v for k, v in problem.overrides(r, whole.point).items() if k.split(".", 1)[0] in (component.name, k)}
    inputs = {k: v for k, v in conditions.inputs.items() if k.startswith(f"{component.name}.")}
    cache: dict[str, Smoothed] = {}
    for start, end, factor, offset in component.connections:
        measured = start if start in blocks else whole.rates.get(start)
        if measured is not None and measured in blocks:
            if measured not in cache:
                b = blocks[measured]
                y = b.y + (rng.normal(0.0, b.noise_std, len(b.y)) if rng is not None else 0.0)
                inside = np.clip(grid, b.t[0], b.t[-1])
                cache[measured] = smooth(b.t, y, inside, problem.settings.analysis.replay_kernel)
            sent = cache[measured].value if measured == start else cache[measured].slope
        else:
            assumed.add(start)
            sent = whole.rows[r][:, whole.sources.index(start)]
        inputs[end] = (grid, factor * sent + offset)
    step = _step(problem)
    return Job(component.outputs, problem.grid(r, step)[-1], step, changes, inputs, (component.name,))


def _residual_and_amplification(
    problem: Problem, blocks: Sequence[Block], signals: Sequence[Sequence[np.ndarray]]
) -> tuple[float, float]:
    """Normalised RMS residual of a channel's blocks, and the passed noise over their own.

    signals: of each block the component's output, first undisturbed, then of each disturbed copy.
    """
    energy, count, spread, noise = 0.0, 0, 0.0, 0.0
    for b, rows in zip(blocks, signals, strict=True):
        grid = problem.grid(b.run, _step(problem))
        copies = [b.observe(grid, x) for x in rows]
        passed_variance = np.mean([(c - copies[0]) ** 2 for c in copies[1:]], axis=0)
        passed_variance = np.full(len(b.t), passed_variance.mean())
        noise_std = problem.samples.noise_std[b.place]
        e = (b.y - copies[0]) / np.sqrt(noise_std**2 + passed_variance)
        energy, count = energy + float(e @ e), count + len(e)
        spread, noise = spread + float(passed_variance.sum()), noise + float(np.sum(noise_std**2))
    return float(np.sqrt(energy / count)), float(np.sqrt(spread / noise))
