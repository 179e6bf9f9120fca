"""Section "left": what nothing in the catalogue explains, its character, and what comes nearest."""

from __future__ import annotations

from ..result.channels import leading_channel
from ..result.numbers import listed, multiple, percent, percents, pretty
from .parts import Data
from .section import SHOWN, Context, Section
from .signals import Dependence, Signals
from .svg import scatter


def context(data: Data, signals: Signals) -> Context | None:
    """The unexplained parts and the residual against what it varies with; None where neither is there."""
    parts = [p for p in data["budget"]["parts"] if p["kind"] == "unexplained"]
    if not parts and not signals.dependences:
        return None
    return {
        "parts": [
            {
                "share": percent(p["share"]), "interval": percents(p["ci95"]), "rms": multiple(p["rms"]),
                "character": p["character"], "nearest": listed(list(p["nearest"]), word="or"),
            }
            for p in parts
        ],
        "figures": [_figure(d, signals) for d in signals.dependences],
        "little": data["budget"]["explained"] < SHOWN.little,
        "main": signals.channel(leading_channel(data["budget"])).column,
    }  # fmt: skip


def _figure(d: Dependence, signals: Signals) -> Context:
    c = signals.channel(d.channel)
    x = f"{d.x_name} [{pretty(d.x_unit) or '–'}]"
    return {
        "column": c.column, "x": d.x_name, "share": percent(d.share),
        "clear": d.share > SHOWN.clear_dependence,
        "svg": scatter(d, x, f"residual of {c.column} [{pretty(c.unit) or '–'}]"),
    }  # fmt: skip


SECTION = Section("left", "What is left", context)
