"""From evidence to probabilities: of every hypothesis that was looked at, and of every effect to be in the machine.

The probability of an effect is a logistic function of the share of the gap that it is expected to explain, over all
hypotheses, and of what the best of them leaves, fitted on benchmark cases whose truth was known. So an effect
that only comes nearest, where the real cause is in no catalogue, does not look sure.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from ..settings import PosteriorSettings
from .calibration import Calibration, Curvature

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


class Posterior(NamedTuple):
    """Probabilities of hypotheses in the order of their evidence, and what inclusion is calibrated from."""

    evidence: tuple[Evidence, ...]
    neg2_log: np.ndarray
    probability: np.ndarray
    baseline: float
    """Energy beyond chance that the refit of the base parameters leaves."""
    left: float
    """Energy beyond chance that the best hypothesis leaves."""


def weigh(evidence: Sequence[Evidence], calibration: Calibration, readings: int) -> Posterior:
    """Probabilities of all hypotheses; they add up to 1. One of them has no effects."""
    energies = np.array([e.energy for e in evidence])
    least = calibration.beyond_chance(float(energies.min()), readings) - calibration.discrepancy
    scatter = calibration.scatter * least
    neg2 = np.array([e.prior + sum(calibration.judge(e.energy, e.curvature, scatter, readings)) for e in evidence])
    weight = np.exp(-0.5 * (neg2 - neg2.min()) / calibration.temperature)
    baseline = next(e.energy for e in evidence if not e.ids)
    best = evidence[int(np.argmin(neg2))].energy
    return Posterior(
        tuple(evidence), neg2, weight / weight.sum(), calibration.beyond_chance(baseline, readings),
        calibration.beyond_chance(best, readings),
    )  # fmt: skip


def expected_share(posterior: Posterior, members: frozenset[str]) -> float:
    """Share of what the refit leaves that any of some effects is expected to explain: of every hypothesis, what it
    leaves less than the best one of its other effects, times its probability."""
    expected = 0.0
    for probability, e in zip(posterior.probability, posterior.evidence, strict=True):
        others = set(e.ids) - members
        if len(others) < len(e.ids):
            without = min(x.energy for x in posterior.evidence if others.issuperset(x.ids))
            expected += float(probability) * max(0.0, without - e.energy)
    return expected / posterior.baseline


def inclusion_features(posterior: Posterior, members: frozenset[str]) -> np.ndarray:
    """What the inclusion of any of some effects is judged by.

    A constant; the logarithm of the share of what the refit leaves that the best hypothesis leaves, too; and of the
    share that the effects are expected to explain. What they explain beyond the best hypothesis without them, which
    stood in its place, is nothing for a right effect that two others imitate together.
    """
    left = min(0.0, float(np.log(posterior.left / posterior.baseline)))
    return np.array([1.0, left, np.log(expected_share(posterior, members) + PosteriorSettings.trace)])


def inclusion(posterior: Posterior, members: frozenset[str], calibration: Calibration) -> float:
    """Calibrated probability that any of some effects is in the machine; 0 where none of them was looked at."""
    if not any(members & set(e.ids) for e in posterior.evidence):
        return 0.0
    odds = inclusion_features(posterior, members) @ np.array(calibration.inclusion)
    return float(min(1.0 / (1.0 + np.exp(-np.clip(odds, -30.0, 30.0))), PosteriorSettings.surest))


def temper(probability: float, doubts: Sequence[float]) -> float:
    """A probability whose odds are multiplied by each doubt (below 1)."""
    odds = probability / max(1.0 - probability, PosteriorSettings.least) * float(np.prod(doubts))
    return odds / (1.0 + odds)


def inclusions(
    posterior: Posterior, groups: Mapping[str, str], calibration: Calibration
) -> tuple[dict[str, float], dict[str, float]]:
    """Calibrated probability of every effect, and of every group; groups: of each effect by its id."""
    effects = {id: inclusion(posterior, frozenset([id]), calibration) for id in groups}
    members: dict[str, set[str]] = {}
    for id, group in groups.items():
        members.setdefault(group, set()).add(id)
    of_groups = {
        group: max(inclusion(posterior, frozenset(ids), calibration), *(effects[id] for id in ids))
        for group, ids in members.items()
    }
    return effects, of_groups
