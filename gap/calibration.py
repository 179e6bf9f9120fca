"""The few numbers that turn scores into probabilities, fitted on benchmark cases whose truth was known.

`benchmarks/blind/calibrate.py` makes `calibration.json`, from cases that are never those of a reported score.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from importlib.resources import files


@dataclass(frozen=True)
class Calibration:
    """How much the evidence counts."""

    independent: float
    """Most independent readings that count: two models always differ a little in what neither of them is about, and no
    amount of data makes such a difference a cause."""

    temperature: float
    """Scores are divided by it."""

    lapse: float
    """Probability that is spread over all causes: the truth may be one that the search has not weighed rightly."""

    unknown: tuple[float, ...]
    """Weights of the features of "unknown", the constant first."""

    misjudged: float = 0.0
    """Least probability of "unknown", and of its opposite: a search may have failed."""

    @classmethod
    def load(cls) -> Calibration:
        """The calibration that is shipped."""
        data = json.loads(files(__package__).joinpath("calibration.json").read_text(encoding="utf-8"))
        numbers = (float(data[key]) for key in ("independent", "temperature", "lapse"))
        return cls(*numbers, tuple(map(float, data["unknown"])), float(data["misjudged"]))
