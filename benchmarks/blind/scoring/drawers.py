"""Into which of four drawers a wrong case goes, by what the oracle found when it fitted the true set."""

from __future__ import annotations

from collections.abc import Sequence

from .names import Names, same_effect, same_set
from .outcome import Outcome
from .true import UNKNOWN

SEARCH, FORM, EVIDENCE, NOT_IDENTIFIABLE = "search", "form", "evidence", "not identifiable"
OUTSIDE, FAILED, OPEN = "outside the catalogue", "failed", "oracle not asked"
DRAWERS = (SEARCH, FORM, EVIDENCE, NOT_IDENTIFIABLE)

NEEDED = 10.0
"""Difference of penalised deviances (minus two log likelihoods) that tells two sets apart: odds of 150 to 1."""

MUCH = 1.1
"""RMS, in noise, above which the true set in the catalogue's form leaves more than the noise."""

AS_GOOD = 1.05
"""Times what the oracle leaves that a hypothesis may leave to count as the true set found."""


def drawer(o: Outcome) -> str:
    """The drawer of a wrong case, or why there is none; empty for a right one.

    search: the true set fits better and was not found; form: in the catalogue's form it leaves more than the noise, and
    fits no better than what was said, or nothing was said for that; evidence: it was found and fits better, or more was
    said than the data ask for; not identifiable: with and without what was missed the machine differs by less than the
    evidence that is needed.
    """
    if o.said.failed:
        return FAILED
    if o.exact:
        return ""
    if o.true.kind == UNKNOWN:
        return OUTSIDE
    if "true" not in o.oracle or "said" not in o.oracle:
        return OPEN
    true, best = o.oracle["true"], o.oracle["said"]
    gain = float(best["deviance"]) - float(true["deviance"])
    much = float(true["left"]) > MUCH
    if gain > NEEDED:
        if not _found(o, float(true["left"])):
            return SEARCH
        return FORM if much and not o.said.statements else EVIDENCE
    if gain < -NEEDED or much:
        return FORM if o.true.effects else EVIDENCE
    return EVIDENCE if _more(true["effects"], best["effects"]) else NOT_IDENTIFIABLE


def _found(o: Outcome, left: float) -> bool:
    """Whether a hypothesis is the true set and leaves no more than the oracle."""
    names: Names = tuple(e.name for e in o.true.effects)
    return any(same_set(names, h.effects) and h.left <= AS_GOOD * left for h in o.said.hypotheses)


def _more(true: Sequence[str], said: Sequence[str]) -> bool:
    """Whether all true effects are said, and others."""
    return len(said) > len(true) and all(any(same_effect(t, s) for s in said) for t in true)
