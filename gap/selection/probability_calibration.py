"""The few numbers that turn evidence into probabilities, fitted on benchmark cases whose truth was known.

`benchmarks/blind/calibrate.py` makes `probability_calibration.json`, from cases that are never those of a reported
score.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from functools import cache
from importlib.resources import files
from typing import NamedTuple

import numpy as np

from ..settings import SCORING


def chance(readings: int) -> float:
    """Energy per reading that normalised residuals of so many readings may share when nothing but noise is left."""
    return float(SCORING.chance / np.sqrt(readings))


class Curvature(NamedTuple):
    """How the cost of a fit changes around it, along directions (k,) that do not mix."""

    energy: tuple[float, ...]
    """Energy per reading that is added one prior standard deviation away."""
    place: tuple[float, ...]
    """Where the fit stands, in prior standard deviations from what is stated."""
    shared: tuple[float, ...]
    """Energies of the directions of base parameters and nuisances alone, which every hypothesis has."""


class EvidenceTerms(NamedTuple):
    """-2 log posterior of a hypothesis but for its prior: what is left, what the parameters' values cost, and what they
    cost for the volume of their prior that the data rule out."""

    fit: float
    penalty: float
    occam: float


@dataclass(frozen=True)
class ProbabilityCalibration:
    """How much the evidence counts. Energies are per reading, of normalised residuals."""

    independent: float
    """Independent pieces that the residual of a wrong model counts for."""
    discrepancy: float
    """Energy in which models differ that are both right for what they are about: no amount of data makes such a
    difference a cause."""
    form_error: float
    """Share of what it does (rms) that a right effect misses because the machine has it in another form."""
    scatter: float
    """Times the energy that the best model leaves which counts as scatter of the model's form: near equals share the
    probability instead of one taking all."""
    temperature: float
    """-2 log posterior is divided by it."""
    inclusion: tuple[float, ...]
    """Weights of the features of an effect's inclusion (`posterior.inclusion_features`), the constant first."""

    def evidence_terms(self, energy: float, curvature: Curvature, scatter: float, readings: int) -> EvidenceTerms:
        """What a fit counts for as evidence, the less the better; energy: the structured one that it leaves.

        What right models miss, what chance shares of so many readings, and the scatter of the model's form are added to
        it, so that less is no evidence. The parameters count where that evidence and their priors together are best,
        which is nearer to what is stated than the fit, for there every reading counts.
        """
        pieces, added_energy = min(self.independent, readings), self.discrepancy + chance(readings) + scatter
        rise, place = np.array(curvature.energy), np.array(curvature.place)
        moved_energy = 0.0
        for _ in range(SCORING.moving_rounds):
            shrinkage = 1.0 / (1.0 + pieces / (energy + moved_energy + added_energy) * rise)
            moved_energy = float(rise @ (place * shrinkage) ** 2)
        weight = pieces / (energy + moved_energy + added_energy)
        ruled_out = np.log1p(weight * rise).sum() - np.log1p(weight * np.array(curvature.shared)).sum()
        penalty = float(((place * (1.0 - shrinkage)) ** 2).sum())
        return EvidenceTerms(pieces * float(np.log(energy + moved_energy + added_energy)), penalty, float(ruled_out))

    def of_gap(self, baseline: float) -> ProbabilityCalibration:
        """The same where calibration leaves so much energy: what right effects of another form miss of it has no
        cause, either."""
        return replace(self, discrepancy=self.discrepancy + self.form_error**2 * baseline)

    def beyond_chance(self, energy: float, readings: int) -> float:
        """What a residual shares beyond chance, with what right models miss added."""
        return max(0.0, energy - chance(readings)) + self.discrepancy

    def form_scatter(self, least: float, readings: int) -> float:
        """What counts as scatter of the model's form where the best hypothesis leaves that energy."""
        return self.scatter * (self.beyond_chance(least, readings) - self.discrepancy)

    @staticmethod
    def load() -> ProbabilityCalibration:
        """The calibration that is shipped."""
        return _shipped()


@cache
def _shipped() -> ProbabilityCalibration:
    """Read once: every ranking asks for it."""
    data = json.loads(files(__package__).joinpath("probability_calibration.json").read_text(encoding="utf-8"))
    inclusion = tuple(map(float, data.pop("inclusion")))
    return ProbabilityCalibration(inclusion=inclusion, **{key: float(value) for key, value in data.items()})
