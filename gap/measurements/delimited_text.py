"""Text in columns: commas, semicolons or tabs, points or decimal commas, a row of units, time stamps."""

from __future__ import annotations

import csv
import re
from collections import deque
from collections.abc import Iterator
from math import inf, nan
from pathlib import Path
from typing import IO

import numpy as np

from ...core.plain_numbers import plain_number
from ...core.repeated import repeated
from ...core.unit_names import named
from ..settings import FILE_LIMITS
from .plain_rows import plain_rows
from .table import (
    Column,
    FloatArray,
    MeasurementError,
    MeasurementTable,
    TextFormat,
    TimeStamp,
    is_time,
    split_unit,
    with_short_names,
)
from .time_stamps import comparable, parse_time_stamp, seconds_since_first

DELIMITERS = ("\t", ";", ",")
"""What separates columns: tabs, semicolons or commas, the likelier first; a comma may be in a number or a name."""

_SLASHED = re.compile(r"\d{1,4}/\d{1,2}/\d{1,4}([ T].*)?", re.ASCII)


class NumberReader:
    """Reads plain decimal numbers; which mark they have before their fraction is settled by the first that has one."""

    def __init__(self, decimal: str | None):
        self.decimal = decimal

    def __call__(self, cell: str) -> float:
        """The number in a cell, NaN in an empty one; `ValueError` for anything else."""
        text = cell.strip()
        if not text:
            return nan
        mark = "," if "," in text else "." if "." in text else None
        if mark is not None:
            value = plain_number(text.replace(",", ".") if self.decimal in (None, mark) else "no number")
            self.decimal = mark
            return value
        return plain_number(text)

    def is_number(self, cell: str) -> bool:
        """Whether a cell has a number in it, or nothing."""
        try:
            self(cell)
        except ValueError:
            return False
        return True


def read(path: Path, form: TextFormat) -> MeasurementTable:
    """The table in a text file whose first column is time. Raises `MeasurementError` with the line."""
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:
            return _read(path, file, form)
    except OSError as error:
        raise MeasurementError(f"{path}: cannot be read ({error.strerror})") from None
    except UnicodeDecodeError:
        raise MeasurementError(f"{path}: is not a text file in UTF-8; save it as that") from None
    except csv.Error as error:
        raise MeasurementError(f"{path}: is no table of numbers ({error})") from None


def _read(path: Path, file: IO[str], form: TextFormat) -> MeasurementTable:
    csv.field_size_limit(FILE_LIMITS.longest_cell)
    delimiter = form.delimiter or _delimiter(file)
    source = _Lines(file)
    rows = _rows(source, delimiter)
    names = next(([cell.strip() for cell in row] for _, row in rows if row), [])
    if not any(names):
        raise MeasurementError(f"{path}: is empty")
    if any("\0" in name for name in names):
        raise MeasurementError(f"{path}: is not a text file in UTF-8; save it as that")
    if (duplicate := repeated([n for n in names if n])) is not None:
        raise MeasurementError(f"{path}: has two columns '{duplicate}'")
    number = NumberReader("." if delimiter == "," and form.decimal is None else form.decimal)
    units: list[str | None] = [split_unit(name)[1] for name in names]
    stamps: list[TimeStamp] = []
    data = _Data(len(names))
    for line, row in rows:
        if not row:
            continue
        if len(row) != len(names):
            raise MeasurementError(f"{path}, line {line}: {_wrong_count(row, names, delimiter)}")
        if not data.has_rows and _is_units_row(row, number):
            units = [_bare_unit(cell) or unit for cell, unit in zip(row, units, strict=True)]
            continue
        if (stamp := _stamp(row[0], number, stamps, data.has_rows, f"{path}, line {line}")) is not None:
            stamps.append(stamp)
            row = ["", *row[1:]]
        data.add(_numbers(row, number, f"{path}, line {line}"), line)
        while not stamps and (block := source.block()):
            many = plain_rows(block, len(names), delimiter, number.decimal)
            if many is None:  # cell by cell, then
                break
            data.add_block(many, source.number + 1)
            source.skip()
    return _table(path, names, units, data.values(), stamps, data.lines())


class _Lines:
    """The lines of a file, one after the other, or those ahead together."""

    def __init__(self, file: IO[str]):
        self._file, self._ahead = file, deque[str]()
        self.number = 0
        """Of the line that was given last."""

    def __iter__(self) -> _Lines:
        return self

    def __next__(self) -> str:
        line = self._ahead.popleft() if self._ahead else self._file.readline()
        if not line:
            raise StopIteration
        self.number += 1
        return line

    def block(self) -> list[str]:
        """Some lines that are ahead, which are not taken; none at the end, or where a block has been begun."""
        if self._ahead:
            return []
        self._ahead.extend(self._file.readlines(FILE_LIMITS.block))
        return list(self._ahead)

    def skip(self) -> None:
        """Take the block."""
        self.number += len(self._ahead)
        self._ahead.clear()


