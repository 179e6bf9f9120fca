"""A run's file as time series on the model's clock, in SI; what cannot be used is told in one line, with its place."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from datetime import date, datetime, time
from pathlib import Path
from typing import Any, Literal

import numpy as np

from ...core.errors import UsageError, did_you_mean
from ...core.unit_names import named
from ...core.units import convert, unit
from ..measurements.clock import clock_jitter, jitters
from ..measurements.faulty_readings import find_faulty_readings
from ..measurements.missing_marks import is_mark, repeated_mark
from ..measurements.read_table import read_table
from ..measurements.table import Column, FloatArray, MeasurementError, MeasurementTable, TextFormat, TimeStamp
from ..measurements.time_stamps import comparable, from_toml, seconds_between
from ..settings import DEFAULT, FILE_LIMITS
from .campaign import CampaignError, Channel, si
from .tables import take

Series = dict[str, tuple[FloatArray, FloatArray]]
"""Times [s] and values [SI] by connector."""


@dataclass(frozen=True)
class FileFormat:
    """How a run's file is written and where the model's clock starts in it; None: to be found out."""

    text: TextFormat = field(default_factory=TextFormat)
    time_unit: str | None = None
    start: float | TimeStamp | Literal["first"] | None = None
    """Time of the file, in seconds or as a time stamp, that is 0 s of the model; "first": its first reading."""


def file_format(table: dict[str, Any], where: str, default: FileFormat | None = None) -> FileFormat:
    """The format in the keys of a table; those that it lacks are as usual. Raises `CampaignError`."""
    default = default or FileFormat()
    delimiter, decimal = default.text.delimiter, default.text.decimal
    if "delimiter" in table:
        delimiter = take.get(table, where, "delimiter", str)
        if len(delimiter) != 1 or delimiter.isalnum() or delimiter in "\"'+-.\n\r\0":
            raise CampaignError(
                f'{where}: delimiter = {delimiter!r} has to be one character such as ",", ";" or "\\t" that numbers '
                "do not have"
            )
    if "decimal" in table:
        decimal = take.get(table, where, "decimal", str)
        if decimal not in (".", ","):
            raise CampaignError(f"{where}: decimal = {decimal!r} is neither '.' nor ','")
    if decimal is not None and decimal == delimiter:
        raise CampaignError(f"{where}: delimiter and decimal are both '{decimal}'")
    form = replace(default, text=TextFormat(delimiter, decimal))
    if "time_unit" in table:
        form = replace(form, time_unit=_time_unit(take.get(table, where, "time_unit", str), where))
    return replace(form, start=_start(table["start"], where)) if "start" in table else form


def _time_unit(name: str, where: str) -> str:
    try:
        if unit(name).same_dimension(unit("s")):
            return name
    except UsageError:
        pass
    raise CampaignError(f"{where}: time_unit = '{name}' is no unit of time; there are s, ms, us, min and h")


def _start(value: Any, where: str) -> float | TimeStamp | Literal["first"]:
    if value == "first":
        return "first"
    if (stamp := from_toml(value)) is not None:
        return stamp
    if isinstance(value, (str, date, time, datetime)):
        raise CampaignError(
            f"{where}: start = '{value}' is neither seconds, a time stamp such as 2024-05-31T13:45:00 nor \"first\""
        )
    return take.number({"start": value}, where, "start")


def read_run_file(path: Path, channels: tuple[Channel, ...], form: FileFormat, warnings: list[str]) -> Series:
    """The series of the channels that the file has readings of; adds what is odd to the warnings."""
    try:
        table = read_table(path, form.text)
    except MeasurementError as error:
        raise CampaignError(str(error)) from None
    clocks: dict[int, FloatArray] = {}
    series: Series = {}
    for channel in channels:
        column = _column(table, channel)
        if id(column.time) not in clocks:
            clocks[id(column.time)] = _model_time(table, column.time, form, warnings)
            if any(c.role == "output" and c.clock_jitter is None for c in channels):
                _warn_of_jitter(table, clocks[id(column.time)], warnings)
        clock = clocks[id(column.time)]
        if (readings := _readings(table, column, clock, channel, warnings)) is not None:
            series[channel.connector] = readings
    series = _without_faulty(path, channels, series, warnings)
    for channel in channels:
        if channel.connector in series:
            _check_noise(path, channel, *series[channel.connector])
    return series


def _column(table: MeasurementTable, channel: Channel) -> Column:
    """The column of a channel, whose unit in the file, where it states one, has to be the campaign's."""
    column = table.columns.get(channel.column)
    if column is None:
        if channel.column in table.unusable:
            raise CampaignError(f"{table.file}: '{channel.column}' {table.unusable[channel.column]}")
        raise CampaignError(
            f"{table.file}: there is no column '{channel.column}'{did_you_mean(channel.column, table.names)}; "
            f"the file has {', '.join(['time', *table.names])}"
        )
    stated, expected = named(column.unit or ""), unit(channel.unit)
    if channel.scale == 1.0 and stated is not None and stated.same_dimension(expected):
        factor = abs(stated.factor / expected.factor - 1.0)
        if factor > 1e-6 or abs(stated.offset - expected.offset) > 1e-6 * max(abs(expected.offset), 1.0):
            raise CampaignError(
                f"{table.file}: '{channel.column}' is in {column.unit} there and in {channel.unit} in the campaign; "
                "one of both is wrong"
            )
    return column


