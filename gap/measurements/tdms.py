"""National Instruments' TDMS files (npTDMS): channels with waveform timing, or beside a channel called time."""

from __future__ import annotations

from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np

from ...core.unit_names import named
from ...core.units import UNITS
from .binary import as_floats, check_size, from_datetimes, library, translate_errors
from .table import Column, FloatArray, MeasurementError, MeasurementTable, is_time, with_short_names

UNIT_PROPERTIES = ("unit_string", "NI_UnitDescription")
"""Where LabVIEW and the DAQ drivers write a channel's unit."""


@dataclass(frozen=True)
class _Times:
    """Times (n,) of a group's channel of that name, in its unit, and the moment from which they count."""

    values: FloatArray
    unit: str | None = None
    """As the file states it."""
    origin: datetime | None = None


def read(path: Path) -> MeasurementTable:
    """The channels of a TDMS file; where two groups have one of the same name it is called `group/channel`.

    Channels that began at different moments are put on the clock of the first, and times in several units into seconds.
    """
    nptdms = library(path, "nptdms", "npTDMS")
    dated: list[tuple[Column, datetime | None]] = []
    time_units: list[str | None] = []
    unusable: dict[str, str] = {}
    with translate_errors(path, "TDMS"):
        file = nptdms.TdmsFile.read(path)
        names = [channel.name for group in file.groups() for channel in group.channels()]
        for group in file.groups():
            group_times = _times_of_group(group)
            for channel in (c for c in group.channels() if not is_time(c.name)):
                name = channel.name if names.count(channel.name) == 1 else f"{group.name}/{channel.name}"
                values, times = as_floats(channel[:]), _times_of_channel(channel, group_times)
                if values is None:
                    unusable[name] = "is not of numbers"
                elif times is None:
                    unusable[name] = "has no times: neither waveform timing nor a channel 'time' of the same length"
                else:
                    dated.append((Column(name, times.values, values, _unit(channel)), times.origin))
                    time_units.append(times.unit)
    if not dated:
        reason = next((f"'{name}' {why}" for name, why in unusable.items()), "it has no channels")
        raise MeasurementError(f"{path}: no channel can be used: {reason}")
    if len(set(time_units)) > 1:
        dated = [(_in_seconds(path, c, unit), origin) for (c, origin), unit in zip(dated, time_units, strict=True)]
        time_units = ["s"]
    columns, first = _on_one_clock(dated)
    check_size(path, columns)
    return MeasurementTable(path, with_short_names(columns), time_units[0], first, None, unusable)


def _in_seconds(path: Path, column: Column, stated: str | None) -> Column:
    """A column whose times others do not share the unit of."""
    if (unit := named(stated or "")) is None or not unit.same_dimension(UNITS["s"]):
        of = f"in '{stated}'" if stated else "in no unit that is told"
        raise MeasurementError(
            f"{path}: the times of '{column.name}' are {of}, those of other channels in another: state the unit of "
            f"every channel 'time' (property {UNIT_PROPERTIES[0]}), such as s or ms"
        )
    return replace(column, time=unit.factor * column.time)


def _on_one_clock(dated: list[tuple[Column, datetime | None]]) -> tuple[list[Column], datetime | None]:
    """Columns with times since the earliest origin; as they are where one of them tells none."""
    origins = [origin for _, origin in dated if origin is not None]
    if len(origins) < len(dated):
        return [column for column, _ in dated], None
    first = min(origins)
    shifts = [(origin - first).total_seconds() for origin in origins]
    return [replace(c, time=c.time + shift) if shift else c for (c, _), shift in zip(dated, shifts, strict=True)], first


def _times_of_group(group: Any) -> _Times | None:
    channel = next((c for c in group.channels() if is_time(c.name)), None)
    if channel is None or not len(channel):
        return None
    raw = np.asarray(channel[:])
    if raw.dtype.kind == "M":
        time, first = from_datetimes(raw)
        return _Times(time, "s", first)
    values = as_floats(raw)
    return None if values is None else _Times(values, _unit(channel))


def _times_of_channel(channel: Any, group_times: _Times | None) -> _Times | None:
    """Times from the group's channel, or from the waveform properties of the channel itself."""
    if group_times is not None and len(group_times.values) == len(channel):
        return group_times
    interval = channel.properties.get("wf_increment")
    if not interval:
        return None
    start = float(channel.properties.get("wf_start_offset", 0.0))
    origin = channel.properties.get("wf_start_time")
    moment = np.datetime64(origin).astype("datetime64[us]").item() if origin is not None else None
    steps: FloatArray = np.arange(len(channel), dtype=np.float64)
    return _Times(start + float(interval) * steps, "s", moment)


def _unit(channel: Any) -> str | None:
    return next((str(channel.properties[key]) for key in UNIT_PROPERTIES if channel.properties.get(key)), None)
