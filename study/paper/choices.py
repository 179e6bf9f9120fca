"""What a verdict on a claim needs and the paper does not say: thresholds and instants, all of them ours.

Each has the words that a report shows and two other values that would do as well; a claim whose verdict is another one
with these rests on the choice, not on the machine.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Any

from .cases import MID, T_START, WITHIN


def _choice(value: float, low: float, high: float, words: str, unit: str = "", factor: float = 1.0) -> Any:
    """A number of ours, two others in its place, and what it is; the words' {} stands for the number in the unit."""
    return field(default=value, metadata={"others": (low, high), "words": words, "unit": unit, "factor": factor})


@dataclass(frozen=True)
class Choices:
    """Numbers of ours, in SI units."""

    done: float = _choice(WITHIN, 0.5 * WITHIN, 2 * WITHIN, "a motion is over within {} of its target", "mm", 1e3)
    late: float = _choice(0.1, 0.05, 0.2, "delayed is what takes {} longer than its command", "s")
    mid: float = _choice(MID - T_START, 2.5, 3.5, "read off {} after the motion's start (the paper: at 8 s of a clock "
                         "in which we take the start to be at 5 s)", "s")  # fmt: skip
    visible: float = _choice(0.015, 0.0075, 0.03, "losses differ visibly from {} on", "%", 100)
    responds: float = _choice(0.03, 0.015, 0.06, "responses differ visibly from {} RMS on", "%", 100)
    window: float = _choice(0.1, 0.05, 0.2, "responses are compared for {}", "s")
    follows: float = _choice(0.05, 0.025, 0.1, "consistent is what stays within {} of the stroke", "%", 100)
    full: float = _choice(0.999, 0.99, 0.9999, "full open is a spool beyond {}", "%", 100)
    steady: float = _choice(0.02, 0.01, 0.04, "a speed is kept within {}", "%", 100)
    greatly: float = _choice(0.1, 0.05, 0.2, "greatly is more than {} of the command's time", "%", 100)
    little: float = _choice(0.5, 0.25, 0.75, "little is less than {} of the gain before", "%", 100)
    small: float = _choice(0.2, 0.1, 0.4, "very small is up to {} of the relief pressure", "%", 100)
    coincide: float = _choice(5e-3, 2.5e-3, 10e-3, "coincide is within {}, until the first has 97 % of its way",
                              "mm", 1e3)  # fmt: skip
    parallel: float = _choice(0.03, 0.015, 0.06, "parallel is a spread of the speeds below {}, at 130, 120 and 110 mm",
                              "%", 100)  # fmt: skip
    much: float = _choice(0.2, 0.1, 0.4, "much smaller is up to {}, at a steady motion and RMS over the run", "%", 100)
    balanced: float = _choice(0.05, 0.025, 0.1, "balanced is what moves by less than {} of the ambient pressure",
                              "%", 100)  # fmt: skip

    def words(self, names: Sequence[str]) -> str:
        """What the choices of these names are, for a reader."""
        return "; ".join(FIXED[name] if name in FIXED else told(name, getattr(self, name)) for name in names)


OURS = Choices()

FIXED = {
    "curves": "the values of the curves are ours where the text gives none",
    "slower": "the slower command takes twice the time",
}
"""Choices that no other value stands beside, for they are in the runs."""


def told(name: str, value: float) -> str:
    """What a choice of that name is with that value."""
    return str(_meta(name)["words"]).format(number(name, value))


def number(name: str, value: float) -> str:
    """The value of a choice in the unit of its words."""
    return f"{_meta(name)['factor'] * value:.6g} {_meta(name)['unit']}"


def others(names: Sequence[str]) -> Iterator[tuple[str, float, Choices]]:
    """Name, value and all choices for each other value of the choices with these names."""
    for name in names:
        for value in _meta(name)["others"]:
            yield name, value, replace(OURS, **{name: value})


NAMES = tuple(f.name for f in fields(Choices))


def _meta(name: str) -> Any:
    return next(f.metadata for f in fields(Choices) if f.name == name)
