"""The few numbers that turn scores into probabilities, fitted on benchmark cases whose truth was known.

`benchmarks/blind/calibrate.py` makes `calibration.json`, from cases that are never those of a reported score.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from importlib.resources import files

import numpy as np

from ..settings import EvidenceSettings

SUREST = 0.95
"""No answer is surer: of some hundred on which the benchmark's probability was the highest, three to six were wrong."""

HALF = 0.5
"""Probability of a first answer up to which it is not lowered: doubts are told as they are found."""

BARELY = 1e-9
"""By which share the first answer is ahead of the second at least."""


def chance(readings: int, deviations: float = EvidenceSettings.chance) -> float:
    """Energy per reading that normalised residuals of so many readings may share when nothing but noise is left."""
    return float(deviations / np.sqrt(readings))


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

    slope: float = 1.0
    shift: float = 0.0
    """The log-odds of the most probable answer are multiplied by the one, and the other is added, above `HALF`."""

    def confident(self, first: float, second: float) -> float:
        """Probability of the most probable answer from those of the first two; the first stays the first."""
        if first >= 1.0 or (self.slope == 1.0 and self.shift == 0.0):
            return first
        odds = self.slope * np.log(first / (1.0 - first)) + self.shift
        made = min(1.0 / (1.0 + np.exp(-odds)), SUREST)
        return float(max(made, min(first, HALF), (1.0 + BARELY) * second / (1.0 - first + second)))

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
