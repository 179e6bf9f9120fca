"""The one value that every format of measurement files is read into."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...core.errors import CosimError

FloatArray = NDArray[np.float64]

TimeStamp = datetime | timedelta
"""A moment with its date, or a clock time as the time since midnight."""

_WITH_UNIT = re.compile(r"(?P<name>.*\S)\s*(\[(?P<square>[^\[\]]+)\]|\((?P<round>[^()]+)\))\s*")


class MeasurementError(CosimError):
    """A file of measurements that cannot be used; names file, place and remedy."""


@dataclass(frozen=True)
class TextFormat:
    """How numbers are written in a text file; None: to be recognised."""

    delimiter: str | None = None
    """Between columns: one character."""
    decimal: str | None = None
    """Between whole and fraction: '.' or ','."""


@dataclass(frozen=True)
class Column:
    """Readings of one quantity: values (n,) at times (n,), NaN where nothing was read; `unit` as the file states it."""

    name: str
    time: FloatArray
    values: FloatArray
    unit: str | None = None


@dataclass(frozen=True)
class MeasurementTable:
    """The columns of a file by name, without that of time, which each column has with it.

    Times are in the file's own unit, `time_unit` where it states one, and on its own clock; where they were written as
    time stamps they are seconds since `first_stamp`.
    """

    file: Path
    columns: Mapping[str, Column]
    time_unit: str | None = None
    first_stamp: TimeStamp | None = None
    lines: NDArray[np.int64] | None = None
    """The line of each row, of text."""
    unusable: Mapping[str, str] = field(default_factory=dict)
    """What else the file has: why it is no column."""

    def place(self, row: int) -> str:
        """Where a row (counted from 0) stands, for messages."""
        return f"{self.file}, line {self.lines[row]}" if self.lines is not None else f"{self.file}, row {row + 1}"

    @property
    def names(self) -> list[str]:
        """The names of the columns, in their order."""
        return list(self.columns)


def split_unit(heading: str) -> tuple[str, str | None]:
    """Name and unit of a heading such as `P1 [bar]` or `Time (s)`; a heading without a unit has None."""
    match = _WITH_UNIT.fullmatch(heading.strip())
    if match is None:
        return heading.strip(), None
    return match["name"].strip(), (match["square"] or match["round"]).strip()


def is_time(heading: str) -> bool:
    """Whether a heading is that of time, with a unit or without."""
    name, _ = split_unit(heading)
    return name.lower() == "time" or name in ("t", "tout")


def with_short_names(columns: Iterable[Column], reserved: Iterable[str] = ()) -> dict[str, Column]:
    """Columns by name; a heading with a unit is found by its name alone too, where that is nobody else's."""
    listed = list(columns)
    by_name = {c.name: c for c in listed}
    short = [split_unit(c.name)[0] for c in listed]
    for name, column in zip(short, listed, strict=True):
        if name not in by_name and name not in reserved and short.count(name) == 1:
            by_name[name] = column
    return by_name
