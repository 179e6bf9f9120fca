"""The verdict: causes with calibrated probabilities, "none" and "unknown" among them.

A cause gathers all hypotheses with the same effect ids (a sensor's effect in whichever channel). The raw probabilities
come from `judge`; what calibrates them stands in `calibration.json`.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..campaign.catalogue import VERDICTS
from .calibration import Calibration
from .evidence import RankedHypothesis

Names = tuple[str, ...]
"""Ids of a cause's effects."""

NONE, UNKNOWN = ((name,) for name in VERDICTS)

PLAIN = 0.3
"""Energy [floors squared] that is plainly left: of more, only its share in the gap tells whether it is unknown."""


@dataclass(frozen=True, eq=False)
class Cause:
    """A set of effect ids, its best hypothesis (none for "unknown") and its probability."""

    effects: tuple[str, ...]
    ranked: RankedHypothesis | None
    probability: float
    ambiguous_with: tuple[tuple[str, ...], ...]
    told: bool = True
    """Whether more than its probability is told."""


def features(calibration: Calibration, baseline: float, best: float, readings: int) -> np.ndarray:
    """What "unknown" is judged by, from the energy that the refit's and the best hypothesis' residuals share.

    A constant; the logarithm of what the best leaves beyond chance, with what right models may leave, and from `PLAIN`
    on no more of it; and that of its share in what the refit leaves. So a cause of another law than the library's,
    which leaves floors of a gap of dozens, is no unknown one. How much a flexible model can predict is reported, but
    says less: a vibration is not predictable and yet no noise.
    """
    refit, left = (calibration.beyond(x, readings) for x in (baseline, best))
    return np.array([1.0, np.log(left / (1.0 + left / PLAIN)), min(0.0, np.log(left / refit))])


def unknown_probability(calibration: Calibration, x: np.ndarray) -> float:
    """Probability that the cause is not in the catalogue."""
    known = 1.0 / (1.0 + np.exp(np.clip(x @ np.array(calibration.unknown), -30, 30)))
    return float(1.0 - calibration.stuck - (1.0 - calibration.stuck - calibration.misjudged) * known)


def probabilities(scored: Iterable[tuple[Names, float]], calibration: Calibration, x: np.ndarray) -> dict[Names, float]:
    """Probability of every cause, the most probable first, from the effects and the score of every hypothesis."""
    scored = list(scored)
    low = min(score for _, score in scored)
    raw: dict[Names, float] = {}
    for ids, score in scored:
        raw[ids or NONE] = raw.get(ids or NONE, 0.0) + float(np.exp(-0.5 * (score - low) / calibration.temperature))
    total, lapse = sum(raw.values()), calibration.lapse
    p_unknown = unknown_probability(calibration, x)
    made = {key: (1.0 - p_unknown) * ((1.0 - lapse) * w / total + lapse / len(raw)) for key, w in raw.items()}
    (top, first), *others = sorted({**made, UNKNOWN: p_unknown}.items(), key=lambda item: -item[1])
    sure = calibration.confident(first, others[0][1])
    scale = (1.0 - sure) / (1.0 - first) if first < 1.0 else 0.0
    return {top: sure, **{key: p * scale for key, p in others}}


def causes(ranked: Sequence[RankedHypothesis], calibration: Calibration, x: np.ndarray) -> list[Cause]:
    """All causes, the most probable first; their probabilities add up to 1."""
    best: dict[Names, RankedHypothesis] = {}
    for r in sorted(ranked, key=lambda r: r.neg2_log_posterior):
        best.setdefault(r.hypothesis.ids or NONE, r)
    told = probabilities(((r.hypothesis.ids, r.neg2_log_posterior) for r in ranked), calibration, x)
    made = [Cause(key, best.get(key), p, ()) for key, p in told.items()]
    return [replace(c, ambiguous_with=_ambiguous(c, made)) for c in made]


def _ambiguous(c: Cause, made: Sequence[Cause]) -> tuple[Names, ...]:
    """The causes that a campaign can hardly tell from one."""
    if c.ranked is None or c.effects == NONE:
        return ()
    return tuple(
        o.effects for o in made
        if o is not c and o.ranked is not None and o.effects != NONE
        and o.probability > 0.05 * c.probability and len(o.effects) <= len(c.effects)
    )  # fmt: skip
