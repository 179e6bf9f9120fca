"""Sections "effects" and "hypotheses": every effect with more than a trace, and the sets that were compared."""

from __future__ import annotations

from ..result.numbers import multiple, percent
from .budget import parameter
from .parts import Data
from .section import SHOWN, Context, Section
from .signals import Signals

STATUS = {
    "converged": "",
    "at_bound": "a parameter is at the end of its range",
    "at_tolerance": "a base parameter is at the end of its tolerance",
    "stalled": "the fit did not come to its end",
    "unfinished": "the fit was cut off",
}


def effects(data: Data, signals: Signals) -> Context | None:
    """Inclusion probability and share of every effect; those with no more than a trace are counted."""
    entries = data["effects"]
    if not entries:
        return None
    texts = {e: t for p in data["budget"]["parts"] for e, t in (p.get("text") or {}).items()}
    shown = [e for e in entries if max(entries[e]["inclusion_probability"], entries[e]["share"]) > SHOWN.trace]
    shown.sort(key=lambda e: (-entries[e]["inclusion_probability"], -entries[e]["share"], e))
    rows = [
        {
            "id": e, "text": texts.get(e, ""), "group": str(entries[e]["group"]).replace("_", " "),
            "inclusion": percent(entries[e]["inclusion_probability"]), "share": percent(max(0.0, entries[e]["share"])),
            "width": 100.0 * min(1.0, entries[e]["inclusion_probability"]),
            "share_width": 100.0 * min(1.0, max(0.0, entries[e]["share"])),
        }
        for e in shown
    ]  # fmt: skip
    return {"rows": rows, "rest": len(entries) - len(shown), "trace": percent(SHOWN.trace), "count": len(entries)}


def hypotheses(data: Data, signals: Signals) -> Context | None:
    """The most probable sets of effects; the rest are counted."""
    entries = data["hypotheses"]
    if not entries:
        return None
    rows = [
        {
            "effects": [_with_form(e, h.get("forms") or {}) for e in h["effects"]],
            "probability": percent(h["probability"]), "width": 100.0 * min(1.0, h["probability"]),
            "left": multiple(h["left"]),
            "status": STATUS.get(h["status"], h["status"]),
            "parameters": [parameter(n, p, signals) for n, p in (h.get("parameters") or {}).items()],
        }
        for h in entries[: SHOWN.hypotheses]
    ]  # fmt: skip
    rest = entries[SHOWN.hypotheses :]
    return {"rows": rows, "rest": len(rest), "rest_probability": percent(sum(h["probability"] for h in rest))}


def _with_form(effect: str, forms: Data) -> str:
    return f"{effect} [{forms[effect]}]" if effect in forms else effect


EFFECTS = Section("effects", "Effects of the catalogue", effects)
HYPOTHESES = Section("hypotheses", "Sets of effects that were compared", hypotheses)