class _Data:
    """Rows of numbers and the line of each, one by one or many together."""

    def __init__(self, width: int):
        self._width = width
        self._blocks: list[FloatArray] = []
        self._lines: list[np.ndarray] = []
        self._rows: list[list[float]] = []
        self._lines_of_rows: list[int] = []
        self.has_rows = False

    def add(self, row: list[float], line: int) -> None:
        self._rows.append(row)
        self._lines_of_rows.append(line)
        self.has_rows = True

    def add_block(self, rows: FloatArray, first_line: int) -> None:
        self._gather()
        self._blocks.append(rows)
        self._lines.append(np.arange(first_line, first_line + len(rows)))

    def _gather(self) -> None:
        self._blocks.append(np.array(self._rows, dtype=float).reshape(len(self._rows), self._width))
        self._lines.append(np.array(self._lines_of_rows, dtype=int))
        self._rows, self._lines_of_rows = [], []

    def values(self) -> FloatArray:
        """All rows (n, width)."""
        self._gather()
        return np.concatenate(self._blocks)

    def lines(self) -> np.ndarray:
        """The line of each (n,)."""
        return np.concatenate(self._lines)


def _delimiter(file: IO[str]) -> str:
    """What separates the columns: what cuts the first two lines into as many cells; else what the head has."""
    head, first = file.readline(), file.readline()
    file.seek(0)
    cells = {mark: [len(row) for row in csv.reader([head, first], delimiter=mark)] for mark in DELIMITERS}
    even = [mark for mark, counts in cells.items() if len(counts) == 2 and counts[0] == counts[1] > 1]
    return max(even, key=lambda mark: cells[mark][0], default=next((mark for mark in DELIMITERS if mark in head), ","))


def _rows(source: _Lines, delimiter: str) -> Iterator[tuple[int, list[str]]]:
    """Line and cells of each record; spaces separate however many there are of them."""
    rows = (text.split() for text in source) if delimiter == " " else csv.reader(source, delimiter=delimiter)
    for row in rows:
        yield source.number, row


def _wrong_count(row: list[str], names: list[str], delimiter: str) -> str:
    text = f"{len(row)} cells where the head has {len(names)}"
    if delimiter == "," and len(row) == 2 * len(names):
        return f"{text}: where commas are in the numbers, semicolons have to be between the columns"
    return text


def _bare_unit(cell: str) -> str | None:
    text = cell.strip()
    return text[1:-1].strip() if text[:1] + text[-1:] in ("[]", "()") else text or None


def _is_units_row(row: list[str], number: NumberReader) -> bool:
    """Whether the first row below the head is of units: no numbers in it, and at least one unit that is known."""
    units = [unit for cell in row if (unit := _bare_unit(cell)) is not None and unit != "1"]
    if any(number.is_number(text) or parse_time_stamp(text) is not None for text in units):
        return False
    return any(named(text) is not None for text in units)


def _stamp(cell: str, number: NumberReader, stamps: list[TimeStamp], begun: bool, where: str) -> TimeStamp | None:
    """The time stamp in the first cell of a row, or None where times are numbers."""
    if begun and not stamps:
        return None
    stamp = parse_time_stamp(cell)
    if stamp is None and _SLASHED.fullmatch(cell.strip()):
        raise MeasurementError(
            f"{where}: '{cell.strip()}' leaves open which is the day; write time stamps as 2024-05-31 13:45:00.5"
        )
    if stamp is None and stamps:
        raise MeasurementError(f"{where}: '{cell.strip()}' is no time stamp as those above it")
    if stamp is not None and stamps and not comparable(stamps[0], stamp):
        raise MeasurementError(f"{where}: '{cell.strip()}' is a time stamp of another kind than '{stamps[0]}'")
    return stamp


def _numbers(row: list[str], number: NumberReader, where: str) -> list[float]:
    try:
        values = [number(cell) for cell in row]
    except ValueError:
        bad = next(cell.strip() for cell in row if not number.is_number(cell))
        if "\0" in bad:
            raise MeasurementError(f"{where}: has NUL characters: damaged, or not in UTF-8; save it as that") from None
        other_mark = {".": ",", ",": "."}.get(number.decimal or "", "")
        hint = f"; the fraction begins with '{number.decimal}' in this file" if other_mark and other_mark in bad else ""
        if bad.isalpha():
            hint = "; leave empty what was not measured"
        raise MeasurementError(f"{where}: '{bad}' is not a number{hint}") from None
    read_cells = zip(row, values, strict=True)
    large = next((cell for cell, x in read_cells if FILE_LIMITS.largest_quantity < abs(x) < inf), None)
    if large is not None:
        raise MeasurementError(f"{where}: {large} is no quantity of a machine")
    return values


def _table(
    path: Path, names: list[str], units: list[str | None], data: FloatArray, stamps: list[TimeStamp], lines: np.ndarray
) -> MeasurementTable:
    time = seconds_since_first(stamps) if stamps else data[:, 0]
    if not stamps and not is_time(names[0]):
        raise MeasurementError(
            f"{path}: the first column is '{names[0]}'; it has to be 'time' in seconds, or have time stamps"
        )
    columns = with_short_names(
        Column(name, time, data[:, j], unit)
        for j, (name, unit) in enumerate(zip(names, units, strict=True))
        if j > 0 and name
    )
    return MeasurementTable(path, columns, None if stamps else units[0], stamps[0] if stamps else None, lines)
