"""What a package wants said after its run: numbers by its formulas, and sentences that hold them."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...core.display_units import DisplayUnits
from ...core.errors import did_you_mean
from ...ssp.model import AnswersAsked
from .formulas import Formula, FormulaError, Number, number

PLACE = re.compile(r"\{([^{}:]+)(?::([1-9]))?\}")
"""A value's name in a sentence, and how many digits of it are shown."""

BRACES = re.compile(r"\{[^{}]*\}")
"""What looks like the place of a value in a sentence."""

DIGITS = 3
USUAL = 1e-4, 1e7
"""Least and greatest number that is shown without a power of ten."""


@dataclass(frozen=True)
class Answers:
    """What came of it: (number or None, unit) by name; the sentences that hold; what could not be computed, and why."""

    values: Mapping[str, tuple[float | None, str]]
    sentences: tuple[str, ...] = ()
    problems: tuple[str, ...] = ()
    signals: tuple[str, ...] = ()
    """What plots show at first."""

    def texts(self, display: DisplayUnits) -> list[str]:
        """The sentences with the numbers in them, in the units in which they are to be shown."""

        def shown(place: re.Match[str]) -> str:
            value, unit = self.values[place[1]]
            assert value is not None  # such a sentence is left out
            return shown_answer(value, unit, display, int(place[2] or DIGITS))

        return [PLACE.sub(shown, sentence) for sentence in self.sentences]

    def summary(self) -> dict[str, Any]:
        """For summary.json: numbers in the package's units, and the sentences as they are shown and as it has them."""
        values = {name: {"value": value, "unit": unit or None} for name, (value, unit) in self.values.items()}
        return {
            "values": values, "sentences": self.texts(DisplayUnits()), "templates": list(self.sentences),
            "signals": list(self.signals),
        }  # fmt: skip

    @classmethod
    def of_summary(cls, told: Mapping[str, Any]) -> Answers:
        """Back from `summary`."""
        values = {str(name): (v["value"], str(v["unit"] or "")) for name, v in told["values"].items()}
        return cls(values, tuple(map(str, told["templates"])))


def shown_answer(value: float, unit: str, display: DisplayUnits, digits: int = DIGITS) -> str:
    """A number for a sentence, in the units in which it is to be shown."""
    name, factor, offset = display.of(unit, abs(value)) if unit and value else (unit, 1.0, 0.0)
    text = _significant(factor * value + offset, digits)
    return f"{text} {name}" if name not in ("", "1") else text


def _significant(x: float, digits: int) -> str:
    """A number with so many digits that count, and no power of ten."""
    if x == 0.0 or not USUAL[0] <= abs(x) < USUAL[1]:
        return f"{x:.{digits}g}"
    power = int(f"{x:.{digits - 1}e}".partition("e")[2])
    return f"{x:.{max(0, digits - 1 - power)}f}"


def answers(
    asked: AnswersAsked, times: np.ndarray, signals: Mapping[str, np.ndarray], parameters: Mapping[str, Any]
) -> Answers:
    """Compute what is asked.

    times (n,) [s], signals (n,) by address; parameters by address, those that are no numbers are left out.
    """
    known: dict[str, Number] = {
        name: float(value) for name, value in parameters.items() if isinstance(value, (bool, int, float))
    }
    known |= signals
    values: dict[str, tuple[float | None, str]] = {}
    problems, told = [], []
    for v in asked.values:
        try:
            found = number(Formula(v.formula).of(times, known))
        except FormulaError as error:
            problems.append(f"{v.where}: '{v.name}' is not told: {error}")
            continue
        known[v.name], values[v.name] = found, (found, v.unit)
    for s in asked.sentences:
        try:
            condition = number(Formula(s.condition).of(times, known)) if s.condition else 1.0
        except FormulaError as error:
            problems.append(f"{s.where}: {error}")
            continue
        if condition and all(values.get(name, (None,))[0] is not None for name, _ in PLACE.findall(s.text)):
            told.append(s.text)
    return Answers(values, tuple(told), tuple(problems), tuple(name for name in asked.signals if name in signals))


def sound(asked: AnswersAsked, known: Collection[str]) -> tuple[AnswersAsked, list[str]]:
    """What of it can be computed of a run whose signals and parameters are known; and what is wrong with the rest."""
    names, remarks = {*known}, []

    def holds(where: str, formula: str, told: str) -> bool:
        try:
            lacking = [name for name in Formula(formula).names if name not in names] if formula else []
            if lacking:
                hint = did_you_mean(lacking[0], [*known])
                raise FormulaError(f"there is no signal or parameter '{lacking[0]}'{hint}")
        except FormulaError as error:
            remarks.append(f"{where}: {told}: {error}")
            return False
        return True

    values = []
    for v in asked.values:
        if holds(v.where, v.formula, f"'{v.name}' is not told"):
            names.add(v.name)
            values.append(v)
    sentences = []
    for s in asked.sentences:
        lacking = [name for name, _ in PLACE.findall(s.text) if name not in {v.name for v in values}]
        if odd := BRACES.search(PLACE.sub("", s.text)):
            remarks.append(
                f"{s.where}: the sentence is not said: '{odd[0]}' is no place of a value; expected {{name}}, or "
                "{name:digits} with 1 to 9 digits"
            )
        elif lacking:
            remarks.append(f'{s.where}: the sentence is not said: there is no value \'{lacking[0]}\'')
        elif holds(s.where, s.condition, "the sentence is not said"):
            sentences.append(s)
    for name in asked.signals:
        if name not in names:
            remarks.append(f"<Show> of the package: there is no signal '{name}'{did_you_mean(name, [*known])}")
    return AnswersAsked(tuple(values), tuple(sentences), asked.signals), remarks
