"""The few numbers that turn scores into probabilities, fitted on benchmark cases whose truth was known.

`benchmarks/blind/calibrate.py` makes `calibration.json`, from cases that are never those of a reported score.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from importlib.resources import files

import numpy as np

CHANCE = 1.5
"""Standard deviations of the energy that noise shares by chance which are no evidence."""


def chance(readings: int) -> float:
    """Energy that the residuals of so many readings may share, in floors squared, when nothing but noise is left."""
    return float(CHANCE / np.sqrt(readings))


@dataclass(frozen=True)
class Calibration:
    """How much the evidence counts."""

    independent: float
    """Independent pieces that the residual of a wrong model counts for."""

    discrepancy: float
    """Energy per reading, in floors squared, in which models differ that are both right for what they are about: no
    amount of data makes such a difference a cause."""

    temperature: float
    """Scores are divided by it."""

    lapse: float
    """Probability that is spread over all causes: the truth may be one that the search has not weighed rightly."""

    unknown: tuple[float, ...]
    """Weights of the features of "unknown", the constant first."""

    misjudged: float = 0.0
    """Least probability of "unknown"."""

    stuck: float = 0.0
    """Least probability of its opposite: a search may not have found what the catalogue has."""

    def weight(self, shared: float, readings: int) -> float:
        """What a residual's shared energy counts for as evidence, the less the better.

        What right models miss and what chance shares of so many readings are added, so that less is no evidence.
        """
        return min(self.independent, readings) * float(np.log(shared + self.discrepancy + chance(readings)))

    def beyond(self, shared: float, readings: int) -> float:
        """What a residual shares beyond chance, with what right models miss added."""
        return max(0.0, shared - chance(readings)) + self.discrepancy

    @classmethod
    def load(cls) -> Calibration:
        """The calibration that is shipped."""
        data = json.loads(files(__package__).joinpath("calibration.json").read_text(encoding="utf-8"))
        unknown = tuple(map(float, data.pop("unknown")))
        return cls(unknown=unknown, **{key: float(value) for key, value in data.items()})
