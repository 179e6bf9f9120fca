"""Run files as they are found: read as they stand where that is possible, otherwise with a readable copy."""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ...core.files import writing
from ...core.regular import require_regular
from ..measurements.read_table import FORMATS, read_table
from ..measurements.table import Column, FloatArray, MeasurementError, MeasurementTable, is_time, split_unit
from ..settings import FILE_LIMITS
from . import raw_text
from .headings import time_unit


@dataclass(frozen=True, eq=False)
class Source:
    """A run as it was found: its columns, and whether they need a copy that the readers take."""

    file: Path
    """As the user named it."""
    name: str
    """Of the run."""
    columns: dict[str, Column]
    """By heading, without time."""
    time_unit: str | None = None
    """As the file says it."""
    stamped: bool = False
    """Whether times are written as time stamps."""
    copy: bool = False
    """Whether it has to be written anew to be read."""
    remarks: tuple[str, ...] = ()
    timeless: bool = False
    """Whether its times are made up, for the file has none."""

    @property
    def time(self) -> FloatArray:
        """Times (n,) in the file's unit."""
        return next(iter(self.columns.values())).time


def load(path: Path, rate: float | None) -> Source:
    """The run in a file; rate: samples a second of a file without times. Raises `MeasurementError`."""
    try:
        table = read_table(path)
    except MeasurementError as error:
        if not _is_text(path):
            raise
        return _from_text(path, rate, error)
    columns = {c.name: c for c in table.columns.values()}
    if not columns:
        raise MeasurementError(f"{path}: has no column but time")
    times = next(iter(columns.values())).time
    if len(times) < FILE_LIMITS.min_samples:
        raise MeasurementError(f"{path}: {len(times)} samples; a diagnosis needs {FILE_LIMITS.min_samples}")
    if _is_text(path) and (not np.isfinite(times).all() or (np.diff(times) <= 0.0).any()):
        return _from_text(path, rate, MeasurementError("time does not increase"))
    return Source(path, _stem(path), columns, _stated_time_unit(table), table.first_stamp is not None)


def _stated_time_unit(table: MeasurementTable) -> str | None:
    return time_unit("time", table.time_unit)


def _stem(path: Path) -> str:
    return re.sub(r"\.(csv|txt|dat|tsv|asc)$", "", re.sub(r"\.gz$", "", path.name), flags=re.IGNORECASE)


def _is_text(path: Path) -> bool:
    require_regular(path, MeasurementError)
    with path.open("rb") as file:
        begin = file.read(64)
    binary = any(begin.startswith(f.begins) or path.suffix.lower() in f.suffixes for f in FORMATS)
    return not binary and not begin.startswith((b"PK\x03\x04", b"\xd0\xcf\x11\xe0", b"\x93NUMPY"))


def _from_text(path: Path, rate: float | None, error: MeasurementError) -> Source:
    table = raw_text.read(path)
    remarks, timeless = list(table.remarks), False
    time: FloatArray
    if len(table.values) < FILE_LIMITS.min_samples:
        raise MeasurementError(f"{path}: {len(table.values)} rows; a diagnosis needs {FILE_LIMITS.min_samples}")
    if table.time is not None:
        time, unit = table.values[:, table.time], time_unit(table.names[table.time], table.units[table.time])
        if table.time > 0 or not is_time(table.names[0]):
            remarks.append(f"time is its column '{table.names[table.time]}'")
    else:
        step = 1.0 / rate if rate else table.sampling_time
        timeless = step is None
        time, unit = np.arange(len(table.values), dtype=float) * (step or 1.0), "s"
        remarks.append(f"without times; readings are taken as {step:g} s apart" if step else "without times")
    keep = np.isfinite(time)
    keep[keep] &= np.r_[True, time[keep][1:] > np.maximum.accumulate(time[keep])[:-1]]
    if not keep.all():
        remarks.append(f"{int((~keep).sum())} rows in which time does not increase are left out")
    time, values = time[keep], table.values[keep]
    columns = {
        name: Column(name, time, values[:, j], table.units[j] or split_unit(name)[1])
        for j, name in enumerate(table.names)
        if j != table.time and np.isfinite(values[:, j]).any()
    }
    if not columns or len(time) < FILE_LIMITS.min_samples:
        raise MeasurementError(str(error) if str(path) in str(error) else f"{path}: has no columns of numbers")
    unit = "s" if table.stamped else unit
    return Source(path, _stem(path), columns, unit, False, True, tuple(remarks), timeless)


def with_interval(source: Source, step: float) -> Source:
    """A run without times, its readings so far apart [s]."""
    time = source.time * step
    columns = {name: replace(c, time=time) for name, c in source.columns.items()}
    return replace(source, columns=columns)


def side_by_side(source: Source) -> list[Source]:
    """The runs of a file that has several beside each other, as uEst, yEst, uVal and yVal; else that one run."""
    for cut in (3, 2, 4, 5, 1):
        split = [(name[:-cut], name[-cut:]) for name in source.columns if len(name) > cut]
        ends = list(dict.fromkeys(end for _, end in split))
        stems = list(dict.fromkeys(stem for stem, _ in split))
        whole = len(split) == len(source.columns) == len(stems) * len(ends) and len(ends) > 1
        if whole and len(stems) > 1 and all(end[0].isupper() and end[1:].islower() and cut > 2 for end in ends):
            return [
                replace(
                    source, name=f"{source.name}_{end}", copy=True,
                    columns={s.rstrip("_ "): replace(source.columns[s + end], name=s.rstrip("_ ")) for s in stems},
                    remarks=(*source.remarks, f"several runs side by side; this one is '{end}'"),
                )
                for end in ends
            ]  # fmt: skip
    return [source]


def complete(sources: Sequence[Source], used: Sequence[str]) -> list[Source]:
    """The runs, each with all the columns that are used; those that a run lacks are empty in its copy."""
    made = []
    for source in sources:
        missing = [name for name in used if name not in source.columns]
        if missing:
            empty = {name: Column(name, source.time, np.full(len(source.time), np.nan)) for name in missing}
            remark = f"without {', '.join(missing)}"
            source = replace(source, columns={**source.columns, **empty}, copy=True, remarks=(*source.remarks, remark))
        made.append(source)
    return made


def write_copy(source: Source, used: Sequence[str], target: Path) -> None:
    """Write the used columns of a run, time first, as the readers take them."""
    names = [name for name in source.columns if name in used]
    table = np.column_stack([source.time, *(source.columns[name].values for name in names)])
    with writing(target), target.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow([f"time [{source.time_unit}]" if source.time_unit else "time", *names])
        for time, *values in table.tolist():  # which may count from 1970
            writer.writerow([f"{time:.15g}", *("" if np.isnan(v) else f"{v:.9g}" for v in values)])
