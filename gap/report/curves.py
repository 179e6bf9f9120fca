"""Section "curves": what no formula fits, drawn with its band."""

from __future__ import annotations

from ..result.numbers import percent, pretty
from .parts import Data
from .section import Context, Section
from .signals import Signals
from .svg import curve


def context(data: Data, signals: Signals) -> Context | None:
    """A drawing for each curve; None where there is none."""
    drawable = [c for c in data["curves"] if c["points"]]
    if not drawable:
        return None
    return {"figures": [_figure(c) for c in drawable]}


def _figure(c: Data) -> Context:
    """points and plain: [[x, y], ...]; band95: [[low, high], ...] at the same x."""
    x, y = f"[{pretty(c['x']) or '–'}]", f"[{pretty(c['y']) or '–'}]"
    drawn = curve(c["points"], c["band95"], c["plain"], x, y)
    return {"what": c["what"], "effect": c["effect"], "plain": bool(c["plain"]), "svg": drawn,
            "probability": percent(c["probability"])}  # fmt: skip


SECTION = Section("curves", "Curves that were fitted freely", context)
