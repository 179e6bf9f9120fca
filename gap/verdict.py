"""The verdict: causes with calibrated probabilities, "none" and "unknown" among them.

A cause gathers all hypotheses with the same effect ids (a sensor's effect in whichever channel). The raw probabilities
come from `judge`; what calibrates them stands in `calibration.json`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .calibration import Calibration
from .catalogue import VERDICTS
from .judge import Judged

NONE, UNKNOWN = ((name,) for name in VERDICTS)

PLAIN = 0.3
"""Energy [floors squared] that is plainly left: of more, only its share in the gap tells whether it is unknown."""


@dataclass
class Cause:
    """A set of effect ids, its best hypothesis (none for "unknown") and its probability."""

    effects: tuple[str, ...]
    judged: Judged | None
    probability: float
    ambiguous_with: list[tuple[str, ...]]
    told: bool = True
    """Whether more than its probability is told."""


def features(calibration: Calibration, null: float, best: float, readings: int) -> np.ndarray:
    """What "unknown" is judged by, from the energy that the refit's and the best hypothesis' residuals share.

    A constant; the logarithm of what the best leaves beyond chance, with what right models may leave, and from `PLAIN`
    on no more of it; and that of its share in what the refit leaves. So a cause of another law than the library's,
    which leaves floors of a gap of dozens, is no unknown one. How much a flexible model can predict is reported, but
    says less: a vibration is not predictable and yet no noise.
    """
    refit, left = (calibration.beyond(x, readings) for x in (null, best))
    return np.array([1.0, np.log(left / (1.0 + left / PLAIN)), min(0.0, np.log(left / refit))])


def unknown_probability(calibration: Calibration, x: np.ndarray) -> float:
    """Probability that the cause is not in the catalogue."""
    known = 1.0 / (1.0 + np.exp(np.clip(x @ np.array(calibration.unknown), -30, 30)))
    return float(1.0 - calibration.stuck - (1.0 - calibration.stuck - calibration.misjudged) * known)


def causes(judged: Sequence[Judged], calibration: Calibration, x: np.ndarray) -> list[Cause]:
    """All causes, the most probable first; their probabilities add up to 1."""
    low = min(j.score for j in judged)
    raw: dict[tuple[str, ...], float] = {}
    best: dict[tuple[str, ...], Judged] = {}
    for j in sorted(judged, key=lambda j: j.score):
        key = j.hypothesis.ids or NONE
        raw[key] = raw.get(key, 0.0) + float(np.exp(-0.5 * (j.score - low) / calibration.temperature))
        best.setdefault(key, j)
    total = sum(raw.values())
    p_unknown = unknown_probability(calibration, x)
    known = 1.0 - p_unknown
    even = calibration.lapse / len(raw)
    made = [
        Cause(key, best[key], known * ((1.0 - calibration.lapse) * w / total + even), []) for key, w in raw.items()
    ]
    made.append(Cause(UNKNOWN, None, p_unknown, []))
    made.sort(key=lambda c: -c.probability)
    for c in made:
        if c.judged is not None and c.effects != NONE:
            c.ambiguous_with = [
                o.effects
                for o in made
                if o is not c and o.judged is not None and o.effects != NONE
                and o.probability > 0.05 * c.probability and len(o.effects) <= len(c.effects)
            ]  # fmt: skip
    return made
