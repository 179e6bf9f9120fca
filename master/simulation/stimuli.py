"""What drives the inputs of the whole system: a CSV file with a column `time` and a column for each input."""

from __future__ import annotations

import csv
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ...core.errors import UsageError, did_you_mean
from ...core.regular import require_regular
from ..engine.values import REAL, TEXT, Signal
from ..results.columns import elements
from ..system.system import System
from .stimuli_column import StimuliColumn


@dataclass(frozen=True)
class InputSeries:
    """An input and its series: times [s] (n,), values (n,), joined by straight lines or held.

    element: which value of an array it is; texts: what the values stand for where the input takes strings. Whole
    numbers, and those of texts, are int64, as they lie in a slot (`in_slot`).
    """

    signal: Signal
    element: int
    times: np.ndarray
    values: np.ndarray
    interpolated: bool
    texts: tuple[str, ...] = ()

    @property
    def place(self) -> int:
        """Slot of the input."""
        return self.signal.place + self.element

    def value(self, t: float) -> float | int | str:
        """What the input has at a time."""
        value: float | int = self.at(np.array([t]))[0].item()
        return self.texts[int(value)] if self.texts else value

    def at(self, t: np.ndarray) -> np.ndarray:
        """Values at times (m,); beyond the ends the nearest is held."""
        # times that are one rounding error early count as that time
        apart = np.diff(self.times)
        least = float(np.min(apart[apart > 0.0], initial=np.inf))
        slack = min(1e-9, 1e-3 * least) + 4.0 * np.finfo(float).eps * np.abs(t)
        if self.interpolated:
            near = self.times[np.searchsorted(self.times, t - slack).clip(0, len(self.times) - 1)]
            values: np.ndarray = np.interp(np.where(np.abs(near - t) <= slack, near, t), self.times, self.values)
            return values
        # a value holds from its time on
        found = np.searchsorted(self.times, t + slack, side="right") - 1
        values = self.values[np.clip(found, 0, None)]
        return values

    def mean(self, t: np.ndarray) -> np.ndarray:
        """Means (m - 1,) between times (m,); a series that is held counts as what it is at the start."""
        return interval_means(self.times, self.values, t) if self.interpolated else self.at(t)[:-1]


def interval_means(times: np.ndarray, values: np.ndarray, t: np.ndarray) -> np.ndarray:
    """Means (m - 1,) of a series over the spans between the times t (m,), which increase.

    times, values (n,): joined by straight lines, held beyond the ends; a jump is two values at one time.
    """
    inner = times[np.searchsorted(times, t[0], side="right") : np.searchsorted(times, t[-1])]
    grid = np.sort(np.concatenate([t, inner]))
    length = np.diff(grid)
    parts = length * np.interp(grid[:-1] + 0.5 * length, times, values)  # no jump lies within a part
    first = np.searchsorted(grid, t[:-1])
    return np.add.reduceat(parts, first) / np.add.reduceat(length, first)


def check_series(address: str, series: Any) -> tuple[np.ndarray, np.ndarray]:
    """Times (n,) and values (n,) of a series that a caller gives for an input, or a `UsageError` that names it."""
    try:
        times, values = (np.asarray(x, float) for x in series)
    except (TypeError, ValueError):
        raise UsageError(f"{address}: a series is a pair of times and values, numbers only") from None
    if times.ndim != 1 or times.shape != values.shape or not len(times):
        raise UsageError(f"{address}: a series has as many values as times, not {values.shape} and {times.shape}")
    if not (np.isfinite(times).all() and np.isfinite(values).all()):
        raise UsageError(f"{address}: a time or a value is not finite")
    if np.any(np.diff(times) < 0.0):
        raise UsageError(f"{address}: time goes back after {times[int(np.argmax(np.diff(times) < 0.0))]:g} s")
    return times, values


def as_slots(values: np.ndarray) -> np.ndarray:
    """Values (m,) as a program is driven with them: whole numbers as their 64 bits among the reals."""
    bits: np.ndarray = values.view(np.float64)
    return bits


def driven_rows(drives: Sequence[InputSeries], t: np.ndarray, averaged: bool) -> np.ndarray:
    """What a program is driven with in the steps between the times t (m,): a column for each drive, its values there.

    averaged: then as many columns with the means over the steps; the last row of these is not used.
    """
    columns = [as_slots(d.at(t)) for d in drives]
    if averaged:
        columns += [np.append(d.mean(t), 0.0) for d in drives]
    return np.stack(columns, axis=1)


