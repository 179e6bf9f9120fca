"""Sections "method" and "notes": how it was found, how exact the numbers are, warnings."""

from __future__ import annotations

from ..result.numbers import duration, listed, multiple, percent, percents, short
from .glossary import GLOSSARY
from .parts import Data
from .section import Context, Section
from .signals import Signals


def method(data: Data, signals: Signals) -> Context:
    """Numerics, reduction, time, words."""
    numerics, timing, reduction = data["numerics"], data["timing"], data["reduction"]
    error = numerics["step_error"]
    return {
        "metric": data["budget"]["metric"],
        "method": numerics["method"], "step": _milliseconds(numerics["step"]),
        "fit_step": _milliseconds(numerics["fit_step"]), "step_error": "" if error is None else multiple(error),
        "extrapolated": bool(numerics.get("richardson_order", 0)),
        "reduction": percent(reduction["value"]), "reduction_interval": percents(reduction["ci95"]),
        "how": reduction["how"], "simulations": timing["simulations"], "wall": duration(timing["wall_s"]),
        "stages": [{"name": n, "time": duration(s)} for n, s in timing["stages"].items()],
        "otherwise": _not_samples(data, signals), "glossary": GLOSSARY,
    }  # fmt: skip


def notes(data: Data, signals: Signals) -> Context | None:
    """Warnings, each once."""
    warnings = list(dict.fromkeys(data["warnings"]))
    return {"notes": warnings} if warnings else None


def _milliseconds(seconds: float) -> str:
    return f"{short(1000.0 * seconds)}\u00a0ms"


def _not_samples(data: Data, signals: Signals) -> list[str]:
    """Channels that were not compared sample by sample, and how."""
    ways: dict[str, list[str]] = {}
    for o in data["observations"]:
        if o["as"] == "swing":
            ways.setdefault(signals.channel(o["channel"]).column, []).append(o["run"])
    by = "while it swings, by its course, amplitude and frequency"
    return [f"{column} in {listed(list(dict.fromkeys(runs)))}, {by}" for column, runs in ways.items()]


METHOD = Section("method", "Numerics and method", method)
NOTES = Section("notes", "Warnings", notes)
