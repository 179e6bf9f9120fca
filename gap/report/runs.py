"""Sections "runs" and "events": every run by itself, and measured moments."""

from __future__ import annotations

from ..result.numbers import multiple, pretty, short, stated_value
from .bar import boxes, colours
from .parts import Data, pieces
from .section import Context, Section
from .signals import Signals

MODELS = ("delivered", "calibrated", "explained")


def runs(data: Data, signals: Signals) -> Context | None:
    """Deviations of each run as multiples of the noise, with the conditions of the run."""
    per_run = data["budget"]["per_run"]
    conditions = {r.name: r for r in signals.runs}
    names = [*(r.name for r in signals.runs), *(n for n in per_run if n not in conditions)]
    if not names:
        return None
    colour = colours(pieces(data["budget"], data["budget"]["parts"]))
    rows = []
    for name in names:
        run, levels = conditions.get(name), per_run.get(name)
        stated = run.conditions if run else ()
        texts = [" ".join(x for x in (c.name, stated_value(c.value), pretty(c.unit)) if x) for c in stated]
        row: Context = {"name": name, "held_out": run.held_out if run else False, "conditions": texts, "boxes": ()}
        row["stop"] = f"{short(run.stop)} s" if run else "–"
        row["cells"] = [multiple(levels[k]) if levels else "–" for k in MODELS]
        foretold = levels.get("foretold_by_others") if levels else None
        row["foretold"] = multiple(foretold) if foretold is not None else ""
        if levels:
            row["boxes"] = boxes(pieces(levels, levels.get("parts", ())), colour, 100.0)
        rows.append(row)
    return {"rows": rows, "foretold": any(r["foretold"] for r in rows), "held_out": any(r["held_out"] for r in rows)}


def events(data: Data, signals: Signals) -> Context | None:
    """Measured moments beside those of the models, and differences between runs; None without such."""
    moments = data.get("events") or []
    if not moments:
        return None
    return {
        "rows": [{"run": e["run"], "event": e["event"], **_times(e)} for e in moments],
        "contrasts": [
            {"runs": list(c["runs"]), "event": c["event"], "changed": c["changed"], **_times(c)}
            for c in data.get("contrasts") or []
        ],
    }


def _times(e: Data) -> Context:
    std = e["std"] or 1e-300
    off = [abs(e["measured"] - e[k]) / std for k in MODELS]
    measured = " ".join(x for x in (str(e.get("limit") or ""), short(e["measured"], 4)) if x)
    return {
        "measured": measured, "std": short(e["std"], 2),
        "models": [{"time": short(e[k], 4), "off": multiple(x)} for k, x in zip(MODELS, off, strict=True)],
    }  # fmt: skip


RUNS = Section("runs", "Run by run", runs)
EVENTS = Section("events", "Measured moments", events)
