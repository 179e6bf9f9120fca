"""A column of a stimuli file as the numbers of the input that it drives."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ...core.errors import UsageError
from ...core.plain_numbers import plain_number, plain_whole
from ..engine.values import LIMITS, Signal, in_slot


@dataclass(frozen=True)
class StimuliColumn:
    """A column of the file: the name above it, its cells, and the line of each."""

    path: Path
    name: str
    cells: Sequence[str]
    lines: Sequence[int]

    def error(self, k: int, told: str) -> UsageError:
        """What is wrong with a cell."""
        return UsageError(f"{self.path}, line {self.lines[k]}, column '{self.name}': {told}")

    def reals(self) -> np.ndarray:
        """Its numbers (n,)."""
        made = np.empty(len(self.cells))
        for k, cell in enumerate(self.cells):
            try:
                made[k] = plain_number(cell)
            except ValueError:
                raise self.error(k, f"'{cell}' is not a number") from None
        if not np.isfinite(made).all():
            raise self.error(int(np.argmin(np.isfinite(made))), "not finite")
        return made

    def whole_numbers(self, signal: Signal, items: Mapping[str, int]) -> np.ndarray:
        """Its whole numbers or items (n,), which have to be values of the type of an input, as they lie in slots."""
        known = f"; known: {', '.join(items)}" if items else ""
        made = np.empty(len(self.cells), np.int64)
        for k, cell in enumerate(self.cells):
            text = cell if cell in items else cell.strip()
            try:
                number = items[text] if text in items else _whole(text)
            except ValueError:
                raise self.error(k, f"'{cell}' is not a number{known}") from None
            if not isinstance(number, int) or not _is_value(number, signal, items):
                raise self.error(k, f"{number} is not a value of type {signal.type} that a table can give{known}")
            made[k] = in_slot(number)
        return made


def whole_numbers(address: str, values: Iterable[Any], signal: Signal, items: Mapping[str, int]) -> np.ndarray:
    """Numbers (n,) that a caller gives for an input of whole numbers, as they lie in slots.

    items: of an enumeration. Raises `UsageError` for what is no value of the input's type: 2.7, or 300 for an Int8.
    """
    known = f"; known: {', '.join(items)}" if items and signal.type != "Boolean" else ""
    made = []
    for value in values:
        try:
            exact = isinstance(value, (bool, np.bool_, int, np.integer))
            number = int(value) if exact or float(value).is_integer() else float(value)
        except (TypeError, ValueError, OverflowError):
            raise UsageError(f"'{address}' = {value!r} is not a number{known}") from None
        if not isinstance(number, int) or not _is_value(number, signal, items):
            raise UsageError(f"'{address}' = {number:g} is not a value of type {signal.type}{known}")
        made.append(in_slot(number))
    return np.array(made, np.int64)


def _is_value(number: int, signal: Signal, items: Mapping[str, int]) -> bool:
    """Whether an input of whole numbers may have that one, which has to be one of an enumeration's items."""
    low, high = (0, 1) if signal.type == "Boolean" else LIMITS.get(signal.type, LIMITS["Int64"])
    among = items.values() if items and signal.type != "Boolean" else (number,)
    return low <= number <= high and number in among


def _whole(text: str) -> int | float:
    """A cell as a whole number, to its last digit; as a float where it is another one, or `ValueError`."""
    try:
        return plain_whole(text)
    except ValueError:
        number = plain_number(text)
        return int(number) if number.is_integer() else number
