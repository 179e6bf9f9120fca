"""A column of a stimuli file as the numbers of the input that it drives."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

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
        low, high = (0, 1) if signal.type == "Boolean" else LIMITS.get(signal.type, LIMITS["Int64"])
        among = set(items.values()) if items and signal.type != "Boolean" else None
        known = f"; known: {', '.join(items)}" if items else ""
        made = np.empty(len(self.cells), np.int64)
        for k, cell in enumerate(self.cells):
            text = cell if cell in items else cell.strip()
            try:
                number = items[text] if text in items else _whole(text)
            except ValueError:
                raise self.error(k, f"'{cell}' is not a number{known}") from None
            if not isinstance(number, int) or not low <= number <= high or (among and number not in among):
                raise self.error(k, f"{number} is not a value of type {signal.type} that a table can give{known}")
            made[k] = in_slot(number)
        return made


def _whole(text: str) -> int | float:
    """A cell as a whole number, to its last digit; as a float where it is another one, or `ValueError`."""
    try:
        return plain_whole(text)
    except ValueError:
        number = plain_number(text)
        return int(number) if number.is_integer() else number
