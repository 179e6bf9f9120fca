"""Which single further run, or channel, would tell the leading candidates apart best."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...master.pool import Failure, Job
from ..campaign.catalogue import Experiment, Measurable
from ..problem.problem import Problem, matching
from ..selection.greedy import Hypothesis


@dataclass(frozen=True)
class Next:
    """A change of conditions or a channel to add, what it separates, and by how many floors (RMS)."""

    change: dict[str, Any]
    separates: tuple[tuple[str, ...], tuple[str, ...]]
    separation: float


def ranked(
    problem: Problem,
    first: Hypothesis,
    second: Hypothesis,
    experiments: Sequence[Experiment],
    measurables: Sequence[Measurable],
) -> list[Next]:
    """Changes of conditions and further channels, those under which the two fitted hypotheses differ most first."""
    info = problem.runs[0]
    usual = {m.connector: m.noise_std for m in measurables}
    own = {b.connector: float(np.median(problem.obs.floor[b.place])) for b in problem.obs.series}
    own.update({c: usual[c] for c in problem.connectors if c not in own and c in usual})
    extra = {c: noise for c, noise in usual.items() if c not in problem.connectors}
    record = (*(c for c in problem.connectors if c in own), *extra)
    if not record:
        return []
    floor = np.array([own.get(c, extra.get(c, np.nan)) for c in record])
    changes: list[dict[str, Any]] = [{}]
    for e in experiments:
        known = matching(e.parameter, info.values)
        if not known:
            continue
        here = info.values[known[0]]
        used = {r.changes.get(e.parameter, here) for r in problem.runs}
        changes += [{e.parameter: v} for v in e.values if not any(_same(v, u) for u in used)]
    jobs = []
    for change in changes:
        trial = replace(problem, runs=[_changed(problem, change)])
        for h in (first, second):
            jobs.append(
                Job(record, problem.grid(0, problem.coarse)[-1], problem.coarse,
                    trial.changes(0, h.fit.point), info.inputs, method=problem.method)
            )  # fmt: skip
    results = problem.pool.run(jobs)
    separates = (first.ids, second.ids)
    found: list[Next] = []
    count = len(record) - len(extra)
    for i, change in enumerate(changes):
        a, b = results[2 * i], results[2 * i + 1]
        if isinstance(a, Failure) or isinstance(b, Failure):
            continue
        apart = np.sqrt(np.mean(((a - b) / floor) ** 2, axis=0))
        if change:
            found.append(Next(change, separates, float(np.sqrt(np.mean((apart[:count] if count else apart) ** 2)))))
        else:
            found += [
                Next({"channel": c}, separates, float(apart[count + k] / np.sqrt(count + 1)))
                for k, c in enumerate(extra)
            ]
    return sorted(found, key=lambda n: -n.separation)


def _same(a: Any, b: Any) -> bool:
    return isinstance(a, (int, float)) and isinstance(b, (int, float)) and abs(a - b) <= 1e-6 * max(abs(a), abs(b), 1.0)


def _changed(problem: Problem, change: dict[str, Any]) -> Any:
    """The first run under other conditions."""
    info = problem.runs[0]
    values = dict(info.values)
    for name, value in change.items():
        values.update(dict.fromkeys(matching(name, values), value))
    return replace(info, changes={**info.changes, **change}, values=values)