def _model_time(table: MeasurementTable, raw: FloatArray, form: FileFormat, warnings: list[str]) -> FloatArray:
    """Times of the file (n,) as seconds on the model's clock, checked; those before its start are negative."""
    if len(raw) < FILE_LIMITS.min_samples:
        raise CampaignError(f"{table.file}: {len(raw)} samples; at least {FILE_LIMITS.min_samples} are needed")
    if not np.isfinite(raw).all():
        raise CampaignError(f"{table.place(int(np.argmin(np.isfinite(raw))))}: time is missing")
    seconds = raw * unit(_unit_of_time(table, form)).factor
    if (np.diff(seconds) <= 0).any():
        k = int(np.argmax(np.diff(seconds) <= 0)) + 1
        before, after = seconds[k - 1], seconds[k]
        remedy = "sort the rows" if after < before else "leave out the row, or write time with more digits"
        shown = f"{before:.15g} s, then {after:.15g} s"
        raise CampaignError(f"{table.place(k)}: time does not increase ({shown}); {remedy}")
    seconds = seconds - _start_in_file(table, seconds, form, warnings)
    _check_start(table, seconds, form, warnings)
    from_start = seconds[seconds >= 0.0]
    if len(from_start) < FILE_LIMITS.min_samples:
        needed = FILE_LIMITS.min_samples
        raise CampaignError(f"{table.file}: {len(from_start)} samples from 'start' on; at least {needed} are needed")
    gaps = np.diff(from_start)
    if gaps.max() > FILE_LIMITS.hole * np.median(gaps):
        at = from_start[int(np.argmax(gaps))]
        warnings.append(f"{table.file.name}: nothing was measured for {gaps.max():g} s after {at:g} s")
    return seconds


def _warn_of_jitter(table: MeasurementTable, seconds: FloatArray, warnings: list[str]) -> None:
    """Of a clock that is not even, on the model's clock (n,)."""
    used = seconds[seconds >= 0.0]
    if jitters(used):
        jitter = clock_jitter(used)
        warnings.append(
            f"{table.file.name}: its clock jitters by {jitter:.2g} s, {jitter / np.median(np.diff(used)):.1%} of a "
            "sample interval; its times are taken as they stand: 'clock_jitter' [s] of a channel says how far they may "
            "be off"
        )


def _unit_of_time(table: MeasurementTable, form: FileFormat) -> str:
    """The unit of the file's times: as the campaign says, or the file itself; else seconds."""
    stated = named(table.time_unit or "")
    if table.first_stamp is not None:
        if form.time_unit not in (None, "s"):
            raise CampaignError(f"{table.file}: has time stamps; time_unit = '{form.time_unit}' is for numbers")
        return "s"
    if stated is None or not stated.same_dimension(unit("s")):
        return form.time_unit or "s"
    if form.time_unit is not None and unit(form.time_unit).factor != stated.factor:
        raise CampaignError(
            f"{table.file}: time is in {table.time_unit} there, time_unit = '{form.time_unit}' in the campaign; one of "
            "both is wrong"
        )
    return next(name for name in ("s", "ms", "us", "min", "h", table.time_unit or "") if _same(name, stated.factor))


def _same(name: str, factor: float) -> bool:
    return abs(unit(name).factor / factor - 1.0) < 1e-9


