"""What the readers of binary formats share."""

from __future__ import annotations

import importlib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from datetime import datetime
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from ...core.errors import install
from ..settings import FILE_LIMITS
from .table import Column, FloatArray, MeasurementError, MeasurementTable, is_time, with_short_names


def library(path: Path, module: str, distribution: str) -> ModuleType:
    """The library that reads a format, loaded when it is needed; `MeasurementError` says how to get it."""
    try:
        return importlib.import_module(module)
    except ImportError:
        raise MeasurementError(f"{path}: reading it needs {distribution}: {install('formats')}") from None


@contextmanager
def translate_errors(path: Path, name: str) -> Iterator[None]:
    """Around a library that reads: whatever it raises about the file becomes one line."""
    try:
        yield
        return
    except MeasurementError:
        raise
    except Exception as error:  # each library has errors of its own, struct.error and IndexError among them
        message = " ".join(str(error).split())[:200] or type(error).__name__
    # raised out here so that nothing keeps the library's half-made reader, whose end may be noisy
    raise MeasurementError(f"{path}: cannot be read as {name} ({message}); is it complete?")


def as_floats(values: Any) -> FloatArray | None:
    """Readings as floats, times as seconds since the first where they are durations; None for anything but numbers."""
    array = np.asarray(values)
    if array.dtype.kind in "biuf":
        return array.astype(float)
    if array.dtype.kind == "m":
        return _seconds(array)
    return None


def from_datetimes(stamps: Any) -> tuple[FloatArray, datetime]:
    """Seconds since the first of numpy datetimes (n,), and that first one."""
    nanoseconds = np.asarray(stamps).astype("datetime64[ns]")
    first = nanoseconds[0]
    return _seconds(nanoseconds - first), first.astype("datetime64[us]").item()


def _seconds(durations: Any) -> FloatArray:
    """Durations in seconds; what is missing, NaN."""
    seconds: FloatArray = np.where(np.isnat(durations), np.nan, durations.astype("timedelta64[ns]").astype(float) / 1e9)
    return seconds


def table_of_arrays(path: Path, arrays: Mapping[str, Any], units: Mapping[str, str]) -> MeasurementTable:
    """A table of named arrays, one of which is time: dates, or called so. Raises `MeasurementError`."""
    dates = [name for name, values in arrays.items() if getattr(values, "dtype", None) is not None]
    dates = [name for name in dates if arrays[name].dtype.kind == "M"]
    named = [name for name in arrays if is_time(name)]
    if len(named) != 1 and len(dates) != 1:
        has = ", ".join(list(arrays)[:12]) or "no arrays"
        raise MeasurementError(f"{path}: needs one array called 'time' in seconds; it has {has}")
    time_name = named[0] if len(named) == 1 else dates[0]
    stamp = None
    if arrays[time_name].dtype.kind == "M":
        if not len(arrays[time_name]):
            raise MeasurementError(f"{path}: '{time_name}' is empty")
        time, stamp = from_datetimes(arrays[time_name])
    elif (floats := as_floats(arrays[time_name])) is None:
        raise MeasurementError(f"{path}: '{time_name}' is not of numbers")
    else:
        time = floats
    columns, unusable = [], {}
    for name, raw in arrays.items():
        values = as_floats(raw)
        if name == time_name:
            continue
        if values is None:
            unusable[name] = "is not of numbers"
        elif values.shape != time.shape:
            unusable[name] = (
                f"has the shape {'x'.join(map(str, values.shape))} where '{time_name}' has {len(time)} values"
            )
        else:
            columns.append(Column(name, time, values, units.get(name)))
    check_size(path, columns)
    time_unit = units.get(time_name) if stamp is None else None
    return MeasurementTable(path, with_short_names(columns), time_unit, stamp, None, unusable)


def check_size(path: Path, columns: list[Column]) -> None:
    """Raise `MeasurementError` for a number that no machine has."""
    for column in columns:
        large = (np.abs(column.values) > FILE_LIMITS.largest_quantity) & np.isfinite(column.values)
        if large.any():
            row = int(np.argmax(large))
            raise MeasurementError(
                f"{path}, row {row + 1}: {column.values[row]:g} in '{column.name}' is no quantity of a machine"
            )
