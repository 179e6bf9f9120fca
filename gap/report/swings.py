"""Section "swings": what moves to and fro by itself, in the measurement and in the models."""

from __future__ import annotations

from ..result.numbers import percent, quantity, short
from .parts import Data
from .section import SHOWN, Context, Section
from .signals import Signals


def context(data: Data, signals: Signals) -> Context | None:
    """A row for every swing, those first that leave most; None where nothing swings."""
    observed = swings(data)
    if not observed:
        return None
    explained = any("explained" in o["swing"] for o in observed)
    rows = []
    for o in observed[: SHOWN.swings]:
        c, x = signals.channel(o["channel"]), o["swing"]
        models = [x.get(k) for k in ("model", "explained")][: 1 + explained]
        rows.append({
            "column": c.column, "run": o["run"], "when": f"{short(x['from'])} to {short(x['to'])} s",
            "measured": described(x, c.factor, c.unit),
            "models": ["–" if m is None else described(m, c.factor, c.unit) for m in models],
        })  # fmt: skip
    share = percent(sum(o["share"] for o in observed))
    return {"rows": rows, "explained": explained, "more": max(0, len(observed) - SHOWN.swings), "share": share}


def swings(data: Data) -> list[Data]:
    """The observations that describe a swing, the largest share of the metric first."""
    return sorted((o for o in data["observations"] if o["as"] == "swing"), key=lambda o: -o["share"])


def described(x: Data, factor: float, unit: str) -> str:
    """Frequency and amplitude, for people; factor: of the unit shown in that of diagnosis.json."""
    amplitude = quantity(x["amplitude"] * factor, unit)
    if not x["swings"]:
        return "does not swing"
    return f"±{amplitude}" + ("" if x["frequency"] is None else f" at {short(x['frequency'])} Hz")


def sentence(data: Data, signals: Signals) -> str:
    """The swing that leaves most, in one sentence; empty where nothing swings."""
    observed = swings(data)
    if not observed:
        return ""
    o = observed[0]
    c, x = signals.channel(o["channel"]), o["swing"]
    clauses = [f"{c.column} swings {described(x, c.factor, c.unit)} in {o['run']}"]
    for key, name in (("model", "calibrated model"), ("explained", "with the effects")):
        if key in x:
            clauses.append(f"{name} {described(x[key], c.factor, c.unit)}")
    return "; ".join(clauses)


SECTION = Section("swings", "What swings by itself", context)