def _start_in_file(table: MeasurementTable, seconds: FloatArray, form: FileFormat, warnings: list[str]) -> float:
    """Time in the file that is 0 s of the model [s]."""
    start, first = form.start, table.first_stamp
    if start is None:
        if first is not None:
            warnings.append(
                f"{table.file.name}: its first time stamp, {first}, is taken as 0 s of the model; 'start' says another"
            )
        return 0.0
    if start == "first":
        return float(seconds[0])
    if isinstance(start, (int, float)):
        return float(start)
    assert not isinstance(start, str)
    if first is None:
        raise CampaignError(f"{table.file}: start = {start} is a time stamp, but the file has times as numbers")
    if not comparable(first, start):
        raise CampaignError(
            f"{table.file}: start = {start} cannot be compared with its time stamps, the first of which is {first}: "
            "one of both lacks the date or the time zone"
        )
    return seconds_between(first, start)


def _check_start(table: MeasurementTable, seconds: FloatArray, form: FileFormat, warnings: list[str]) -> None:
    """Times that do not begin where the model does are told, unless the campaign says where that is.

    A clock that jitters may begin a little early: such a reading is left out.
    """
    first, length = float(seconds[0]), float(seconds[-1] - seconds[0])
    if form.start is not None:
        if seconds[-1] <= 0.0:
            raise CampaignError(f"{table.file}: ends {-seconds[-1]:g} s before 'start'")
        return
    remedy = f"start = {first:g} (or \"first\") makes this 0 s of the model, start = 0 says that it is the same clock"
    if first < -FILE_LIMITS.early_start * float(np.median(np.diff(seconds))):
        raise CampaignError(
            f"{table.file}: time starts at {first:g} s, before the model does; {remedy} and what is before is left out"
        )
    if first > FILE_LIMITS.start_elsewhere * length:
        raise CampaignError(f"{table.file}: time starts at {first:g} s and the run is {length:g} s long; {remedy}")
    if first > FILE_LIMITS.late_start * length:
        warnings.append(f"{table.file.name}: time starts at {first:g} s; {remedy}")


def _readings(
    table: MeasurementTable, column: Column, clock: FloatArray, channel: Channel, warnings: list[str]
) -> tuple[FloatArray, FloatArray] | None:
    """Times [s] and values [SI] of a channel, without what is missing; None where it was not measured."""
    path, raw = table.file, column.values
    if np.isinf(raw).any():
        raise CampaignError(f"{table.place(int(np.argmax(np.isinf(raw))))}: '{channel.column}' is infinite")
    valid = np.isfinite(raw) & (clock >= 0.0)
    if valid.sum() < FILE_LIMITS.min_samples:
        if valid.any():
            needed = FILE_LIMITS.min_samples
            raise CampaignError(f"{path}: '{channel.column}' has {valid.sum()} samples; {needed} are needed")
        missing = "the input '{}' drives nothing" if channel.role == "input" else "'{}' was not measured"
        warnings.append(f"{path.name}: {missing.format(channel.column)} in this run")
        return None
    with np.errstate(over="ignore"):
        values = convert(channel.scale * raw[valid], channel.unit, si(channel.unit))
    if not np.abs(values).max() <= FILE_LIMITS.largest_quantity:
        raise CampaignError(f"{path}: '{channel.column}' with scale = {channel.scale:g} is no quantity of a machine")
    if channel.role == "output" and np.ptp(values) == 0.0:
        warnings.append(f"{path.name}: '{channel.column}' is constant: a dead sensor?")
    elif channel.role == "input":
        _check_input(path, channel, clock[clock >= 0.0], clock[valid], warnings)
    return clock[valid], values


def _check_input(path: Path, channel: Channel, time: FloatArray, measured: FloatArray, warnings: list[str]) -> None:
    gaps, holes = np.diff(time), np.diff(measured)
    if max(measured[0] - time[0], time[-1] - measured[-1]) > FILE_LIMITS.hole * np.median(gaps):
        warnings.append(
            f"{path.name}: the input '{channel.column}' was measured from {measured[0]:g} s to {measured[-1]:g} s "
            "only; beyond, its nearest value is held"
        )
    if holes.max() > max(FILE_LIMITS.hole * np.median(gaps), 2 * gaps.max()):
        warnings.append(
            f"{path.name}: the input '{channel.column}' was not measured for {holes.max():g} s after "
            f"{measured[int(np.argmax(holes))]:g} s; a straight line is taken"
        )


