"""The command `cosim-study sweep`: reads what is asked, runs it, writes table, pictures and summary."""

from __future__ import annotations

import argparse
import json
import re
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Any

from ...core.errors import UsageError, install
from ...core.files import make_folder, writing
from .axes import Axis, parse_axis, settled
from .cases import Case, grid, parse_sample, sample
from .metrics import parse_metric

if TYPE_CHECKING:  # the simulator is imported when it is needed
    from .run import Settings

SUMMARY = "summary.json"

OWN_COLUMNS = ("case", "failed", "warnings")
"""Columns of the table beside axes and metrics."""

LONGEST = 80
"""Letters of a picture's name."""

BETWEEN = 10.0
"""Seconds between two signs of progress in a file."""

SHOWN = 5
"""Failed cases that are listed on the terminal."""


@dataclass(frozen=True)
class _Plan:
    """A sweep that can be run."""

    axes: Sequence[Axis]
    kind: str
    """How the cases are drawn; '' for a grid."""
    cases: Sequence[Case]
    settings: Settings
    units: Mapping[str, str]
    """Units by name of an axis or a metric, where they are known."""

    @property
    def labels(self) -> list[str]:
        """The metrics' columns of the table."""
        return [m.label for m in self.settings.metrics]


def sweep_command(options: argparse.Namespace) -> int:
    """Run the sweep and print what came of it; returns the exit code."""
    plan = _plan(options)
    from ...master.parallel.pool import cluster
    from .run import sweep
    from .table import FILES, rows, write

    folder = options.out or Path("results") / f"sweep_{options.package.stem}"
    make_folder(folder)
    _forget(folder, FILES)
    with cluster(options.dask) as executor, _bar(len(plan.cases), options.quiet) as progress:
        entries = sweep(
            options.package, plan.cases, plan.settings, folder, executor, options.processes, progress,
            options.retry_failed, options.case_time,
        )  # fmt: skip
    table = rows(plan.cases, entries, plan.labels)
    path = write(table, folder, plan.units)
    indices, silent = _indices(plan, table) if plan.kind else ({}, {})
    _summary(folder, options, plan, table, indices, [])
    pictures, undrawn = [], {}
    if not options.no_plots:
        pictures, undrawn = _pictures(folder, plan, table, indices)
        _summary(folder, options, plan, table, indices, pictures)
    made = [path.name, SUMMARY, *pictures]
    if not options.quiet:
        _print(plan, table, indices)
        for what, whys in (("sensitivities", silent), ("picture", undrawn)):
            for why in dict.fromkeys(whys.values()):
                mine = [label for label, w in whys.items() if w == why]
                print(f"no {what} of {mine[0] if len(mine) == 1 else f'{len(mine)} metrics'}: {why}")
        print(f"\n{folder}: {', '.join(made[:6])}{' ...' if len(made) > 6 else ''}")
    if all(row["failed"] for row in table):
        print(f"cosim-study: every case failed, the first: {table[0]['failed']}", file=sys.stderr)
        return 1
    return 0


def _plan(options: argparse.Namespace) -> _Plan:
    """What is asked, checked against the package."""
    axes = [parse_axis(text) for text in options.vary]
    for axis in axes:
        if axis.name in OWN_COLUMNS:
            raise UsageError(f"--vary {axis.name}=...: the table has a column of that name; name its component, too")
    if options.dask is not None and options.case_time is not None:
        raise UsageError("--case-time: a process of a Dask cluster cannot be ended from here; leave one of them out")
    from ...master.algorithms import choose_method
    from ...master.simulation.session import Session
    from ...master.simulation.time_grid import time_grid
    from .run import Settings, check, default_metrics, units, value_of

    metrics = tuple(parse_metric(text) for text in options.metric)
    texts = fixed_values(options.set, axes)
    with Session(options.package) as session:
        value = partial(value_of, session)
        axes = [settled(axis, value) for axis in axes]
        kind, cases = _cases(axes, options)
        fixed = {name: value(name, text) for name, text in texts.items()}
        metrics = metrics or default_metrics(session)
        _, stop, step, _ = time_grid(session.structure, options.stop_time, options.step)
        table_of_inputs = options.stimuli and options.stimuli.resolve()
        method = choose_method(options.method, session.structure.method)
        settings = Settings(metrics, step, stop, method, fixed, table_of_inputs)
        check(session, cases[0], settings, _ends(axes))
        plan = _Plan(axes, kind, cases, settings, units(session, [a.name for a in axes], metrics))
    for name in (*(a.name for a in axes), *OWN_COLUMNS):
        if name in plan.labels:
            raise UsageError(f"--metric {name}=...: the table has a column of that name already")
    if len(set(plan.labels)) < len(plan.labels):
        raise UsageError("two metrics have the same name; give them labels: --metric 'late=at(x, 9)'")
    return plan


