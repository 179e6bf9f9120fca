"""From evidence to probabilities: of every hypothesis that was looked at, and of every effect to be in the machine.

The probability of an effect is a logistic function of what it is expected to take, over all hypotheses, of what is left
without it, and of what the best of them leaves, fitted on benchmark cases whose truth was known. So an effect that only
comes nearest, where the real cause is in no catalogue, does not look sure.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from ..settings import SCORING
from .probability_calibration import Curvature, ProbabilityCalibration

Ids = tuple[str, ...]
"""Sorted ids of a hypothesis' effects."""


class Evidence(NamedTuple):
    """What is known of a hypothesis: its effects, the structured energy that it leaves on held-out data, its prior, and
    how its fit's cost changes around it."""

    ids: Ids
    energy: float
    """Per reading, in units of its spread."""
    prior: float
    """-2 log of its prior probability."""
    curvature: Curvature = Curvature((), (), ())
    without: Mapping[Ids, float] = {}
    """Energies of sets of its other effects, where these leave more than they seem to: what calibration's biases take
    over of a sensor's bias is no gap that is not there."""


class Posterior(NamedTuple):
    """Probabilities of hypotheses in the order of their evidence, and what inclusion is calibrated from."""

    evidence: tuple[Evidence, ...]
    probability: np.ndarray
    left: float
    """Energy beyond chance that the most probable hypothesis leaves."""
    readings: int
    calibration: ProbabilityCalibration
    """With the discrepancy that a gap of this size brings."""

    def beyond_chance(self, energy: float) -> float:
        """What a residual shares beyond chance, with what right effects of another form miss added."""
        return self.calibration.beyond_chance(energy, self.readings)


def posterior_of(evidence: Sequence[Evidence], calibration: ProbabilityCalibration, readings: int) -> Posterior:
    """Probabilities of all hypotheses; they add up to 1. One of them has no effects.

    Sets of effects are compared by what is more than a right effect of another form may miss; forms of one set by all
    that they leave.
    """
    of_gap = calibration.of_gap(next(e.energy for e in evidence if not e.ids))
    scatter = calibration.form_scatter(min(e.energy for e in evidence), readings)

    def neg2_log(c: ProbabilityCalibration) -> np.ndarray:
        terms = [c.evidence_terms(e.energy, e.curvature, scatter, readings) for e in evidence]
        return np.array([e.prior + sum(t) for e, t in zip(evidence, terms, strict=True)]) / c.temperature

    between, within = neg2_log(of_gap), neg2_log(calibration)
    weight = np.zeros(len(evidence))
    for ids in {e.ids for e in evidence}:
        same = np.array([e.ids == ids for e in evidence])
        among = np.exp(-0.5 * (within[same] - within[same].min()))
        weight[same] = np.exp(-0.5 * (between[same].min() - between.min())) * among / among.sum()
    probability = weight / weight.sum()
    left = of_gap.beyond_chance(evidence[int(np.argmax(probability))].energy, readings)
    return Posterior(tuple(evidence), probability, left, readings, of_gap)


def expected_reduction(posterior: Posterior, members: frozenset[str]) -> float:
    """Share that any of some effects is expected to take of what is left without them: of every hypothesis, by how much
    less it leaves than the best one of its other effects, times its probability."""
    expected = 0.0
    for probability, e in zip(posterior.probability, posterior.evidence, strict=True):
        other_effects = set(e.ids) - members
        if len(other_effects) < len(e.ids):
            subsets = (x for x in posterior.evidence if other_effects.issuperset(x.ids))
            without = min(e.without.get(x.ids, x.energy) for x in subsets)
            share = 1.0 - posterior.beyond_chance(e.energy) / posterior.beyond_chance(without)
            expected += float(probability) * max(0.0, share)
    return min(expected, 1.0)


def inclusion_features(posterior: Posterior, members: frozenset[str]) -> np.ndarray:
    """What the inclusion of any of some effects is judged by.

    A constant; the logarithm of the energy that the best hypothesis leaves; and the log odds of the share that the
    effects are expected to take of what is left without them. (Until November 2026 the last one was their share of the
    whole gap, by which a smaller effect beside a larger one looked unsure however plainly the data showed it.)
    """
    reduction, trace = expected_reduction(posterior, members), SCORING.least_share
    odds = np.log((reduction + trace) / (1.0 - reduction + trace))
    return np.array([1.0, np.log(posterior.left), odds])


def inclusion(posterior: Posterior, members: frozenset[str]) -> float:
    """Calibrated probability that any of some effects is in the machine; 0 where none of them was looked at."""
    if not any(members & set(e.ids) for e in posterior.evidence):
        return 0.0
    odds = inclusion_features(posterior, members) @ np.array(posterior.calibration.inclusion)
    return float(min(1.0 / (1.0 + np.exp(-np.clip(odds, -30.0, 30.0))), SCORING.max_probability))


def apply_doubts(probability: float, doubts: Sequence[float]) -> float:
    """A probability whose odds are multiplied by each doubt (below 1)."""
    odds = probability / max(1.0 - probability, SCORING.min_probability) * float(np.prod(doubts))
    return odds / (1.0 + odds)


def inclusions(posterior: Posterior, groups: Mapping[str, str]) -> tuple[dict[str, float], dict[str, float]]:
    """Calibrated probability of every effect, and of every group; groups: of each effect by its id."""
    effects = {id: inclusion(posterior, frozenset([id])) for id in groups}
    members: dict[str, set[str]] = {}
    for id, group in groups.items():
        members.setdefault(group, set()).add(id)
    of_groups = {
        group: max(inclusion(posterior, frozenset(ids)), *(effects[id] for id in ids))
        for group, ids in members.items()
    }
    return effects, of_groups
