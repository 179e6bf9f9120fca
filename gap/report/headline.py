"""Section "headline": the verdict, the sentence, and what to know before trusting it."""

from __future__ import annotations

from ..result.numbers import given, listed, percent
from .parts import Data
from .section import SHOWN, Context, Section
from .signals import Signals

VERDICTS = {
    "explained": "Explained",
    "explained_in_part": "Explained in part",
    "no_significant_gap": "No significant gap",
    "unexplained": "Unexplained",
}


def context(data: Data, signals: Signals) -> Context:
    """Badge, headline, cautions."""
    first, rest = split_sentence(data["headline"])
    return {
        "verdict": data["verdict"],
        "badge": VERDICTS.get(data["verdict"], data["verdict"]),
        "campaign": data["campaign"],
        "system": signals.system,
        "first": first,
        "rest": rest,
        "cautions": cautions(data),
        "notes": len(dict.fromkeys(data["warnings"])),
    }


def split_sentence(text: str) -> tuple[str, str]:
    """The first sentence of a text, and the others."""
    first, stop, rest = text.partition(". ")
    return first + stop.rstrip(), rest


def cautions(data: Data) -> list[str]:
    """What lowers the trust in the headline, a sentence each."""
    made = []
    if not data["finished"]:
        where = f", during: {data['unfinished_stage']}" if data["unfinished_stage"] else ""
        made.append(f"The search was ended before it had tried everything{where}; what it would have found is missing.")
    ends = [
        f"{name} ({given(p['value'])})"
        for part in data["budget"]["parts"]
        if part.get("inclusion_probability", 0.0) >= SHOWN.probable
        for name, p in part.get("parameters", {}).items()
        if p["at_bound"]
    ]
    if ends:
        made.append(f"At the end of its range: {listed(ends)}. The effect may be another one, or larger than allowed.")
    moved = [name for name, p in data["calibration"]["moved"].items() if p["at_tolerance"]]
    if moved:
        made.append(f"At the end of its tolerance: {listed(moved)}. Something that is not calibration may hide there.")
    status = data["hypotheses"][0]["status"] if data["hypotheses"] else "converged"
    if status in ("stalled", "unfinished"):
        made.append(f"The fit of the best hypothesis did not come to its end ({status}).")
    if data["verdict"] == "explained" and data["hypotheses"] and data["hypotheses"][0]["probability"] < 0.5:
        best = percent(data["hypotheses"][0]["probability"])
        made.append(f"The best set of effects has a probability of {best} only.")
    return made


SECTION = Section("headline", "", context)
