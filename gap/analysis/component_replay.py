"""Each FMU alone, driven with what was measured at its inputs: is the fault inside it or does it only pass it on?

A measured signal is smoothed with a Gaussian kernel of `KERNEL` seconds before it drives a stiff model; a rate that was
not measured is the derivative of the smoothed signal. What the noise that is left does to the outputs is found with
disturbed copies and added to the floor. Inputs that nobody measured keep what the whole model says.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...master.pool import Failure, Job
from ...master.session import Session
from ..problem.noise import rms
from ..problem.problem import Point, Problem

KERNEL = 0.05
"""Standard deviation of the smoothing kernel [s]."""

COPIES = 3
"""Disturbed copies from which the propagated noise is estimated."""


@dataclass(frozen=True)
class Replay:
    """An FMU alone: its RMS residual by connector in its own floors, and how much noise the inputs pass on."""

    component: str
    driven_by: tuple[str, ...]
    assumed: tuple[str, ...]
    rms: dict[str, float]
    amplification: dict[str, float]
    """Propagated noise over the channel's own floor."""


def smooth(t: np.ndarray, y: np.ndarray, at: np.ndarray, kernel: float = KERNEL) -> tuple[np.ndarray, np.ndarray]:
    """Value and slope at times `at` of a local straight line with Gaussian weights; t increasing [s]."""
    value, slope = np.empty(len(at)), np.empty(len(at))
    low, high = np.searchsorted(t, at - 4 * kernel), np.searchsorted(t, at + 4 * kernel, side="right")
    for i, x in enumerate(at):
        a, b = low[i], high[i]
        if b - a < 3:
            a, b = max(0, a - 2), min(len(t), b + 2)
        d = t[a:b] - x
        w = np.exp(-0.5 * (d / kernel) ** 2) + 1e-9
        s0, s1, s2 = w.sum(), w @ d, w @ (d * d)
        m0, m1 = w @ y[a:b], w @ (d * y[a:b])
        det = s0 * s2 - s1 * s1
        value[i], slope[i] = (s2 * m0 - s1 * m1) / det, (s0 * m1 - s1 * m0) / det
    return value, slope


def replays(problem: Problem, point: Point) -> list[Replay]:
    """A replay of every component whose inputs were measured at least in part, at the given point."""
    with Session(problem.campaign.system) as session:
        links = [(".".join(link.start), ".".join(link.end)) for link in session.system.links]
        components = list(session.system.slaves)
    if len(components) < 2:
        return []
    sources = tuple(dict.fromkeys(start for start, _ in links))
    whole = problem.rows([point], problem.coarse, sources, keep=False)[0]
    if whole is None:
        return []
    rates = dict(rate_pairs(sources, whole[0], problem.coarse))
    made = []
    for component in components:
        mine = [(start, end) for start, end in links if end.startswith(f"{component}.")]
        outputs = tuple(c for c in problem.connectors if c.startswith(f"{component}."))
        measured = {b.connector for b in problem.obs.series}
        varying = [(s, e) for s, e in mine if any(np.ptp(w[:, sources.index(s)]) > 0 for w in whole)]
        driven = [s for s, _ in varying if s in measured or rates.get(s) in measured]
        if not varying or not outputs or len(driven) < len(varying):
            continue
        one = _replay(problem, component, mine, outputs, sources, whole, rates, point)
        if one is not None:
            made.append(one)
    return made


def rate_pairs(names: Sequence[str], rows: np.ndarray, step: float) -> list[tuple[str, str]]:
    """(a, b) where signal a is the rate of signal b, found in rows (n, names) of the model itself."""
    found = []
    for i, a in enumerate(names):
        for j, b in enumerate(names):
            v, dx = rows[:, i], np.gradient(rows[:, j], step)
            if i != j and np.ptp(v) > 0 and np.ptp(dx) > 0 and rms(v - dx) < 0.05 * np.std(v):
                found.append((a, b))
    return found


def _replay(
    problem: Problem,
    component: str,
    mine: Sequence[tuple[str, str]],
    outputs: tuple[str, ...],
    sources: tuple[str, ...],
    whole: list[np.ndarray],
    rates: Mapping[str, str],
    point: Point,
) -> Replay | None:
    """Runs the component alone; mine: (source, input) of its connections, whole: the sources' rows in all runs."""
    rng = np.random.default_rng(0)
    obs, step = problem.obs, problem.fine * min(2, problem.factor)
    jobs, assumed = [], set()
    for r, info in enumerate(problem.runs):
        blocks = obs.of_run(r)
        grid = problem.grid(r, problem.coarse)
        changes = {k: v for k, v in problem.changes(r, point).items() if k.split(".", 1)[0] in (component, k)}
        for copy in range(1 + COPIES):
            inputs = {k: v for k, v in info.inputs.items() if k.startswith(f"{component}.")}
            cache: dict[str, tuple[np.ndarray, np.ndarray]] = {}
            for start, end in mine:
                known = start if start in blocks else rates.get(start)
                if known in blocks:
                    if known not in cache:
                        b = blocks[known]
                        y = b.y + (rng.normal(0.0, b.floor, len(b.y)) if copy else 0.0)
                        inside = np.clip(grid, b.t[0], b.t[-1])
                        cache[known] = smooth(b.t, y, inside)
                    inputs[end] = (grid, cache[known][0 if known == start else 1])
                else:
                    assumed.add(start)
                    inputs[end] = (grid, whole[r][:, sources.index(start)])
            stop = problem.grid(r, step)[-1]
            jobs.append(Job(outputs, stop, step, changes, inputs, (component,)))
    results = problem.pool.run(jobs)
    if any(isinstance(x, Failure) for x in results):
        return None
    missed, amplification = {}, {}
    for k, connector in enumerate(outputs):
        energy, count, spread_, floor_ = 0.0, 0, 0.0, 0.0
        for b in obs.series:
            if b.connector != connector:
                continue
            grid = problem.grid(b.run, step)
            copies = [
                np.interp(b.t, grid, results[b.run * (1 + COPIES) + c][:, k]) for c in range(1 + COPIES)
            ]
            passed = np.mean([(c - copies[0]) ** 2 for c in copies[1:]], axis=0)
            passed = np.full(len(b.t), passed.mean())
            floor = obs.floor[b.place]
            e = (b.y - copies[0]) / np.sqrt(floor**2 + passed)
            energy, count = energy + float(e @ e), count + len(e)
            spread_, floor_ = spread_ + float(passed.sum()), floor_ + float(np.sum(floor**2))
        if count:
            missed[connector] = float(np.sqrt(energy / count))
            amplification[connector] = float(np.sqrt(spread_ / floor_))
    if not missed:
        return None
    driven = tuple(s for s, _ in mine if s not in assumed)
    return Replay(component, driven, tuple(sorted(assumed)), missed, amplification)
