"""Which single further run, or channel, would tell the leading candidates apart best."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...master.pool import Failure, Job
from ..problem.problem import Problem, RunConditions, matching
from ..selection.hypothesis import Hypothesis


@dataclass(frozen=True)
class NextMeasurement:
    """A change of conditions or a channel to add, what it separates, and by how much (normalised RMS)."""

    change: dict[str, Any]
    separates: tuple[tuple[str, ...], tuple[str, ...]]
    separation: float


def rank_measurements(problem: Problem, first: Hypothesis, second: Hypothesis) -> list[NextMeasurement]:
    """Changes of conditions and further channels, those under which the two fitted hypotheses differ most first."""
    usual = {m.connector: m.noise_std for m in problem.catalogue.measurables}
    noise_std = problem.samples.noise_std
    own = {b.connector: float(np.median(noise_std[b.place])) for b in problem.samples.series}
    own.update({c: usual[c] for c in problem.connectors if c not in own and c in usual})
    extra = {c: noise for c, noise in usual.items() if c not in problem.connectors}
    record = (*(c for c in problem.connectors if c in own), *extra)
    if not record:
        return []
    noise = np.array([own.get(c, extra.get(c, np.nan)) for c in record])
    changes = _changes(problem)
    results = _simulated(problem, changes, (first, second), record)
    separates = (first.ids, second.ids)
    found: list[NextMeasurement] = []
    count = len(record) - len(extra)
    for i, change in enumerate(changes):
        a, b = results[2 * i], results[2 * i + 1]
        if isinstance(a, Failure) or isinstance(b, Failure):
            continue
        apart = np.sqrt(np.mean(((a - b) / noise) ** 2, axis=0))
        if change:
            separation = float(np.sqrt(np.mean((apart[:count] if count else apart) ** 2)))
            found.append(NextMeasurement(change, separates, separation))
        else:
            found += [
                NextMeasurement({"channel": c}, separates, float(apart[count + k] / np.sqrt(count + 1)))
                for k, c in enumerate(extra)
            ]
    return sorted(found, key=lambda n: -n.separation)


def _changes(problem: Problem) -> list[dict[str, Any]]:
    """No change, and every condition that the catalogue lists and no run has had."""
    values = problem.runs[0].values
    changes: list[dict[str, Any]] = [{}]
    for e in problem.catalogue.experiments:
        known = matching(e.parameter, values)
        if not known:
            continue
        here = values[known[0]]
        used = {r.changes.get(e.parameter, here) for r in problem.runs}
        changes += [{e.parameter: v} for v in e.values if not any(_same(v, u) for u in used)]
    return changes


def _simulated(
    problem: Problem, changes: Sequence[dict[str, Any]], hypotheses: Sequence[Hypothesis], record: tuple[str, ...]
) -> list[np.ndarray | Failure]:
    """The first run under each change with each hypothesis."""
    step, method, inputs = problem.fit_step, problem.discretisation.method, problem.runs[0].inputs
    jobs = []
    for change in changes:
        trial = replace(problem, runs=(_changed(problem, change),))
        for h in hypotheses:
            stop = problem.grid(0, step)[-1]
            jobs.append(Job(record, stop, step, trial.changes(0, h.fit.point), inputs, method=method))
    return problem.simulator.simulate(jobs)


def _same(a: Any, b: Any) -> bool:
    return isinstance(a, (int, float)) and isinstance(b, (int, float)) and abs(a - b) <= 1e-6 * max(abs(a), abs(b), 1.0)


def _changed(problem: Problem, change: dict[str, Any]) -> RunConditions:
    """The first run under other conditions."""
    info = problem.runs[0]
    values = dict(info.values)
    for name, value in change.items():
        values.update(dict.fromkeys(matching(name, values), value))
    return replace(info, changes={**info.changes, **change}, values=values)
