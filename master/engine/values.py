"""How values are kept: their families, where a signal lies, and what is exchanged with an FMU in one call."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ...ssp.model import INTEGER_RANGES
from .loop import F32, I8, I16, I32, U8, U16, U32

REAL, INTEGER, TEXT = "real", "integer", "text"
"""Families: how a signal's values are kept."""

LIMITS = {**INTEGER_RANGES, "Enumeration": INTEGER_RANGES["Int32"]}
"""Least and greatest value of the types of FMI 1.0 and 2.0, and of FMI 3.0 but for its enumerations."""


def in_slot(number: int) -> int:
    """A whole number as it lies in the 64 bits of a slot: those beyond Int64 are negative there."""
    return number if number <= LIMITS["Int64"][1] else number - 2**64


def of_slot(number: int, kind: str) -> int:
    """The whole number of a type that lies in a slot."""
    return number + 2**64 if number < 0 and kind == "UInt64" else number


MAX_ARRAY_VALUES = 10_000_000
"""Most values of an array."""

WIDTHS = {I8: np.int8, U8: np.uint8, I16: np.int16, U16: np.uint16, I32: np.int32, U32: np.uint32, F32: np.float32}


@dataclass(frozen=True)
class FmiType:
    """How values of an FMI type are exchanged: the name in Get/Set calls, the family, and the width where that is not
    the 8 bytes of a slot."""

    call_suffix: str
    family: str
    width: int | None = None


@dataclass(frozen=True)
class Signal:
    """An input or output: `place` is its first slot in the buffer (or its place among the texts), `size` how many."""

    component: str
    name: str
    type: str
    family: str
    reference: int
    place: int
    size: int = 1
    is_array: bool = False
    """Whether it has dimensions, be they 1."""
    element: int | None = None
    """Which value of an array it is, where it is only one of them."""

    @property
    def address(self) -> str:
        """component.variable."""
        return f"{self.component}.{self.name}" if self.component else self.name

    @property
    def index(self) -> str:
        """'[2]' where it is the second value of an array; '' where it is a whole signal."""
        return "" if self.element is None else f"[{self.element + 1}]"

    @property
    def label(self) -> str:
        """Its address, with the index where it is one value of an array."""
        return self.address + self.index

    @property
    def home(self) -> tuple[bool, int]:
        """Where it lies: whether among the texts, and its place. Aliases share it, and the values of an array."""
        return self.family == TEXT, self.place - (self.element or 0)

    def part(self, element: int) -> Signal:
        """One value of an array."""
        return replace(self, place=self.place + element, size=1, element=element)


@dataclass
class ExchangeGroup:
    """Signals of one type that are exchanged in one call: references, first slot (or text) and number of values."""

    fmi_type: FmiType
    references: np.ndarray
    place: int
    count: int
    stage: int
    """Place in the staging area of the width of the type."""
    signals: list[Signal]
