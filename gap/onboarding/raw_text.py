"""Text in columns that the readers of run files do not take as it is: other encodings, remarks above the head, no head,
time in another column than the first or in none."""

from __future__ import annotations

import csv
import gzip
import io
import re
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

import numpy as np

from ...core.regular import require_regular
from ..measurements.delimited_text import DELIMITERS, NumberReader
from ..measurements.table import FloatArray, MeasurementError
from ..measurements.time_stamps import comparable, parse_time_stamp, seconds_since_first
from ..settings import FILE_LIMITS, ONBOARDING
from .headings import campaign_unit, is_time_heading, time_unit, words

ENCODINGS = {b"\xff\xfe": "utf-16", b"\xfe\xff": "utf-16", b"\xef\xbb\xbf": "utf-8-sig"}


@dataclass(frozen=True, eq=False)
class RawTable:
    """Columns of a text file: names, units as they are stated or None, and values (rows, columns), NaN where there is
    no number."""

    names: tuple[str, ...]
    units: tuple[str | None, ...]
    values: FloatArray
    time: int | None
    """Which column is time; None where none is."""
    remarks: tuple[str, ...]
    """What is unusual about the file."""
    sampling_time: float | None = None
    """As a column of one number says it [s]."""
    stamped: bool = False
    """Whether times are written as time stamps: they are seconds since the first."""


def read(path: Path) -> RawTable:
    """The columns of a text file. Raises `MeasurementError` where there is no table in it."""
    require_regular(path, MeasurementError)
    try:
        data = path.read_bytes()
        if data.startswith(b"\x1f\x8b"):
            data = gzip.decompress(data)
    except (OSError, EOFError) as error:
        raise MeasurementError(f"{path}: cannot be read ({error})") from None
    remarks: list[str] = []
    text = _decoded(data, remarks)
    lines = text.splitlines()
    delimiter, head = _layout(lines)
    rows = [row for row in _cells(lines[head:], delimiter) if any(cell.strip() for cell in row)]
    if head:
        remarks.append(f"{head} lines of remarks above the columns")
    number = NumberReader("." if delimiter == "," else None)
    if not rows or len(rows[0]) < 1:
        raise MeasurementError(f"{path}: there are no columns in it")
    names, rows = _names(rows, number, remarks)
    units, rows = _units(rows, number, len(names))
    if not rows:
        raise MeasurementError(f"{path}: there are names of columns in it, and no rows below them")
    width = len(names)
    cells = [[*row[:width], *[""] * (width - len(row))] for row in rows]
    keep = [j for j in range(width) if names[j] or any(row[j].strip() for row in cells)]
    names, units = [names[j] or f"column {j + 1}" for j in keep], [units[j] for j in keep]
    values, stamped = _values([[row[j] for j in keep] for row in cells], number)
    clock = None if stamped is None else names[stamped[0]]
    if stamped is not None:
        remarks.append(f"the first time stamp, {stamped[1]}, is taken as 0 s")
    sampling, keep = _sampling_time(names, values)
    chosen = [names[j] for j in keep]
    values = values[:, keep]
    units = [units[j] for j in keep]
    time = chosen.index(clock) if clock is not None else _time_column(chosen, units, values)
    return RawTable(tuple(chosen), tuple(units), values, time, tuple(remarks), sampling, stamped is not None)


def _decoded(data: bytes, remarks: list[str]) -> str:
    encoding = next((name for begin, name in ENCODINGS.items() if data.startswith(begin)), "utf-8")
    try:
        text = data.decode(encoding)
    except UnicodeDecodeError:
        encoding, text = "cp1252", data.decode("cp1252", errors="replace")
    if encoding in ("utf-16", "cp1252"):
        remarks.append(f"written in {encoding}")
    return text


def _cells(lines: list[str], delimiter: str) -> list[list[str]]:
    if delimiter == " ":
        return [line.split() for line in lines]
    return list(csv.reader(io.StringIO("\n".join(lines)), delimiter=delimiter))


_DATE = re.compile(r"\d{1,4}[./-]\d{1,2}[./-]\d{1,4}")


def _is_value(cell: str, number: NumberReader) -> bool:
    """Whether a cell is one of a row: a number, a time stamp or a date."""
    text = cell.strip()
    return number.is_number(text) or parse_time_stamp(text) is not None or _DATE.fullmatch(text) is not None