def _without_faulty(path: Path, channels: tuple[Channel, ...], series: Series, warnings: list[str]) -> Series:
    """The series without readings that a sensor got wrong; single marks for missing values are left to the checks."""
    faults = find_faulty_readings(series, DEFAULT.faults)
    cleaned = dict(series)
    for channel in channels:
        if channel.connector not in series or channel.keep_faulty:
            continue
        t, values = series[channel.connector]
        read = convert(values, si(channel.unit), channel.unit) / channel.scale
        _check_marks(path, channel, t, read)
        kinds = faults[channel.connector].without(is_mark(read, DEFAULT.sanity.missing_marks))
        faulty = kinds.any
        if not faulty.any() or (~faulty).sum() < FILE_LIMITS.min_samples:
            continue
        cleaned[channel.connector] = t[~faulty], values[~faulty]
        counts = ", ".join(f"{n} {kind}" for kind, n in kinds.counts().items())
        warnings.append(
            f"{path.name}: '{channel.column}': {faulty.sum()} faulty readings are left out ({counts}; the first at "
            f"{t[int(np.argmax(faulty))]:g} s); faulty_readings = \"keep\" in the channel keeps them"
        )
    return cleaned


def _check_marks(path: Path, channel: Channel, t: FloatArray, read: FloatArray) -> None:
    """Readings of an output as the file has them hold no mark for missing values."""
    if channel.role != "output":
        return
    settings = DEFAULT.sanity
    mark = repeated_mark(read, settings.missing_marks, settings.repeated_marks, settings.marks_away)
    if mark is not None:
        marked = np.round(read, 6) == round(mark, 6)
        rest = read[~marked]
        raise CampaignError(
            f"{path}: '{channel.column}': {marked.sum()} readings are {mark:g} {channel.unit}, the first at "
            f"{t[int(np.argmax(marked))]:g} s, and all others {rest.min():.4g} to {rest.max():.4g} {channel.unit}; "
            'leave empty what was not measured, or say faulty_readings = "keep" in the channel'
        )


def _check_noise(path: Path, channel: Channel, times: FloatArray, values: FloatArray) -> None:
    """A stated noise, scatter or jitter has to be one that such readings can have."""
    span, noise = float(np.ptp(values)), channel.noise_std
    factor, where = unit(channel.unit).factor, f"{path}: '{channel.column}'"
    interval = float(np.median(np.diff(times)))
    if channel.clock_jitter is not None and channel.clock_jitter > min(
        FILE_LIMITS.most_jitter * interval, float(np.ptp(times))
    ):
        raise CampaignError(
            f"{where}: clock_jitter = {channel.clock_jitter:g} s is {channel.clock_jitter / interval:.3g} sample "
            "intervals; it is in seconds"
        )
    if channel.role == "input" or span == 0.0:
        return
    if channel.model_form_scatter is not None and channel.model_form_scatter > FILE_LIMITS.coarsest_scatter * span:
        scatter = f"model_form_scatter = {channel.model_form_scatter / factor:g} {channel.unit}"
        raise CampaignError(f"{where} moves by {span / factor:.3g} {channel.unit} in all; {scatter} would hide it")
    if noise is None:
        return
    shown = f"{noise / factor:g} {channel.unit}"
    k = int(np.argmax(np.abs(values)))
    largest = float(np.abs(values[k]))
    if noise < FILE_LIMITS.finest_noise * max(span, largest):
        usual = float(np.percentile(np.abs(values), 98.0))
        if largest < FILE_LIMITS.far_reading * usual:
            raise CampaignError(f"{where}: noise_std = {shown} is finer than any sensor")
        bad, most = (float(convert(np.array([x]), si(channel.unit), channel.unit)[0]) for x in (values[k], usual))
        raise CampaignError(
            f"{where}: {bad:.6g} {channel.unit} at {times[k]:g} s is impossible where nearly all others are within "
            f"{most:.4g} {channel.unit}; leave empty what was not measured"
        )
    if noise > FILE_LIMITS.coarsest_noise * span:
        raise CampaignError(
            f"{where} moves by {span / factor:.3g} {channel.unit} in all, and noise_std is stated as {shown}: in which "
            "unit is it?"
        )