def _ends(axes: Sequence[Axis]) -> Iterator[Case]:
    """Every value of a list, and of a range the ends and one within, which is no whole number."""
    for axis in axes:
        for value in axis.values or (axis.low, axis.low + 0.381966 * (axis.high - axis.low), axis.high):
            yield {axis.name: value}


def _cases(axes: Sequence[Axis], options: argparse.Namespace) -> tuple[str, list[Case]]:
    if not options.sample:
        return "", grid(axes)
    kind, number = parse_sample(options.sample)
    cases = sample(axes, kind, number, options.seed)
    for axis in axes:
        drawn = {case[axis.name] for case in cases}
        if left := [str(value) for value in axis.values if value not in drawn]:
            told = f"none of the {len(cases)} cases has {axis.name} = {', '.join(left)}; draw more of them"
            print(f"cosim-study: warning: {told}", file=sys.stderr)
    return kind, cases


def fixed_values(changes: Sequence[str], axes: Sequence[Axis]) -> dict[str, str]:
    """Values of `--set NAME=VALUE` as they are written; none of them may be varied too."""
    from ...master.options import parse_change

    made: dict[str, str] = {}
    for text in changes:
        name, value = parse_change(text)
        if name in {a.name for a in axes}:
            raise UsageError(f"--set {text}: it is varied")
        if name in made:
            raise UsageError(f"--set {text}: it is set already, to {made[name]}")
        made[name] = value
    return made


@contextmanager
def _bar(total: int, quiet: bool) -> Iterator[Callable[[int, int], None]]:
    from tqdm import tqdm

    bar = tqdm(total=total, unit="case", disable=quiet, file=sys.stderr, smoothing=0.05)
    seldom = 0.0 if sys.stderr.isatty() else BETWEEN
    shown = 0.0

    def progress(done: int, failed: int) -> None:
        nonlocal shown
        if bar.n == 0 and done > 1:
            bar.initial = done  # what earlier runs did says nothing about the time that is left
        bar.n = done
        bar.set_postfix_str(f"{failed} failed" if failed else "", refresh=False)
        if done == total or monotonic() - shown >= seldom:
            shown = monotonic()
            bar.refresh()

    with bar:
        yield progress


def _indices(plan: _Plan, table: Sequence[Mapping[str, Any]]) -> tuple[dict[str, Any], dict[str, str]]:
    """Sensitivities by metric, and why there are none of the others."""
    if plan.kind == "saltelli" and not find_spec("SALib"):
        return {}, {"any metric": f"this needs SALib: {install('study')}"}
    from .sensitivity import sensitivities

    found = {
        label: sensitivities(plan.axes, plan.kind, plan.cases, [row[label] for row in table]) for label in plan.labels
    }
    told = {label: entry for label, entry in found.items() if not isinstance(entry, str)}
    return told, {label: entry for label, entry in found.items() if isinstance(entry, str)}


