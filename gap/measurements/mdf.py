"""ASAM MDF files, versions 3 and 4 (asammdf); each channel has the times of its own group."""

from __future__ import annotations

import gc
import logging
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

from .binary import as_floats, check_size, library, translate_errors
from .table import Column, MeasurementError, MeasurementTable, with_short_names


def read(path: Path) -> MeasurementTable:
    """The channels of an MDF file, times in seconds since its start; of equal names the first that is of numbers."""
    asammdf = library(path, "asammdf", "asammdf")
    try:
        return _read(asammdf, path)
    except MeasurementError as error:
        message = str(error)
    # asammdf's reader of a damaged file complains on stderr when it is collected: here nobody hears it
    hook, sys.unraisablehook = sys.unraisablehook, lambda _: None
    gc.collect()
    sys.unraisablehook = hook
    raise MeasurementError(message)


def _read(asammdf: ModuleType, path: Path) -> MeasurementTable:
    logging.getLogger("asammdf").setLevel(logging.ERROR)
    columns: dict[str, Column] = {}
    unusable: dict[str, str] = {}
    with path.open("rb") as stream, translate_errors(path, "MDF"), asammdf.MDF(stream) as file:
        for index, group in enumerate(file.groups):
            master = file.masters_db.get(index)
            for k, channel in enumerate(group.channels):
                if k == master:
                    continue
                column = _column(file, channel.name, index, k)
                if column is None:
                    unusable.setdefault(channel.name, "is not of numbers over time")
                elif channel.name in columns:
                    unusable[channel.name] = "is there in two groups; rename one of them"
                else:
                    columns[channel.name] = column
    duplicates = {name for name in unusable if name in columns and "two groups" in unusable[name]}
    usable = [c for name, c in columns.items() if name not in duplicates]
    if not usable:
        raise MeasurementError(f"{path}: has no channel of numbers over time")
    check_size(path, usable)
    reasons = {name: text for name, text in unusable.items() if name not in columns or name in duplicates}
    return MeasurementTable(path, with_short_names(usable), "s", None, None, reasons)


def _column(file: Any, name: str, group: int, index: int) -> Column | None:
    signal = file.get(name, group=group, index=index)
    values, time = as_floats(signal.samples), as_floats(signal.timestamps)
    if values is None or time is None or values.ndim != 1 or values.shape != time.shape:
        return None
    return Column(name, time, values, signal.unit or None)
