"""Two runs compared: their common signals, what only one has, and the parameters in which they differ."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...core.errors import CosimError, UsageError
from ...core.unit_names import named
from ...core.units import conversion
from ..page.record import RunRecord
from ..page.series import check_times
from ..results.blocks import whole
from .common_times import CommonTimes, common_times
from .difference import Difference, difference, difference_of_texts

Table = dict[str, "np.ndarray | list[str]"]


@dataclass(frozen=True)
class Run:
    """A run with all of its rows, columns by name; `label` is what it is called beside the others."""

    label: str
    record: RunRecord
    table: Table

    @property
    def times(self) -> np.ndarray:
        """(rows,) [s]"""
        return np.asarray(self.table["time"])

    @property
    def names(self) -> list[str]:
        """Of its signals."""
        return [name for name in self.table if name != "time"]


@dataclass(frozen=True)
class Comparison:
    """How a run differs from the first one."""

    a: Run
    b: Run
    common: CommonTimes
    differences: tuple[Difference, ...]
    """Of all common signals, the greatest relative one first, those that differ by a level last."""

    @property
    def differs(self) -> bool:
        """Whether any common signal does by more than the tolerance."""
        return any(d.differs for d in self.differences)

    @property
    def only_a(self) -> list[str]:
        """Signals that the second run does not have."""
        return [name for name in self.a.names if name not in self.b.table]

    @property
    def only_b(self) -> list[str]:
        """Signals that the first run does not have."""
        return [name for name in self.b.names if name not in self.a.table]


def read_runs(records: Mapping[str, RunRecord]) -> list[Run]:
    """The runs by their labels. Raises `UsageError` for a file that is no record."""
    made = []
    for label, record in records.items():
        table = whole(record.file, record.texts)
        if "time" not in table or isinstance(table["time"], list):
            raise UsageError(f"{record.file}: no result file (it has no column 'time' of numbers)")
        check_times(record, np.concatenate([[-np.inf], table["time"]]))
        made.append(Run(label, record, table))
    return made


def in_units_of(a: Run, b: Run) -> None:
    """Bring the numbers of b to the units of a, where both tell them and they measure the same."""
    for name, column in b.table.items():
        theirs, ours = b.record.unit(name), a.record.unit(name)
        if isinstance(column, list) or not theirs or not ours or theirs == ours or name not in a.table:
            continue
        source, target = named(theirs), named(ours)
        try:
            if source is not None and target is not None:
                factor, offset = conversion(source, target)
                b.table[name] = factor * column + offset
        except CosimError:
            continue


def compare(a: Run, b: Run, tolerance: float) -> Comparison:
    """Compare two runs, the numbers of b in the units of a (see `in_units_of`).

    tolerance: a share of each signal's range. Raises `UsageError` where they have no signal or no time in common.
    """
    names = [name for name in a.names if name in b.table]
    if not names:
        raise UsageError(f"{a.record.name} and {b.record.name} have no signal in common")
    try:
        common = common_times(a.times, b.times)
    except UsageError as error:
        raise UsageError(f"{a.record.name} and {b.record.name}: {error}") from None
    found = [_signal(a, b, common, name, tolerance) for name in names]
    found.sort(key=lambda d: (not d.remark, d.is_level, -d.relative))
    return Comparison(a, b, common, tuple(found))


def _signal(a: Run, b: Run, common: CommonTimes, name: str, tolerance: float) -> Difference:
    x, y = a.table[name], b.table[name]
    theirs, ours = b.record.unit(name), a.record.unit(name)
    if isinstance(x, list) and isinstance(y, list):
        return difference_of_texts(name, common.times, common.texts(common.a, x), common.texts(common.b, y))
    if isinstance(x, list) or isinstance(y, list):
        return Difference(name, "", 0.0, 0.0, remark="texts against numbers")
    if theirs and ours and theirs != ours and not _alike(theirs, ours):
        return Difference(name, "", 0.0, 0.0, remark=f"{ours} against {theirs}")
    held = any(r.record.table("types").get(name, "float") != "float" for r in (a, b))
    at_a, at_b = common.numbers(common.a, x, held), common.numbers(common.b, y, held)
    return difference(name, ours or theirs, common.times, at_a, at_b, tolerance)


def _alike(one: str, other: str) -> bool:
    a, b = named(one), named(other)
    return a is not None and b is not None and a.same_dimension(b)


def answers_apart(runs: list[Run]) -> dict[str, list[tuple[float | None, str]]]:
    """(value, unit) in each run of the numbers that the package's answers have and in which they differ, by name."""
    told = [run.record.table("answers").get("values") for run in runs]
    return _apart([table if isinstance(table, Mapping) else {} for table in told])


def parameters_apart(runs: list[Run]) -> dict[str, list[tuple[Any, str]]]:
    """(value, unit) in each run of the parameters in which they differ, by name; (None, '') where one has none.

    Empty where a run tells of no parameters at all, as a file on its own does.
    """
    told = [run.record.table("parameters") for run in runs]
    return _apart(told) if all(told) else {}


def _apart(tables: Sequence[Mapping[str, Any]]) -> dict[str, list[tuple[Any, str]]]:
    """(value, unit) in each table of what differs, by name; (None, '') where one has none."""
    made = {}
    for name in dict.fromkeys(name for table in tables for name in table):
        found = [table[name] if isinstance(table.get(name), Mapping) else {} for table in tables]
        values = [(v.get("value"), str(v.get("unit") or "")) for v in found]
        if any(value != values[0] for value in values):
            made[name] = values
    return made
