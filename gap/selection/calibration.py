"""The few numbers that turn evidence into probabilities, fitted on benchmark cases whose truth was known.

`benchmarks/blind/calibrate.py` makes `calibration.json`, from cases that are never those of a reported score.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

import numpy as np

from ..settings import EvidenceSettings


def chance(readings: int, deviations: float = EvidenceSettings.chance) -> float:
    """Energy per reading that normalised residuals of so many readings may share when nothing but noise is left."""
    return float(deviations / np.sqrt(readings))


@dataclass(frozen=True)
class Calibration:
    """How much the evidence counts. Energies are per reading, of normalised residuals."""

    independent: float
    """Independent pieces that the residual of a wrong model counts for."""
    discrepancy: float
    """Energy in which models differ that are both right for what they are about: no amount of data makes such a
    difference a cause."""
    scatter: float
    """Times the energy that the best model leaves which counts as scatter of the model's form: near equals share the
    probability instead of one taking all."""
    temperature: float
    """-2 log posterior is divided by it."""
    inclusion: tuple[float, ...]
    """Weights of the features of an effect's inclusion (`posterior.inclusion_features`), the constant first."""

    def deviance(self, energy: float, scatter: float, readings: int) -> float:
        """What a residual's structured energy counts for as evidence, the less the better.

        What right models miss, what chance shares of so many readings, and the scatter of the model's form are added,
        so that less is no evidence.
        """
        return min(self.independent, readings) * float(np.log(energy + self.discrepancy + chance(readings) + scatter))

    def beyond_chance(self, energy: float, readings: int) -> float:
        """What a residual shares beyond chance, with what right models miss added."""
        return max(0.0, energy - chance(readings)) + self.discrepancy

    @staticmethod
    def load() -> Calibration:
        """The calibration that is shipped."""
        return _shipped()


@cache
def _shipped() -> Calibration:
    """Read once: every ranking asks for it."""
    data = json.loads(files(__package__).joinpath("calibration.json").read_text(encoding="utf-8"))
    inclusion = tuple(map(float, data.pop("inclusion")))
    return Calibration(inclusion=inclusion, **{key: float(value) for key, value in data.items()})
