"""Runs a sweep and keeps what came of it: the table, sensitivities, pictures, summary.json."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from ...core.console import json_text
from ...core.display_units import DisplayUnits, display_units
from ...core.errors import UsageError, did_you_mean, install
from ...core.figures import in_notebooks
from ...core.files import make_folder, replacing, write_together
from ...core.owned import read_object, refuse_others
from .request import SweepPlan, SweepRequest
from .shown import Shown, shown_in
from .store import CASES_FILE, beginning, holds_cases

SUMMARY = "summary.json"

LONGEST = 80
"""Letters of a picture's name."""


@dataclass(frozen=True)
class Sweep:
    """What came of a sweep.

    table: a row a case, with its values, its metrics, why it failed and what warns of it; sensitivities: by metric;
    silent, undrawn: why there are none, or no picture, of other metrics.
    """

    folder: Path
    plan: SweepPlan
    table: Sequence[Mapping[str, Any]]
    file: Path
    """The table on disk."""
    sensitivities: Mapping[str, Any]
    silent: Mapping[str, str]
    pictures: Sequence[str]
    undrawn: Mapping[str, str]
    summary: Mapping[str, Any]
    """The content of summary.json."""

    def __repr__(self) -> str:
        """In a notebook or at a prompt."""
        failed = sum(bool(row["failed"]) for row in self.table)
        axes = ", ".join(axis.name for axis in self.plan.axes)
        return f"Sweep({str(self.folder)!r}, {len(self.table)} cases over {axes}, {failed} failed)"

    def frame(self) -> Any:
        """The table as a pandas frame; units by column, as far as they are known, are in its `attrs["units"]`."""
        import pandas as pd

        made = pd.DataFrame(list(self.table)).set_index("case")
        made.attrs["units"] = dict(self.plan.units)
        return made

    def plot(self, metric: str, units: str | None = None) -> Any:
        """A matplotlib figure of a metric over what is varied; units: what `--units` takes."""
        from .plots import figure_of

        plan = self.plan
        if metric not in plan.labels:
            raise UsageError(f"the sweep has no metric '{metric}'{did_you_mean(metric, plan.labels)}")
        indices = self.sensitivities.get(metric)
        shown = shown_in(plan, self.table, display_units(units))
        return in_notebooks(figure_of(shown.axes, bool(plan.kind), shown.table, metric, indices, shown.units))


def run_sweep(
    request: SweepRequest, plan: SweepPlan, folder: Path, progress: Callable[[int, int], None], draws: bool = True,
    display: DisplayUnits | None = None,
) -> Sweep:  # fmt: skip
    """Run the cases that have not been run in that folder, and write everything into it.

    progress: gets the numbers of cases that are done and that have failed; draws: whether pictures are drawn, and
    display: in which units (default: the user's).
    """
    from ...master.parallel.pool import cluster
    from .run import sweep
    from .table import FILES, rows, write

    make_folder(folder)
    _check_folder(folder, FILES)
    with cluster(request.dask) as executor:
        entries = sweep(
            request.package, plan.cases, plan.settings, folder, executor, request.processes, progress,
            request.retry_failed, request.case_time,
        )  # fmt: skip
    table = rows(plan.cases, entries, plan.labels)
    path = write(table, folder, plan.units)
    stale = [*_earlier_pictures(folder), *(name for name in FILES if name != path.name)]
    indices, silent = _indices(plan, table) if plan.kind else ({}, {})
    told = _summary(folder, request, plan, table, indices, [])
    pictures: list[str] = []
    undrawn: dict[str, str] = {}
    if draws:
        pictures, undrawn = _pictures(folder, shown_in(plan, table, display or display_units(None)), plan, indices)
        told = _summary(folder, request, plan, table, indices, pictures)
    for name in stale:
        if name not in pictures:
            (folder / name).unlink(missing_ok=True)
    return Sweep(folder, plan, table, path, indices, silent, pictures, undrawn, told)


def _check_folder(folder: Path, tables: Sequence[str]) -> None:
    """Raise `OutputError` for a folder with results that no sweep has made: it would replace them."""
    made, cases = read_object(folder / SUMMARY), beginning(folder / CASES_FILE)
    has_summary = isinstance(made.get("vary"), list) and isinstance(made.get("metrics"), dict)
    if not has_summary and not holds_cases(cases):  # its summary comes last, and may be missing where it was killed
        refuse_others(folder, [SUMMARY, *tables, *([CASES_FILE] if cases else [])], "a sweep")


def _indices(plan: SweepPlan, table: Sequence[Mapping[str, Any]]) -> tuple[dict[str, Any], dict[str, str]]:
    """Sensitivities by metric, and why there are none of the others."""
    if plan.kind == "saltelli" and not find_spec("SALib"):
        return {}, {"any metric": f"this needs SALib: {install('study')}"}
    from .sensitivity import sensitivities

    found = {
        label: sensitivities(plan.axes, plan.kind, plan.cases, [row[label] for row in table]) for label in plan.labels
    }
    told = {label: entry for label, entry in found.items() if not isinstance(entry, str)}
    return told, {label: entry for label, entry in found.items() if isinstance(entry, str)}


def _earlier_pictures(folder: Path) -> list[str]:
    """Names of the pictures of an earlier sweep in the folder."""
    try:
        earlier = list(read_object(folder / SUMMARY).get("pictures", []))
    except TypeError:
        return []
    return [n for n in earlier if isinstance(n, str) and n.endswith(".png") and n == Path(n).name]


def _summary(
    folder: Path, request: SweepRequest, plan: SweepPlan, table: Sequence[Mapping[str, Any]],
    indices: Mapping[str, Any], pictures: Sequence[str],
) -> dict[str, Any]:  # fmt: skip
    from ...core.versions import versions
    from ...master.simulation.manifest import digest

    settings = plan.settings
    content = {
        "package": str(request.package), "sha256": digest(request.package), "vary": list(request.vary),
        "sample": request.sample, "seed": request.seed, "set": list(request.fixed), "step_s": settings.step,
        "stop_time_s": settings.stop, "method": settings.method,
        "stimuli": str(settings.stimuli) if settings.stimuli is not None else None, "cases": len(table),
        "metrics": {m.label: str(m) for m in settings.metrics}, "units": dict(plan.units), "pictures": list(pictures),
        "failed": [{"case": row["case"], "why": row["failed"]} for row in table if row["failed"]],
        "warnings": [{"case": row["case"], "what": row["warnings"]} for row in table if row["warnings"]],
        "sensitivities": indices, "versions": versions(),
    }  # fmt: skip
    write_together(folder, {SUMMARY: json_text(content) + "\n"})
    return content


def _pictures(
    folder: Path, shown: Shown, plan: SweepPlan, indices: Mapping[str, Any]
) -> tuple[list[str], dict[str, str]]:
    """Names of the pictures, and why there are none of other metrics."""
    from .plots import picture

    made: list[str] = []
    undrawn: dict[str, str] = {}
    for label in plan.labels:
        if all(row[label] is None for row in shown.table):
            continue
        stem = name = re.sub(r"[^\w.-]+", "_", label).strip("_")[:LONGEST] or "metric"
        while f"{name}.png" in made:
            name = f"{stem}_{made.index(f'{name}.png') + 2}"
        name += ".png"
        try:
            with replacing(folder / name) as part:
                picture(part, shown.axes, bool(plan.kind), shown.table, label, indices.get(label), shown.units)
        except (ValueError, RuntimeError) as error:  # what matplotlib says of what it cannot draw
            undrawn[label] = " ".join(str(error).split())[:200]
            continue
        made.append(name)
    return made, undrawn
