"""What a page tells, as JSON: plain data that its script draws; every name and text of a stranger is only data."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from math import isfinite
from pathlib import Path
from typing import Any

from ...core.display_units import DisplayUnits
from ..simulation.answers import Answers
from ..simulation.trust import trust
from .record import RunRecord
from .series import Series

PANELS, LINES = 4, 4
"""Most panels and lines in each that are shown at first; a person chooses more."""

USER, FMU = "command line", "FMU"
ORDER = (USER, "mapping", "package", "connection", FMU)
"""Where parameters are from, what the user has changed first."""


def page_content(record: RunRecord, series: Series, display: DisplayUnits) -> dict[str, Any]:
    """The page of one run."""
    largest = dict(zip(series.names, series.largest(), strict=True))
    listed = signals(record, series.names, largest, display, series.items)
    return {
        "title": title_of(record),
        "runs": [{"name": title_of(record), **series.content()}],
        "about": about(record, series),
        "signals": listed,
        "chosen": first_choice(record, series, listed),
        "sentences": sentences(record, display),
        "trust": trust_line(record),
        "error": record.summary.get("error"),
        "warnings": [str(text) for text in record.listed("warnings")],
        "bonds": list(_bonds(record)),
        "components": record.components,
        "connections": record.connections,
        "parameters": parameters(record, display),
        "comparison": None,
    }


def title_of(record: RunRecord) -> str:
    """The package's name, else the file's."""
    package = record.summary.get("package")
    return Path(package).stem if isinstance(package, str) and package else record.file.stem


def about(record: RunRecord, series: Series) -> list[str]:
    """Facts of the run in a few words each."""
    told, facts = record.summary, [record.name]
    if told.get("status") not in (None, "ok"):
        facts.append(f"status: {told['status']}")
    found = [told.get(key) for key in ("start_time_s", "stop_time_s", "step_s", "steps")]
    numbers = [value for value in found if isinstance(value, int | float)]
    if len(numbers) == len(found):
        start, stop, step, steps = numbers
        facts.append(f"{stop - start:g} s in {steps} steps of {step:g} s")
    facts += [str(told["method"])] if told.get("method") else []
    return [*facts, f"{series.points.rows:,} rows of {len(series.names)} signals"]


def sentences(record: RunRecord, display: DisplayUnits) -> list[str]:
    """What the run answers, in the units that are asked for where the summary has what that takes."""
    told = record.table("answers")
    try:
        return Answers.of_summary(told).texts(display)
    except (KeyError, TypeError, AttributeError):
        found = told.get("sentences")
        return [str(text) for text in found] if isinstance(found, list) else []


def trust_line(record: RunRecord) -> str:
    """How far to trust the run; '' where no summary tells, or the run had to stop."""
    try:
        return trust(record.summary, bool(record.connections), "below") if record.summary.get("error") is None else ""
    except (KeyError, TypeError):
        return ""


def signals(
    record: RunRecord, names: Sequence[str], largest: Mapping[str, float], display: DisplayUnits,
    items: Mapping[str, Sequence[str]] | None = None,
) -> list[dict[str, Any]]:  # fmt: skip
    """A signal each: name, component, unit of the file, and how it is shown: shown = factor * value + offset."""
    types, driven = record.table("types"), {end for _, end in record.connections}
    texts = record.table("descriptions")
    made = []
    for place, name in enumerate(names):
        unit, component = record.unit(name), record.component_of(name)
        kind = "text" if name in (items or {}) else str(types.get(name, "float"))
        shown, factor, offset = display.of(unit, float(largest[name])) if kind == "float" else (unit, 1.0, 0.0)
        made.append({
            "name": name, "component": component, "label": name[len(component) + 1 :] if component else name,
            "unit": unit, "shown": shown, "factor": factor, "offset": offset, "kind": kind,
            "places": [place],
            "driven": name in driven or name.partition("[")[0] in driven,
            "text": str(texts.get(name) or ""),
        })  # fmt: skip
    return made


def first_choice(record: RunRecord, series: Series, listed: Sequence[Mapping[str, Any]]) -> list[str]:
    """What is shown at first: what the package says, else what drives something, what the system gives, else what
    changes; a few of each unit."""
    told = record.table("answers").get("signals")
    if isinstance(told, list) and (named := [s["name"] for name in told for s in listed if s["name"] == name]):
        return named
    drives = {start for start, _ in record.connections}
    given = {end for _, end in record.connections if not record.component_of(end)}
    changing = [s for s, changes in zip(listed, series.changes(), strict=True) if changes]
    wanted = [s for s in changing if s["name"] in drives or s["name"] in given]
    free = [s for s in changing if "[" not in s["name"] and not s["driven"]]
    panels: dict[str, list[str]] = {}
    for s in wanted or free or changing or listed:
        key = s["shown"] if s["kind"] == "float" else s["name"]
        if key in panels or len(panels) < PANELS:
            panels.setdefault(key, []).append(s["name"])
    return [name for group in panels.values() for name in group[:LINES]]


def _bonds(record: RunRecord) -> Iterator[dict[str, Any]]:
    """Power bonds, the worst first."""
    told = [bond for bond in record.listed("coupling") if isinstance(bond, Mapping)]
    shares = {id(bond): bond.get("relative") for bond in told}
    for bond in sorted(told, key=lambda bond: -share if isinstance(share := shares[id(bond)], float) else 0.0):
        yield {
            "name": bond.get("bond"), "residual": bond.get("residual_energy_J"),
            "exchanged": bond.get("exchanged_energy_J"), "relative": bond.get("relative"),
            "omega_h": bond.get("omega_h"), "damping": bond.get("numerical_damping"),
        }  # fmt: skip


def parameters(record: RunRecord, display: DisplayUnits) -> list[dict[str, Any]]:
    """The parameters in force, the user's first, then the package's; `own` is the value in the FMU's unit."""
    told = [(name, p) for name, p in record.table("parameters").items() if isinstance(p, Mapping)]
    made = [
        {
            "name": name, **shown_value(p.get("value"), str(p.get("unit") or ""), display),
            "from": str(p.get("from") or ""), "where": str(p.get("where") or ""), "changed": p.get("from") == USER,
            "text": str(p.get("description") or ""),
        }
        for name, p in told
    ]  # fmt: skip
    return sorted(made, key=lambda p: ORDER.index(p["from"]) if p["from"] in ORDER else len(ORDER))


def shown_value(value: Any, unit: str, display: DisplayUnits) -> dict[str, str]:
    """A value as texts: `value` and `unit` as shown, `own` as the file has it."""
    own = f"{_text(value)} {unit}".strip()
    if isinstance(value, float) and unit and isfinite(value):
        unit, factor, offset = display.of(unit, abs(value))
        value = factor * value + offset
    return {"value": _text(value), "unit": "" if unit == "1" else unit, "own": own}


def _text(value: Any) -> str:
    if value is None:
        return "?"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, list):
        return " ".join(_text(v) for v in value[:8]) + (f" … ({len(value)})" if len(value) > 8 else "")
    return f"{value:.9g}" if isinstance(value, float) else str(value)
