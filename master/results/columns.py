"""The columns of a record: which signals, in which order, and how they are cut out of the rows of the engine."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...core.errors import PackageError, UsageError, did_you_mean
from ..engine.values import REAL, TEXT, Signal
from ..system.addresses import matches
from ..system.system import System


@dataclass(frozen=True)
class Column:
    """A column of a result: name, type (float, integer, unsigned, boolean or text), unit, and what it is."""

    name: str
    type: str = "float"
    unit: str | None = None
    text: str = ""


TIME = Column("time", "float", "s")


def elements(signal: Signal) -> list[str]:
    """Names of a signal's values: name, or name[1], name[2], ... of an array."""
    if signal.element is not None:
        return [signal.label]
    if signal.size == 1 and not signal.is_array:
        return [signal.address]
    return [f"{signal.address}[{k + 1}]" for k in range(signal.size)]


def described(system: System, signal: Signal) -> str:
    """What the FMU says of a signal, "" where it says nothing, or it is the whole system's."""
    instance = system.instances.get(signal.component)
    variable = instance.variables.get(signal.name) if instance is not None else None
    return " ".join(str(getattr(variable, "description", None) or "").split())


def kind_of(type: str, family: str) -> str:
    """The type of a column, of an FMI type and the family of its values."""
    if family == TEXT:
        return "text"
    if family == REAL:
        return "float"
    return {"Boolean": "boolean", "UInt64": "unsigned"}.get(type, "integer")


class RecordLayout:
    """Which values a run keeps: all outputs and inputs, per component, and then the system's own."""

    def __init__(self, system: System):
        self.system = system
        self.outputs: list[int] = []
        self.inputs: list[int] = []
        self.keeps_texts = False
        """Whether strings are among the columns that are kept."""
        self.columns: list[Column] = [TIME]
        self._cuts: list[tuple[str, int]] = [("time", 0)]
        units = system.units()
        groups = [(instance.outputs, instance.inputs) for instance in system.instances.values()]
        own = {s: system.connections.passed_on(s.name) for s in system.system_outputs.values()}
        groups.append((
            [s for s, passed in own.items() if len(passed) < s.size],
            [*(s for s, passed in own.items() if len(passed) == s.size), *system.system_inputs.values()],
        ))  # fmt: skip
        for outputs, inputs in groups:
            for signals, are_outputs in ((outputs, True), (inputs, False)):
                for s in signals:
                    text = described(system, s)
                    for k, name in enumerate(elements(s)):
                        given = are_outputs and k not in own.get(s, ())
                        where, places = ("output", self.outputs) if given else ("input", self.inputs)
                        self.columns.append(Column(name, kind_of(s.type, s.family), units.get(s.address), text))
                        if s.family == TEXT:
                            self._cuts.append((f"{where} text", s.place + k))
                        else:
                            self._cuts.append((where, len(places)))
                            places.append(s.place + k)
        self.kinds = {c.name: c.type for c in self.columns}
        seen: set[str] = set()
        for c in self.columns:
            if c.name in seen:
                raise PackageError(f"two columns of the result would be called '{c.name}': rename a connector")
            seen.add(c.name)

    def chosen(self, patterns: Sequence[str], option: str = "--record") -> list[int]:
        """Indices of the columns whose names match one of the patterns; all of them if there is none."""
        if not patterns:
            return list(range(len(self.columns)))
        names = [c.name for c in self.columns]
        found = {0}
        for pattern in patterns:
            matching = [i for i, name in enumerate(names) if matches(name, pattern)]
            if not matching:
                raise UsageError(f"{option} '{pattern}' matches nothing{did_you_mean(pattern, names)}")
            found.update(matching)
        return sorted(found)

    def keep_texts(self, recorded: Sequence[int]) -> None:
        """Have the FMUs give the strings among those columns at every step; they do not know of it before loading."""
        wanted = {self.columns[i].name for i in recorded if self.columns[i].type == "text"}
        for instance in self.system.instances.values():
            instance.texts.update(s.name for s in instance.outputs if not wanted.isdisjoint(elements(s)))
        self.keeps_texts = bool(wanted)

    def cut(
        self, recorded: Sequence[int], time: np.ndarray, rows: np.ndarray,
        texts: list[tuple[list[object], list[object]]],
    ) -> list[np.ndarray | list[object]]:  # fmt: skip
        """Columns of rows (n, outputs + inputs) and of the texts at the start and at the end of each step."""
        table: list[np.ndarray | list[object]] = []
        for i in recorded:
            where, place = self._cuts[i]
            if where == "time":
                table.append(time)
            elif where.endswith("text"):
                table.append([pair[0 if where.startswith("output") else 1][place] for pair in texts])
            else:
                raw = rows[:, place if where == "output" else len(self.outputs) + place]
                kind = self.columns[i].type
                if kind == "float":
                    table.append(raw)
                else:
                    whole = np.ascontiguousarray(raw).view(np.uint64 if kind == "unsigned" else np.int64)
                    table.append(whole != 0 if kind == "boolean" else whole)
        return table
