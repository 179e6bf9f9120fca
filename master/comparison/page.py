"""The page of a comparison: that of a run, with all runs over each other and a panel for each signal."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import isfinite
from typing import Any

from ...core.display_units import DisplayUnits
from ..page.content import first_choice, sentences, shown_value, signals, title_of
from ..page.series import VALUES, Codes, Series, series_of
from .compare import Comparison, Run, parameters_apart
from .report import remarks

PANELS = 5
"""Most signals that are shown at first, those that differ most."""


def comparison_content(comparisons: Sequence[Comparison], display: DisplayUnits) -> dict[str, Any]:
    """The content of the page; all comparisons are with the same first run."""
    runs = [comparisons[0].a, *(c.b for c in comparisons)]
    codes: Codes = {}
    made = [series_of(run.record, iter([run.table]), VALUES // len(runs), codes) for run in runs]
    listed = _signals(runs, made, display)
    worst: dict[str, float] = {}
    for d in (d for c in comparisons for d in c.differences if d.differs and not d.remark):
        worst[d.name] = max(worst.get(d.name, 0.0), 0.0 if d.is_level else d.relative)
    return {
        "title": "Comparison of " + " with ".join(run.label for run in runs),
        "runs": [{"name": run.label, **series.content()} for run, series in zip(runs, made, strict=True)],
        "about": [f"{run.label}: {title_of(run.record)}, {len(run.times):,} rows" for run in runs],
        "signals": listed,
        "chosen": _chosen(runs, made, listed, worst)[:PANELS],
        "sentences": [f"{run.label}: {text}" for run in runs for text in sentences(run.record, display)],
        "trust": "", "error": None, "warnings": [], "bonds": [], "components": [], "connections": [],
        "parameters": [
            {
                "name": name, "unit": "", "from": "", "where": "", "changed": False,
                "values": ["–" if value is None else _shown(value, unit, display) for value, unit in values],
            }
            for name, values in parameters_apart(runs).items()
        ],
        "comparison": {
            "remarks": [f"{text}." for c in comparisons for text in _told(c)],
            "rows": [row for c in comparisons for row in _rows(c)],
        },
    }  # fmt: skip


def _chosen(
    runs: Sequence[Run], made: Sequence[Series], listed: Sequence[dict[str, Any]], worst: Mapping[str, float]
) -> list[str]:
    """What the package shows first where that differs, then what differs most; else what a run's own page shows."""
    usual = first_choice(runs[0].record, made[0], listed[: len(made[0].names)])
    asked = runs[0].record.table("answers").get("signals")
    first = [name for name in usual if isinstance(asked, list) and name in worst]
    return list(dict.fromkeys([*first, *sorted(worst, key=lambda name: -worst[name])])) or usual


def _told(comparison: Comparison) -> list[str]:
    off = sum(d.differs for d in comparison.differences)
    count = len(comparison.differences)
    verdict = f"{off} of {count} signals differ" if off else f"All {count} common signals are the same"
    return [f"{comparison.a.label} and {comparison.b.label}: {verdict}", *remarks(comparison)]


def _shown(value: Any, unit: str, display: DisplayUnits) -> str:
    shown = shown_value(value, unit, display)
    return f"{shown['value']} {shown['unit']}".rstrip()


def _signals(runs: Sequence[Run], made: Sequence[Series], display: DisplayUnits) -> list[dict[str, Any]]:
    """All signals that any run has, each in the units of the first that has it."""
    largest: dict[str, float] = {}
    for series in made:
        for name, size in zip(series.names, series.largest(), strict=True):
            largest[name] = max(largest.get(name, 0.0), float(size))
    found: dict[str, dict[str, Any]] = {}
    for run, series in zip(runs, made, strict=True):
        new = [name for name in series.names if name not in found]
        found |= {s["name"]: s for s in signals(run.record, new, largest, display, series.items)}
    for name, signal in found.items():
        signal["places"] = [series.names.index(name) if name in series.names else None for series in made]
    return list(found.values())


def _rows(comparison: Comparison) -> list[dict[str, Any]]:
    """The differences, in the units of the files."""
    rows = []
    for d in comparison.differences:
        told = replace(d, most=d.most or d.first)
        rows.append({
            "name": d.name, "run": comparison.b.label, "differs": d.differs,
            "difference": d.difference if isfinite(d.difference) and not d.remark else None,
            "relative": d.relative if isfinite(d.relative) and not d.remark else None,
            "at": told.most.time if told.most else None, "first": d.first.time if d.first else None,
        })  # fmt: skip
    return rows