def _forget(folder: Path, tables: Sequence[str]) -> None:
    """Remove table, summary and pictures of an earlier sweep in the folder: if this one is ended, they are not its."""
    for name in tables:
        (folder / name).unlink(missing_ok=True)
    try:
        earlier = json.loads((folder / SUMMARY).read_text(encoding="utf-8")).get("pictures", [])
    except (OSError, ValueError, AttributeError):
        return
    for name in earlier:
        if isinstance(name, str) and name.endswith(".png") and name == Path(name).name:
            (folder / name).unlink(missing_ok=True)
    (folder / SUMMARY).unlink(missing_ok=True)


def _summary(
    folder: Path, options: argparse.Namespace, plan: _Plan, table: Sequence[Mapping[str, Any]],
    indices: Mapping[str, Any], pictures: Sequence[str],
) -> None:  # fmt: skip
    from ...core.versions import versions
    from ...master.simulation.manifest import digest

    settings = plan.settings
    content = {
        "package": str(options.package), "sha256": digest(options.package), "vary": options.vary,
        "sample": options.sample, "seed": options.seed, "set": options.set, "step_s": settings.step,
        "stop_time_s": settings.stop, "method": settings.method,
        "stimuli": str(settings.stimuli) if settings.stimuli is not None else None, "cases": len(table),
        "metrics": {m.label: str(m) for m in settings.metrics}, "units": dict(plan.units), "pictures": list(pictures),
        "failed": [{"case": row["case"], "why": row["failed"]} for row in table if row["failed"]],
        "warnings": [{"case": row["case"], "what": row["warnings"]} for row in table if row["warnings"]],
        "sensitivities": indices, "versions": versions(),
    }  # fmt: skip
    path = folder / SUMMARY
    with writing(path):
        path.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")


def _pictures(
    folder: Path, plan: _Plan, table: Sequence[Mapping[str, Any]], indices: Mapping[str, Any]
) -> tuple[list[str], dict[str, str]]:
    """Names of the pictures, and why there are none of other metrics."""
    from .plots import picture

    made: list[str] = []
    undrawn: dict[str, str] = {}
    for label in plan.labels:
        if all(row[label] is None for row in table):
            continue
        stem = name = re.sub(r"[^\w.-]+", "_", label).strip("_")[:LONGEST] or "metric"
        while f"{name}.png" in made:
            name = f"{stem}_{made.index(f'{name}.png') + 2}"
        name += ".png"
        with writing(folder / name):
            try:
                picture(folder / name, plan.axes, bool(plan.kind), table, label, indices.get(label), plan.units)
            except (ValueError, RuntimeError) as error:  # what matplotlib says of what it cannot draw
                (folder / name).unlink(missing_ok=True)
                undrawn[label] = " ".join(str(error).split())[:200]
                continue
        made.append(name)
    return made, undrawn


def _print(plan: _Plan, table: Sequence[Mapping[str, Any]], indices: Mapping[str, Any]) -> None:
    counts = {kind: [row for row in table if row[kind]] for kind in ("failed", "warnings")}
    print(f"{len(table)} cases, {len(counts['failed'])} failed, {len(counts['warnings'])} with warnings")
    for kind, rows in counts.items():
        for row in rows[:SHOWN]:
            print(f"  case {row['case']} {'failed' if kind == 'failed' else 'warns'}: {row[kind]}")
        if len(rows) > SHOWN:
            print(f"  and {len(rows) - SHOWN} more, see {SUMMARY}")
    width = max(map(len, plan.labels)) + 2
    print(f"{'':<{width}}{'least':>14}{'greatest':>14}  {'unit':<8}{'missing':>9}")
    for label in plan.labels:
        values = [row[label] for row in table if row[label] is not None]
        ends = f"{min(values):>14.6g}{max(values):>14.6g}" if values else f"{'-':>14}{'-':>14}"
        print(f"{label:<{width}}{ends}  {plan.units.get(label, ''):<8}{len(table) - len(values):>9}")
        for kind, by_name in indices.get(label, {}).items():
            shares = sorted(by_name.items(), key=lambda item: -item[1]["value"])
            print(f"{'':<{width}}{kind}: " + ", ".join(f"{n} {v['value']:.2f}" for n, v in shares))