def _layout(lines: list[str]) -> tuple[str, int]:
    """What separates columns, and the line of the head: what cuts most lines into equally many cells with numbers."""
    csv.field_size_limit(FILE_LIMITS.longest_cell)
    sample = [line for line in islice(lines, ONBOARDING.preamble + 40) if line.strip()]
    if not sample:
        return ",", 0

    def width(line: str, mark: str) -> int:
        return len(line.split()) if mark == " " else len(next(csv.reader([line], delimiter=mark), []))

    def is_row(line: str, mark: str) -> bool:
        number = NumberReader(None)
        cells = [
            c for c in (line.split() if mark == " " else next(csv.reader([line], delimiter=mark), [])) if c.strip()
        ]
        return bool(cells) and sum(_is_value(c, number) for c in cells) >= max(1, len(cells) - 1)

    last = sample[-1]
    candidates = [m for m in (*DELIMITERS, " ") if is_row(last, m)] or [","]
    delimiter = max(candidates, key=lambda m: (width(last, m) > 1, m != " ", width(last, m)))
    wide = width(last, delimiter)
    for k, line in enumerate(lines[: ONBOARDING.preamble]):
        if line.strip() and width(line, delimiter) == wide and (wide > 1 or not is_row(line, delimiter)):
            return delimiter, k
    first = next((k for k, line in enumerate(lines) if line.strip() and is_row(line, delimiter)), 0)
    return delimiter, first


def _names(rows: list[list[str]], number: NumberReader, remarks: list[str]) -> tuple[list[str], list[list[str]]]:
    """Names of the columns, each of its own, and the rows below them."""
    head = [cell.strip().lstrip("#%").strip() for cell in rows[0]]
    filled = [cell for cell in head if cell]
    if filled and all(_is_value(cell, number) for cell in filled):
        remarks.append("without names of its columns")
        return [f"column {j + 1}" for j in range(len(head))], rows
    for j, name in enumerate(head):
        if name and name in head[:j]:
            head[j] = f"{name} ({head[:j].count(name) + 1})"
            remarks.append(f"with two columns '{name}'")
    return head, rows[1:]


def _units(rows: list[list[str]], number: NumberReader, width: int) -> tuple[list[str | None], list[list[str]]]:
    """Units of the columns where the first row has them, and the rows below that."""
    row = [cell.strip().strip("[]()").strip() for cell in rows[0]] if rows else []
    filled = [cell for cell in row if cell not in ("", "1", "-")]
    if filled and not any(_is_value(c, number) for c in filled):
        if any(campaign_unit(c) is not None for c in filled):
            return [*(campaign_unit(c) and c for c in row), *[None] * (width - len(row))][:width], rows[1:]
        return [None] * width, rows[1:]  # remarks on the columns
    return [None] * width, rows


def _values(cells: list[list[str]], number: NumberReader) -> tuple[FloatArray, tuple[int, str] | None]:
    """Values (rows, columns), and the column that has time stamps with the first of them."""
    columns: list[FloatArray] = []
    first: tuple[int, str] | None = None
    for column in zip(*cells, strict=True):
        is_stamped = parse_time_stamp(column[0]) is not None
        known = [s for cell in column if (s := parse_time_stamp(cell)) is not None] if is_stamped else []
        if len(known) == len(column) and all(comparable(known[0], s) for s in known):
            first = first or (len(columns), column[0].strip())
            columns.append(seconds_since_first(known))
            continue
        columns.append(np.array([_number(c, number) for c in column]))
    return np.stack(columns, axis=1), first


def _number(cell: str, number: NumberReader) -> float:
    """The number in a cell, NaN for anything else."""
    try:
        return number(cell)
    except ValueError:
        return np.nan


def _sampling_time(names: list[str], values: FloatArray) -> tuple[float | None, list[int]]:
    """The sampling time where a column of one number says it, and the other columns."""
    for j, name in enumerate(names):
        known = values[np.isfinite(values[:, j]), j]
        key = "".join(words(name))
        if len(np.unique(known)) == 1 and known[0] > 0.0 and key in ("ts", "dt", "samplingtime", "fs", "rate", "hz"):
            rest = [k for k in range(len(names)) if k != j]
            return (float(known[0]) if key in ("ts", "dt", "samplingtime") else 1.0 / float(known[0])), rest
    return None, list(range(len(names)))


def _time_column(names: list[str], units: list[str | None], values: FloatArray) -> int | None:
    """The column that is time: called so and rising, or with a clock's even steps and no name of its own."""
    rising = [j for j in range(len(names)) if _rises(values[:, j])]
    named = [j for j in rising if is_time_heading(names[j]) or time_unit(names[j], units[j]) is not None]
    if named:
        return named[0]
    if rising and rising[0] == 0:
        steps = np.diff(values[:, 0])
        if np.std(steps) < ONBOARDING.even_clock * np.mean(steps) and names[0].startswith("column "):
            return 0
    return None


def _rises(y: FloatArray) -> bool:
    known = y[np.isfinite(y)]
    if len(known) < 3 or len(known) < len(y):
        return False
    steps = np.diff(known)
    return bool(np.mean(steps >= 0.0) > ONBOARDING.rising_share and known[-1] > known[0])
