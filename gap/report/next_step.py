"""Section "next": the measurement that would tell most."""

from __future__ import annotations

from typing import Any

from ..result.numbers import listed, multiple, percent, pretty, stated_value
from .parts import Data
from .section import SHOWN, Context, Section
from .signals import Signals


def context(data: Data, signals: Signals) -> Context:
    """The next experiment and the next channel."""
    first, channel = data["next_experiment"], data["next_channel"]
    return {
        "steps": [_step(x, signals) for x in (first, channel if channel != first else None) if x],
        "verdict": data["verdict"],
    }


def action(step: Data, signals: Signals) -> str:
    """What to do, with units."""
    changes: dict[str, Any] = dict(step["change"])
    channel = changes.pop("channel", None)
    actions = [f"measure {channel} as well"] if channel else []
    if changes:
        values = [
            " ".join(x for x in (k, "=", stated_value(v), pretty(signals.unit_of(k))) if x) for k, v in changes.items()
        ]
        actions.append(f"one more run with {listed(values)}")
    return " and ".join(actions)


def separation(step: Data) -> str:
    """Which hypotheses the measurement tells apart, and how well."""
    size = step["expected_separation"]
    how = "clearly apart" if size > SHOWN.apart else "apart" if size > 1.0 else "hardly apart"
    sets = listed([" + ".join(e) or "no effect" for e in step["separates"]])
    sure = step["expected_probability"]
    sure_text = f"the right one of the two would be {percent(sure['then'])} sure, now it is {percent(sure['now'])}"
    return (
        f"{sets} would then differ by {multiple(size)} times the noise (RMS) that no refit closes: {how}; {sure_text}"
    )


def _step(step: Data, signals: Signals) -> Context:
    text = action(step, signals)
    return {"action": text[:1].upper() + text[1:], "separation": separation(step)}


SECTION = Section("next", "What to measure next", context)
