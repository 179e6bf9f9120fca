"""Section "headline": the verdict, the sentence, and what to know before trusting it."""

from __future__ import annotations

from ..result.numbers import percent
from .parts import Data
from .section import Context, Section
from .signals import Signals

VERDICTS = {
    "explained": "Explained",
    "explained_in_part": "Explained in part",
    "no_significant_gap": "No significant gap",
    "unexplained": "Unexplained",
}


def context(data: Data, signals: Signals) -> Context:
    """Badge, headline, cautions."""
    cautions = data.get("cautions", [])
    first, rest = split_sentence(data["headline"].removesuffix(" ".join(cautions)).rstrip())
    return {
        "verdict": data["verdict"],
        "badge": VERDICTS.get(data["verdict"], data["verdict"]),
        "campaign": data["campaign"],
        "system": signals.system,
        "first": first,
        "rest": rest,
        "cautions": [*cautions, *more_cautions(data)],
        "notes": len(dict.fromkeys(data["warnings"])),
    }


def split_sentence(text: str) -> tuple[str, str]:
    """The first sentence of a text, and the others."""
    first, stop, rest = text.partition(". ")
    return first + stop.rstrip(), rest


def more_cautions(data: Data) -> list[str]:
    """What lowers the trust in the headline and does not end it, a sentence each."""
    sentences = []
    if data["hypotheses"] and data["hypotheses"][0]["status"] == "stalled":
        sentences.append("The fit of the best hypothesis did not come to its end.")
    if data["verdict"] == "explained" and data["hypotheses"] and data["hypotheses"][0]["probability"] < 0.5:
        best = percent(data["hypotheses"][0]["probability"])
        sentences.append(f"The best set of effects has a probability of {best} only.")
    return sentences


SECTION = Section("headline", "", context)
