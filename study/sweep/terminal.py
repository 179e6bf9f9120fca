"""The command `cosim-study sweep`: reads what is asked, runs it, writes table, pictures and summary."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from time import monotonic
from typing import Any

from ...core.console import conclude
from ...core.display_units import DisplayUnits, display_units
from .request import SweepRequest, make_plan
from .result import SUMMARY, Sweep, run_sweep
from .shown import Shown, shown_in

BETWEEN = 10.0
"""Seconds between two signs of progress in a file."""

SHOWN = 5
"""Failed cases that are listed on the terminal."""


def sweep_command(options: argparse.Namespace) -> int:
    """Run the sweep and print what came of it; returns the exit code."""
    request = SweepRequest(
        options.package, tuple(options.vary), tuple(options.metric), tuple(options.set), options.sample, options.seed,
        options.step, options.stop_time, options.method, options.stimuli, options.processes, options.dask,
        options.case_time, options.retry_failed,
    )  # fmt: skip
    display = display_units(options.units)
    plan = make_plan(request)
    with _bar(len(plan.cases), options.quiet or options.json) as progress:
        found = run_sweep(request, plan, options.out or request.usual_folder, progress, not options.no_plots, display)
    conclude(options, lambda: _content(found), lambda: _lines(found, display))
    if all(row["failed"] for row in found.table):
        print(f"cosim-study: every case failed, the first: {found.table[0]['failed']}", file=sys.stderr)
        return 1
    return 0


@contextmanager
def _bar(total: int, quiet: bool) -> Iterator[Callable[[int, int], None]]:
    from tqdm import tqdm

    bar: Any = None
    seldom = 0.0 if sys.stderr.isatty() else BETWEEN
    shown = 0.0

    def progress(done: int, failed: int) -> None:
        nonlocal shown, bar
        if bar is None:  # only once a run may begin: what is wrong with the request is one line
            bar = tqdm(total=total, unit="case", disable=quiet, file=sys.stderr, smoothing=0.05)
        if bar.n == 0 and done > 1:
            bar.initial = done  # what earlier runs did says nothing about the time that is left
        bar.n = done
        bar.set_postfix_str(f"{failed} failed" if failed else "", refresh=False)
        if done == total or monotonic() - shown >= seldom:
            shown = monotonic()
            bar.refresh()

    try:
        yield progress
    finally:
        if bar is not None:
            bar.close()


def _content(found: Sweep) -> dict[str, Any]:
    """For programs: summary.json, the table and what could not be computed or drawn."""
    files = [found.file.name, SUMMARY, *found.pictures]
    return {
        "folder": found.folder, "files": files, "summary": found.summary, "table": list(found.table),
        "no_sensitivities": dict(found.silent), "no_pictures": dict(found.undrawn),
    }  # fmt: skip


def _lines(found: Sweep, display: DisplayUnits) -> Iterator[str]:
    shown = shown_in(found.plan, found.table, display)
    yield from _table(found.plan.labels, shown, found.sensitivities)
    for what, whys in (("sensitivities", found.silent), ("picture", found.undrawn)):
        for why in dict.fromkeys(whys.values()):
            mine = [label for label, w in whys.items() if w == why]
            yield f"no {what} of {mine[0] if len(mine) == 1 else f'{len(mine)} metrics'}: {why}"
    made = [found.file.name, SUMMARY, *found.pictures]
    yield f"\n{found.folder}: {', '.join(made[:6])}{' ...' if len(made) > 6 else ''}"


def _table(labels: Sequence[str], shown: Shown, indices: Mapping[str, Any]) -> Iterator[str]:
    table = shown.table
    counts = {kind: [row for row in table if row[kind]] for kind in ("failed", "warnings")}
    yield f"{len(table)} cases, {len(counts['failed'])} failed, {len(counts['warnings'])} with warnings"
    for kind, rows in counts.items():
        for row in rows[:SHOWN]:
            yield f"  case {row['case']} {'failed' if kind == 'failed' else 'warns'}: {row[kind]}"
        if len(rows) > SHOWN:
            yield f"  and {len(rows) - SHOWN} more, see {SUMMARY}"
    width = max(map(len, labels)) + 2
    yield f"{'':<{width}}{'least':>14}{'greatest':>14}  {'unit':<8}{'missing':>9}"
    for label in labels:
        values = [row[label] for row in table if row[label] is not None]
        ends = f"{min(values):>14.6g}{max(values):>14.6g}" if values else f"{'-':>14}{'-':>14}"
        yield f"{label:<{width}}{ends}  {shown.units.get(label, ''):<8}{len(table) - len(values):>9}"
        for kind, by_name in indices.get(label, {}).items():
            shares = sorted(by_name.items(), key=lambda item: -item[1]["value"])
            yield f"{'':<{width}}{kind}: " + ", ".join(f"{n} {v['value']:.2f}" for n, v in shares)
