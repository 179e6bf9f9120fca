"""Runs the cases of a sweep that are not yet done, in parallel, and keeps each as soon as it is done."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field
from functools import lru_cache
from math import inf
from pathlib import Path
from typing import Any

import numpy as np

from ...core.errors import CosimError, UsageError
from ...core.files import changed
from ...core.scripts import end_if_loaded_again
from ...core.versions import versions
from ...master.engine.values import TEXT, Signal
from ...master.parallel.pool import Failure, Pool
from ...master.parallel.pool import session as opened
from ...master.parallel.same_file import SameFile
from ...master.simulation import stimuli
from ...master.simulation.manifest import digest as digest_of_file
from ...master.simulation.session import Session
from ...master.simulation.session_warnings import SessionWarnings
from ...master.simulation.stimuli import InputSeries
from ...master.simulation.time_grid import time_grid
from ...master.system.system import System
from .cases import Case
from .metrics import Metric
from .store import Store, digest


@dataclass(frozen=True)
class Settings:
    """What all runs of a sweep share; times in s, None: as the package says."""

    metrics: tuple[Metric, ...]
    step: float | None = None
    stop: float | None = None
    method: str = "gauss-seidel"
    fixed: Mapping[str, Any] = field(default_factory=dict)
    """Parameters that are the same in every case."""
    stimuli: Path | None = None
    """What drives the system's inputs: a file as `cosim-master --stimuli` takes it."""


@dataclass(frozen=True)
class Task:
    """A run and what is measured of it."""

    settings: Settings
    case: Case


def measure(package: str, task: Task) -> dict[str, Any]:
    """{'values': {label: number or None}, 'warnings': what there is to say against it} of a run in this process, or
    {'failed': why}."""
    s = task.settings
    running = opened(package)  # if it cannot be, no case can
    try:
        watch = SessionWarnings(running)
        record = [*watch.record, *dict.fromkeys(m.connector for m in s.metrics)]
        _, stop, step, _ = time_grid(running.structure, s.stop, s.step)
        drives = _driving(running.system, s.stimuli) if s.stimuli is not None else ()
        t, rows = running.run(record, stop, step, {**s.fixed, **task.case}, method=s.method, drives=drives)
        warnings = watch.warnings(t, rows[:, : len(watch.record)], s.method)
    except CosimError as error:
        return {"failed": str(error)}
    with np.errstate(over="ignore", invalid="ignore"):
        values = _values(s.metrics, t, record, rows)
    wrong = [f"{label} is {value:g}" for label, value in values.items() if value is not None and not np.isfinite(value)]
    if wrong:
        return {"failed": f"not finite: {', '.join(wrong)}"}
    return {"values": values, "warnings": warnings}


def _driving(system: System, file: Path) -> tuple[InputSeries, ...]:
    """The series of a table, which is read once for many cases of this process."""
    return _read(system, file, changed(file))


@lru_cache(maxsize=4)
def _read(system: System, file: Path, when: int) -> tuple[InputSeries, ...]:
    return tuple(stimuli.read(file, system))


def _values(metrics: Sequence[Metric], t: np.ndarray, record: list[str], rows: np.ndarray) -> dict[str, float | None]:
    columns = {name: np.ascontiguousarray(rows[:, k]) for k, name in enumerate(record)}
    return {m.label: m.of(t, columns[m.connector]) for m in metrics}


def check(session: Session, case: Case, settings: Settings, others: Iterable[Mapping[str, Any]] = ()) -> None:
    """Raise one-line errors for what is wrong with times, names and values before anything runs.

    others: what may stand in place of some of the case's values.
    """
    start, stop, _, _ = time_grid(session.structure, settings.stop, settings.step)
    if not settings.metrics:
        raise UsageError("no connected output is a number; say with --metric what is to be measured")
    for m in settings.metrics:
        _, signal = session.signal(m.connector)
        if not _is_number(signal):
            raise UsageError(f"--metric {m}: '{m.connector}' is not a single number")
        m.check(start, stop)
    for name in (*settings.fixed, *case):
        for target in session.targets(name):
            if (link := session.system.connections.driver(target)) is not None:
                raise UsageError(f"'{name}' is connected to '{link.source.address}', which counts; it cannot be set")
    drives = stimuli.read(settings.stimuli, session.system) if settings.stimuli is not None else []
    for d in drives:
        name = d.signal.address
        if d.texts:
            raise UsageError(f"{settings.stimuli}: '{name}' takes texts, which cannot be driven in a sweep")
        if any((d.signal.component, d.signal.name) in session.targets(n) for n in (*settings.fixed, *case)):
            raise UsageError(f"'{name}' is driven by {settings.stimuli}, which counts; it cannot be set")
    for other in ({}, *others):
        session.values({**settings.fixed, **case, **other})
    check_distinct(session, [*settings.fixed, *case])


