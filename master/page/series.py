"""The record of a run as a page holds it: few points, in base64."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import chain
from typing import Any

import numpy as np

from ...core.errors import UsageError
from ..results.blocks import blocks
from ..results.format import Block
from .record import RunRecord
from .reduction import Reduced, Reducer

VALUES, MOST_POINTS = 2_000_000, 200_000
"""Most numbers of a run in a page, about 11 MB of it, and most points of a signal: more rows become groups."""

ITEMS = 1000
"""Most different texts of a column that are told apart."""


@dataclass(frozen=True)
class Series:
    """Points of all columns. Those of texts are places in their `items`."""

    names: tuple[str, ...]
    """Without the time."""
    points: Reduced
    items: Mapping[str, tuple[str, ...]]

    def column(self, name: str) -> np.ndarray:
        """Points (points,) of a column."""
        return np.asarray(self.points.values[self.names.index(name)])

    def largest(self) -> np.ndarray:
        """Greatest absolute finite value of each column (columns,), 0 where there is none."""
        sizes = np.abs(self.points.values)
        return np.asarray(np.where(np.isfinite(sizes), sizes, 0.0).max(axis=1, initial=0.0))

    def changes(self) -> np.ndarray:
        """Whether a column has more than one value (columns,)."""
        return np.asarray((self.points.values != self.points.values[:, :1]).any(axis=1))

    def content(self) -> dict[str, Any]:
        """For the page: times as float64, a column as its value if it has one only, else as float32;
        what varies little about a large number has that as its `middle`."""
        return {
            "rows": self.points.rows,
            "group": self.points.group,
            "t": _base64(self.points.times, "<f8"),
            "columns": [_column(values) for values in self.points.values],
            "items": {name: list(items) for name, items in self.items.items()},
        }


Codes = dict[str, dict[str, int]]
"""Places of the texts of a column, by its name."""


def read_series(record: RunRecord) -> Series:
    """Read a record in little memory, however long it is. Raises `UsageError` for a file that is no record."""
    return series_of(record, blocks(record.file, record.texts), VALUES, {})


def series_of(record: RunRecord, found: Iterator[Block], numbers: int, codes: Codes) -> Series:
    """The series of blocks of a record; numbers: most that it may have in all; codes: runs that are compared share
    them. Raises `UsageError` for what is no record."""
    first = next(found, None)
    if first is None or "time" not in first:
        raise UsageError(f"{record.file}: no result file (it has no column 'time')")
    names = ["time", *(name for name in first if name != "time")]
    if len(names) < 2:
        raise UsageError(f"{record.file}: it has no signals, only the time")
    reducer = Reducer(len(names) - 1, min(MOST_POINTS, numbers // len(names)))
    kinds: dict[str, bool] = {}
    before = -np.inf
    for block in chain([first], found):
        times, values = _numbers(record, block, names, codes, kinds)
        check_times(record, np.concatenate([[before], times]))
        before = times[-1] if len(times) else before
        reducer.add(times, values)
    return Series(tuple(names[1:]), reducer.reduced(), {name: tuple(of) for name, of in codes.items()})


def check_times(record: RunRecord, times: np.ndarray) -> None:
    """Raise `UsageError` unless the times (n,) are numbers that never fall."""
    if not (np.diff(times) >= 0.0).all() or not np.isfinite(times[1:]).all():
        raise UsageError(f"{record.file}: no result file (its times fall, or are no numbers)")


def _numbers(
    record: RunRecord, block: Block, names: list[str], codes: Codes, kinds: dict[str, bool]
) -> tuple[np.ndarray, np.ndarray]:
    """Times (n,) and a row (n,) for each other name; texts become their places among those of their column.

    kinds: whether a column is one of texts, as its first rows are.
    """
    times = block["time"]
    if isinstance(times, list):
        raise UsageError(f"{record.file}: no result file (its times are no numbers)")
    made = np.empty((len(names) - 1, len(times)))
    for k, name in enumerate(names[1:]):
        column = block[name]
        is_text = kinds.setdefault(name, isinstance(column, list)) if len(times) else False
        if is_text and not isinstance(column, list):  # texts that happen to be numbers
            column = [f"{v:g}" for v in column]
        if isinstance(column, list) and not is_text:
            made[k] = np.nan  # a word among numbers is none
        elif isinstance(column, list):
            known = codes.setdefault(name, {})
            for text in dict.fromkeys(column):
                if text not in known and len(known) < ITEMS:
                    known[text] = len(known)
            made[k] = [known.get(text, np.nan) for text in column]
        else:
            made[k] = column
    return np.asarray(times, float), made


def _base64(values: np.ndarray, kind: str) -> str:
    return b64encode(np.ascontiguousarray(values, kind).tobytes()).decode()


def _column(values: np.ndarray) -> dict[str, Any]:
    finite = values[np.isfinite(values)]
    if len(finite) == len(values) and len(values) and np.ptp(values) == 0.0:
        return {"value": float(values[0])}
    low, high = (float(finite.min()), float(finite.max())) if len(finite) else (0.0, 0.0)
    middle = 0.5 * low + 0.5 * high
    if abs(middle) <= high - low:  # small numbers keep their digits, and 0 stays 0
        middle = 0.0
    with np.errstate(over="ignore"):  # a span beyond float32 is drawn as far as that goes
        return {"middle": middle, "points": _base64(values - middle, "<f4")}