def read(path: Path, system: System) -> list[InputSeries]:
    """The series of a file for inputs of the system, or inputs of components that nothing drives."""
    require_regular(path, UsageError)
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:
            reader = csv.reader(file)
            rows, lines = [], []
            for row in reader:
                if row and any(cell.strip() for cell in row):
                    rows.append(row)
                    lines.append(reader.line_num)
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        reason = getattr(error, "strerror", None) or error
        raise UsageError(f"{path}: cannot be read ({reason})") from None
    if len(rows) < 2:
        raise UsageError(f"{path}: has no rows")
    names = [name.strip() for name in rows[0]]
    if names[0] != "time":
        apart = next((mark for mark in (";", "\t") if mark in names[0]), None)
        hint = f"; columns are separated by commas, not by {'tabs' if apart == chr(9) else apart}" if apart else ""
        raise UsageError(f"{path}: the first column has to be 'time', not '{names[0]}'{hint}")
    targets = [_target(path, name, system) for name in names[1:]]
    for row, line in zip(rows[1:], lines[1:], strict=True):
        if len(row) != len(names):
            raise UsageError(f"{path}, line {line}: {len(row)} values for {len(names)} columns")
    columns = [StimuliColumn(path, name, cells, lines[1:]) for name, *cells in zip(names, *rows[1:], strict=True)]
    times = columns[0].reals()
    if np.any(np.diff(times) < 0.0):
        line = lines[int(np.argmax(np.diff(times) < 0.0)) + 2]
        raise UsageError(f"{path}, line {line}: time goes back")
    made = []
    for column, (signal, element) in zip(columns[1:], targets, strict=True):
        texts: dict[str, int] = {}
        if signal.family == REAL:
            values = column.reals()
        elif signal.family == TEXT:
            texts = {cell: k for k, cell in enumerate(dict.fromkeys(column.cells))}
            values = np.array([texts[cell] for cell in column.cells], np.int64)
        else:
            values = column.whole_numbers(signal, items_of(signal, system))
        made.append(InputSeries(signal, element, times, values, _is_interpolated(signal, system), tuple(texts)))
    for k, name in enumerate(names):
        if name in names[:k]:
            raise UsageError(f"{path}: column '{name}' stands twice")
    for signal in dict.fromkeys(d.signal for d in made):
        missing = set(range(signal.size)) - {d.element for d in made if d.signal == signal}
        if missing:
            raise UsageError(f"{path}: column '{elements(signal)[min(missing)]}' is missing")
    return made


def remarks(path: Path, drives: Sequence[InputSeries], system: System, start: float, stop: float) -> Iterator[str]:
    """What is hardly meant: a table beside the time of the run, or an input that is held and need not be."""
    if not drives:
        yield f"{path}: has no column but time, so it drives nothing"
        return
    first, last = drives[0].times[0], drives[0].times[-1]
    if last < start or first > stop:
        yield (
            f"{path}: its times, {first:g} to {last:g} s, are all {'before' if last < start else 'after'} the run from "
            f"{start:g} to {stop:g} s, in which its inputs are constant"
        )
    for signal in dict.fromkeys(d.signal for d in drives if d.signal.family == REAL and not d.interpolated):
        ends = _ends(signal, system)
        smooth = [s.address for s in ends if _is_continuous(s, system)]
        if smooth and len(smooth) < len(ends):
            held = next(s.address for s in ends if s.address not in smooth)
            yield (
                f"{path}: '{signal.address}' is held from row to row, for '{held}' is discrete; '{smooth[0]}' is "
                "continuous and would be joined by straight lines: give it an input of its own"
            )


def items_of(signal: Signal, system: System) -> dict[str, int]:
    """Names of values that a column may have: of an enumeration's items, and of those of a boolean."""
    if signal.type == "Boolean":
        return {"true": 1, "false": 0, "True": 1, "False": 0, "TRUE": 1, "FALSE": 0}
    if signal.type != "Enumeration":
        return {}
    end = signal.component, signal.name
    known = system.quantities
    return (known.quantity(end) if signal.component else known.input_quantity(signal.name)).items or {}


def _target(path: Path, name: str, system: System) -> tuple[Signal, int]:
    """An input and which of its values a column stands for; columns of an array are called name[1], name[2], ..."""
    signals = [*system.system_inputs.values(), *system.inputs.values()]
    known = {element: (s, k) for s in signals for k, element in enumerate(elements(s))}
    if name not in known:
        whole = next((s for s in signals if s.address == name), None)
        if whole is not None:
            raise UsageError(f"{path}: '{name}' is an array; give columns '{name}[1]' to '{name}[{whole.size}]'")
        free = [n for n, (s, _) in known.items() if system.connections.driver((s.component, s.name)) is None]
        raise UsageError(f"{path}: column '{name}' is not an input of the system{did_you_mean(name, free)}")
    signal, element = known[name]
    if system.connections.driver((signal.component, signal.name)) is not None:
        raise UsageError(f"{path}: column '{name}' is connected and cannot be driven")
    if signal.type == "Binary":
        raise UsageError(f"{path}: column '{name}' is {signal.type} and cannot be driven by a table")
    return signal, element


def _is_interpolated(signal: Signal, system: System) -> bool:
    """Whether a signal is continuous: joined by straight lines, else held."""
    return signal.family == REAL and all(_is_continuous(s, system) for s in _ends(signal, system))


def _ends(signal: Signal, system: System) -> list[Signal]:
    """The FMUs' inputs that an input stands for."""
    if signal.component:
        return [signal]
    return [link.target for link in system.links if not link.source.component and link.source.name == signal.name]


def _is_continuous(signal: Signal, system: System) -> bool:
    return system.instances[signal.component].variables[signal.name].variability in (None, "continuous")