def value_of(session: Session, name: str, text: str) -> Any:
    """What a text says as the value of a parameter of that name; raises one-line errors."""
    values = session.values({name: text})
    component, variable = session.targets(name)[0]
    return values[f"{component}.{variable}" if component else variable]


def check_distinct(session: Session, names: Iterable[str]) -> None:
    """Raise `UsageError` where two names, or one that is there twice, set the same parameter."""
    set_by: dict[tuple[str, str], str] = {}
    for name in names:
        for target in session.targets(name):
            if target in set_by:
                shown = ".".join(filter(None, target))
                raise UsageError(f"'{set_by[target]}' and '{name}' both set '{shown}'; which one is meant?")
            set_by[target] = name


def units(session: Session, names: Iterable[str], metrics: Sequence[Metric]) -> dict[str, str]:
    """Units of parameters, by name, and of metrics, by label, as far as they are known."""
    signals, instances = session.system.units(), session.system.instances
    found: dict[str, str | None] = {}
    for name in names:
        component, variable = session.targets(name)[0]
        found[name] = instances[component].unit_name(variable) if component else signals.get(name)
    found |= {m.label: m.unit(signals.get(session.signal(m.connector)[1].address)) for m in metrics}
    return {name: unit for name, unit in found.items() if unit}


def _is_number(signal: Signal) -> bool:
    """Whether a signal is neither a text nor an array, nor one value of an array, which has no name of its own."""
    return signal.family != TEXT and signal.size == 1 and signal.element is None


def default_metrics(session: Session) -> tuple[Metric, ...]:
    """Last, least and greatest value of every connected output that is a number; the system's own outputs connect."""
    links = (*session.system.links, *session.system.connections.shown)
    sources = dict.fromkeys(
        link.source.address for link in links if link.source.component and _is_number(link.source)
    )  # fmt: skip
    made = []
    for connector in sources:
        made += [Metric(f"{f}({connector})", f, connector) for f in ("final", "min", "max")]
    return tuple(made)


def sweep(
    package: Path,
    cases: Sequence[Case],
    settings: Settings,
    folder: Path,
    executor: Executor | None = None,
    processes: int | None = None,
    progress: Callable[[int, int], None] = lambda done, failed: None,
    again: bool = False,
    limit: float | None = None,
) -> list[dict[str, Any]]:
    """What `measure` gives for every case, in their order; finished cases of the folder are not run again.

    again: run those that failed once more. A run that takes its process with it, or longer than `limit` [s of wall
    time], is a failed case; one that took longer than a smaller limit is run again.
    """
    end_if_loaded_again()
    common = {
        "package": digest_of_file(package), "step": settings.step, "stop": settings.stop, "method": settings.method,
        "fixed": dict(settings.fixed), "metrics": [[m.label, str(m)] for m in settings.metrics],
        "versions": versions(), "entries": "with warnings",
    }  # fmt: skip
    driving = SameFile(settings.stimuli) if settings.stimuli is not None else None
    if driving is not None:
        common["stimuli"] = driving.digest
    names = [digest({**common, "values": case}) for case in cases]
    with Store(folder) as store:
        labels = {m.label for m in settings.metrics}
        kept = [store.get(name) for name in names]
        kept = [None if entry and labels - {*entry.get("values", labels)} else entry for entry in kept]
        kept = [None if entry and "limit" in entry and (limit or inf) > entry["limit"] else entry for entry in kept]
        if again:
            kept = [None if entry and "failed" in entry else entry for entry in kept]
        todo = [k for k, entry in enumerate(kept) if entry is None]
        count = [len(cases) - len(todo), sum("failed" in entry for entry in kept if entry)]
        progress(*count)

        def done(k: int, entry: dict[str, Any] | Failure) -> None:
            if driving is not None:
                driving.check()
            if isinstance(entry, Failure):
                entry = {"failed": entry.reason} | ({"limit": entry.limit} if entry.limit is not None else {})
            store.put(names[k], entry)
            kept[k] = entry
            count[0] += 1
            count[1] += "failed" in entry
            progress(*count)

        with Pool(package, executor, processes, limit=limit) as pool:
            for i, entry in pool.each_surviving(measure, [Task(settings, cases[k]) for k in todo]):
                done(todo[i], entry)
    return [entry for entry in kept if entry is not None]
