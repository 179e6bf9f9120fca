"""A hypothesis: a set of effects with its fit."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..estimation.fit import Fit
from ..problem.parameters import EffectCandidate
from ..problem.problem import Problem
from ..settings import SCORING
from .probability_calibration import chance


def penalised_deviance(rms_left: float, penalty: float) -> float:
    """What fits are ranked by until they are judged, the less the better.

    rms_left: the normalised RMS that is left; penalty: what the parameters cost.
    """
    return SCORING.deviance_readings * 2.0 * float(np.log(max(rms_left, 1e-9))) + penalty


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """A set of candidates with its fit; no candidates: the baseline."""

    candidates: tuple[EffectCandidate, ...]
    fit: Fit
    quick: bool = False
    """Not polished: its derivatives or its correction may be from elsewhere."""

    @property
    def label(self) -> str:
        """For people."""
        return " + ".join(c.name for c in self.candidates) or "refit of the base parameters"

    @property
    def penalised_deviance(self) -> float:
        """That of its fit."""
        return penalised_deviance(self.fit.rms, self.fit.penalty())

    @property
    def labels(self) -> frozenset[str]:
        """Of its effects."""
        return frozenset(c.label for c in self.candidates)

    @property
    def key(self) -> frozenset[str]:
        """Its effects' labels, and the forms that they are in: what it says beyond the base parameters."""
        return frozenset(x for c in self.candidates for x in c.key)

    @property
    def ids(self) -> tuple[str, ...]:
        """Sorted effect ids."""
        return tuple(sorted(c.id for c in self.candidates))


def is_adequate(problem: Problem, at: Fit) -> bool:
    """Whether a fit leaves nothing to explain."""
    settings, observations = problem.settings.evidence, problem.observations
    limit = settings.adequate + chance(len(observations))
    return observations.structured_energy(at.residual) < limit
