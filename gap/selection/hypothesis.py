"""A hypothesis: a set of effects with its fit."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Protocol, TypeVar

import numpy as np

from ..estimation.fit import Fit
from ..problem.parameters import EffectCandidate
from ..problem.problem import Problem
from .calibration import chance

READINGS = 150.0
"""Readings that count in the penalised deviance of the greedy search."""


def penalised_deviance(left: float, penalty: float) -> float:
    """What fits are ranked by until they are judged, the less the better.

    left: the normalised RMS that is left; penalty: what the parameters cost.
    """
    return READINGS * 2.0 * float(np.log(max(left, 1e-9))) + penalty


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """A set of candidates with its fit; no candidates: the baseline."""

    candidates: tuple[EffectCandidate, ...]
    fit: Fit
    quick: bool = False
    """The fit is a first look, with another fit's derivatives."""
    finished: bool = False
    """The fit has been carried to its end, and its derivatives serve for larger moves."""

    @property
    def label(self) -> str:
        """For people."""
        return " + ".join(c.label for c in self.candidates) or "refit of the base parameters"

    @property
    def penalised_deviance(self) -> float:
        """That of its fit."""
        return penalised_deviance(self.fit.rms, self.fit.penalty())

    @property
    def ids(self) -> tuple[str, ...]:
        """Sorted effect ids."""
        return tuple(sorted(c.id for c in self.candidates))


def is_adequate(problem: Problem, at: Fit) -> bool:
    """Whether a fit leaves nothing to explain."""
    settings, observations = problem.settings.evidence, problem.observations
    limit = settings.adequate + chance(len(observations), settings.chance)
    return observations.structured_energy(at.residual) < limit


class Labelled(Protocol):
    """A hypothesis, or a start of one."""

    @property
    def label(self) -> str:
        """For people."""


L = TypeVar("L", bound=Labelled)


def best_of_each(found: Iterable[L], cost: Callable[[L], float]) -> list[L]:
    """The one of each label that costs least, the cheapest first."""
    unique: dict[str, L] = {}
    for item in sorted(found, key=cost):
        unique.setdefault(item.label, item)
    return list(unique.values())
