"""A campaign of measurements (campaign.toml and its run files), read and checked before anything is simulated.

See docs/gap.md for the format. Values are converted to SI as soon as they are read.
"""

from __future__ import annotations

import csv
from math import inf
from pathlib import Path
from typing import Any

import numpy as np

from ...core.errors import ParameterError, UsageError, did_you_mean
from ...core.repeated import repeated
from ...core.toml_tables import Tables
from ...core.units import convert, unit
from .campaign import Campaign, CampaignError, Channel, Event, Run, si

MOST = 1e100
"""No quantity of a machine is larger; its square still is a number."""

LATE = 0.2
"""Share of a run's length that time may start late without a word."""

BEYOND = 10.0
"""Times its length after which nothing of a run can have happened."""

FINEST, COARSEST = 1e-9, 10.0
"""A stated noise: as a share of a channel's level, below which no sensor gets; of its span, beyond which all is hid."""

MIN_SAMPLES = 20
"""Fewest samples of a channel in a run that a diagnosis can use."""


take = Tables(CampaignError)


_KNOWN = {
    "": ("name", "system", "effects", "channel", "run", "base"),
    "channel": ("column", "connector", "unit", "noise_std", "role"),
    "run": ("file", "parameters", "use", "event", "stop_time", "name"),
    "event": ("connector", "target", "within", "after", "until", "first", "std", "time", "at_most", "at_least"),
    "base": ("parameter", "tolerance"),
}


def _no_strangers(table: dict[str, Any], kind: str, where: str) -> None:
    take.no_strangers(table, _KNOWN[kind], where)


def channels_of(data: dict[str, Any], path: Path) -> tuple[Channel, ...]:
    """The channels of a campaign's or template's data, checked."""
    if "channel" not in data:
        raise CampaignError(f"{path}: 'channel' is missing")
    tables = take.tables(data, str(path), "channel")
    channels = tuple(_channel(t, f"{path}: channel {i}") for i, t in enumerate(tables, 1))
    for i, channel in enumerate(channels):
        for other in channels[:i]:
            if channel.column == other.column or channel.connector == other.connector:
                raise CampaignError(
                    f"{path}: channels '{other.column}' and '{channel.column}' share a column or connector"
                )
    if not any(c.role == "output" for c in channels):
        raise CampaignError(f"{path}: no channel has the role output; there is nothing to compare")
    return channels


def _channel(table: dict[str, Any], where: str) -> Channel:
    _no_strangers(table, "channel", where)
    column, connector, name = (take.get(table, where, key, str) for key in ("column", "connector", "unit"))
    where = f"{where} ('{column}')"
    try:
        factor = unit(name).factor
    except UsageError as error:
        raise CampaignError(f"{where}: {error}") from None
    role = table.get("role", "output")
    if role not in ("output", "input"):
        raise CampaignError(f"{where}: role = '{role}' is neither output nor input")
    if column.strip() in ("", "time"):
        raise CampaignError(f"{where}: '{column}' cannot be the column of a channel")
    noise = take.number(table, where, "noise_std") * factor if "noise_std" in table else None
    if noise is not None and not noise > 0.0:
        raise CampaignError(f"{where}: noise_std = {table['noise_std']!r} has to be a positive number in {name}")
    return Channel(column, connector, name, role, noise)


def _read_table(path: Path) -> tuple[list[str], np.ndarray, list[int]]:
    """Column names and numbers of a CSV file, and the line of each row; empty cells and nan are NaN."""
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:
            rows = csv.reader(file)
            names = [cell.strip() for cell in next(rows, [])]
            if (twice := repeated([n for n in names if n])) is not None:
                raise CampaignError(f"{path}: has two columns '{twice}'")
            for mark, what in ((";", "semicolons"), ("\t", "tabs")):
                if len(names) == 1 and mark in names[0]:
                    raise CampaignError(f"{path}: is separated by {what}; it needs commas, and points in numbers")
            data, lines = [], []
            for row in rows:
                line = rows.line_num
                if not row:
                    continue
                if len(row) != len(names):
                    raise CampaignError(f"{path}, line {line}: {len(row)} cells where the head has {len(names)}")
                try:
                    data.append([float(cell) if cell.strip() else np.nan for cell in row])
                    lines.append(line)
                except ValueError:
                    bad = next(cell for cell in row if cell.strip() and not _is_number(cell))
                    raise CampaignError(f"{path}, line {line}: '{bad}' is not a number") from None
                large = next((cell for cell, x in zip(row, data[-1], strict=True) if MOST < abs(x) < inf), None)
                if large is not None:
                    raise CampaignError(f"{path}, line {line}: {large} is no quantity of a machine")
    except OSError as error:
        raise CampaignError(f"{path}: cannot be read ({error.strerror})") from None
    except UnicodeDecodeError:
        raise CampaignError(f"{path}: is not a text file in UTF-8; save it as that") from None
    except csv.Error as error:
        raise CampaignError(f"{path}: is no table of numbers ({error})") from None
    if not names:
        raise CampaignError(f"{path}: is empty")
    return names, np.array(data, dtype=float).reshape(len(data), len(names)), lines


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True


def _run(table: dict[str, Any], where: str, folder: Path, channels: tuple[Channel, ...], warnings: list[str]) -> Run:
    _no_strangers(table, "run", where)
    events = tuple(_event(t, f"{where}, event {i}") for i, t in enumerate(take.tables(table, where, "event"), 1))
    parameters = take.get(table, where, "parameters", dict, {})
    for address, value in parameters.items():
        if not isinstance(value, (bool, int, float, str)):
            raise CampaignError(
                f"{where}: '{address}' = {value!r} has to be a number, a boolean or a string; "
                "an address with dots stands in quotes"
            )
    use = use_of(table, where)
    if events and "file" not in table:
        stop = take.number(table, where, "stop_time")
        if not stop > 0.0:
            raise CampaignError(f"{where}: stop_time = {stop:g} s has to be positive")
        _check_events(where, events, stop)
        name = take.get(table, where, "name", str, where.rpartition(": ")[2])
        return Run(name, dict(parameters), use, {}, stop, events)
    if "stop_time" in table:
        raise CampaignError(f"{where}: 'stop_time' is for runs without a file; this one ends with its file")
    path = take.file(table, where, "file", folder)
    names, data, lines = _read_table(path)
    if names[0] != "time":
        raise CampaignError(f"{path}: the first column is '{names[0]}'; it has to be 'time' in seconds")
    if len(data) < MIN_SAMPLES:
        raise CampaignError(f"{path}: {len(data)} samples; at least {MIN_SAMPLES} are needed")
    time = data[:, 0]
    if not np.isfinite(time).all():
        raise CampaignError(f"{path}, line {lines[int(np.argmin(np.isfinite(time)))]}: time is missing")
    if (np.diff(time) <= 0).any():
        k = int(np.argmax(np.diff(time) <= 0)) + 1
        before, after = time[k - 1], time[k]
        raise CampaignError(f"{path}, line {lines[k]}: time does not increase ({before:g} s, then {after:g} s)")
    if time[0] < 0:
        raise CampaignError(f"{path}: time starts at {time[0]:g} s; it has to start at 0 s, where the model starts")
    if time[0] > LATE * (time[-1] - time[0]):
        warnings.append(
            f"{path.name}: time starts at {time[0]:g} s; the model starts at 0 s: shift it, unless it is the same clock"
        )
    gaps = np.diff(time)
    if gaps.max() > 20 * np.median(gaps):
        at = time[int(np.argmax(gaps))]
        warnings.append(f"{path.name}: nothing was measured for {gaps.max():g} s after {at:g} s")
    series = {}
    for channel in channels:
        if channel.column not in names:
            raise CampaignError(
                f"{path}: there is no column '{channel.column}'{did_you_mean(channel.column, names)}; "
                f"the file has {', '.join(names)}"
            )
        raw = data[:, names.index(channel.column)]
        there = np.isfinite(raw)
        if np.isinf(raw).any():
            line = lines[int(np.argmax(np.isinf(raw)))]
            raise CampaignError(f"{path}, line {line}: '{channel.column}' is infinite")
        if there.sum() < MIN_SAMPLES:
            if there.any():
                raise CampaignError(f"{path}: '{channel.column}' has {there.sum()} samples; {MIN_SAMPLES} are needed")
            missing = "the input '{}' drives nothing" if channel.role == "input" else "'{}' was not measured"
            warnings.append(f"{path.name}: {missing.format(channel.column)} in this run")
            continue
        values = convert(raw[there], channel.unit, si(channel.unit))
        if channel.role == "output" and np.ptp(values) == 0.0:
            warnings.append(f"{path.name}: '{channel.column}' is constant: a dead sensor?")
        measured = time[there]
        if channel.role == "input" and max(measured[0] - time[0], time[-1] - measured[-1]) > 20 * np.median(gaps):
            warnings.append(
                f"{path.name}: the input '{channel.column}' was measured from {measured[0]:g} s to {measured[-1]:g} s "
                "only; beyond, its nearest value is held"
            )
        holes = np.diff(measured)
        if channel.role == "input" and holes.max() > max(20 * np.median(gaps), 2 * gaps.max()):
            warnings.append(
                f"{path.name}: the input '{channel.column}' was not measured for {holes.max():g} s after "
                f"{measured[int(np.argmax(holes))]:g} s; a straight line is taken"
            )
        _check_noise(path, channel, values)
        series[channel.connector] = (measured, values)
    moving = [c for c in channels if c.connector in series and np.ptp(series[c.connector][1]) > 0.0]
    if not moving:
        raise CampaignError(f"{path}: every channel is constant; there is nothing to learn from this run")
    if not any(c.role == "output" and c.connector in series for c in channels):
        raise CampaignError(f"{path}: no output channel was measured")
    _check_events(where, events, float(time[-1]))
    name = take.get(table, where, "name", str, path.stem)
    return Run(name, dict(parameters), use, series, float(time[-1]), events)


def _check_events(where: str, events: tuple[Event, ...], stop: float) -> None:
    """No moment lies far beyond the end of its run: it would be in another unit."""
    for i, e in enumerate(events, 1):
        reading = next(v for v in (e.time, e.at_most, e.at_least) if v is not None)
        if e.after + reading > BEYOND * stop:
            late = f"{e.after + reading:g} s is long after the run's end at {stop:g} s"
            raise CampaignError(f"{where}, event {i}: {late}: is it in seconds?")
        if e.after >= stop:
            raise CampaignError(f"{where}, event {i}: 'after' = {e.after:g} s, but the run ends at {stop:g} s")
    same: dict[tuple[Any, ...], list[Event]] = {}
    for e in events:
        same.setdefault((e.connector, e.target, e.within, e.after, e.until, e.first), []).append(e)
    for alike in same.values():
        soonest = max((v for e in alike for v in (e.time, e.at_least) if v is not None), default=-inf)
        latest = min((v for e in alike for v in (e.time, e.at_most) if v is not None), default=inf)
        slack = 6.0 * max(e.std for e in alike)
        if soonest > latest + slack:
            told = f"'{alike[0].connector}' cannot be there after {soonest:g} s at least and {latest:g} s at most"
            raise CampaignError(f"{where}: two events contradict each other: {told}")


def _check_noise(path: Path, channel: Channel, values: np.ndarray) -> None:
    """A stated noise has to be one that such readings can have."""
    span, noise = float(np.ptp(values)), channel.noise_std
    if channel.role == "input" or noise is None or span == 0.0:
        return
    factor = unit(channel.unit).factor
    shown, where = f"{noise / factor:g} {channel.unit}", f"{path}: '{channel.column}'"
    if noise < FINEST * max(span, float(np.abs(values).max())):
        raise CampaignError(f"{where}: noise_std = {shown} is finer than any sensor")
    if noise > COARSEST * span:
        raise CampaignError(
            f"{where} moves by {span / factor:.3g} {channel.unit} in all, and noise_std is stated as {shown}: in which "
            "unit is it?"
        )


def _event(table: dict[str, Any], where: str) -> Event:
    _no_strangers(table, "event", where)
    values = {key: take.number(table, where, key) for key in ("target", "within", "after", "std")}
    told = {key: take.number(table, where, key) for key in ("time", "at_most", "at_least") if key in table}
    if "until" in table:
        values["until"] = take.number(table, where, "until")
        if not values["until"] > values["after"]:
            raise CampaignError(f"{where}: 'until' has to be later than 'after'")
        for key in ("time", "at_least"):
            if told.get(key, 0.0) + values["after"] > values["until"]:
                raise CampaignError(f"{where}: '{key}' = {told[key]:g} s, counted from 'after', is later than 'until'")
    for key, value in {**told, "after": values["after"]}.items():
        if value < 0.0:
            raise CampaignError(f"{where}: '{key}' = {value:g} s is negative")
    if len(told) != 1:
        raise CampaignError(f"{where}: needs one of 'time', 'at_most' and 'at_least'")
    if not (values["std"] > 0.0 and values["within"] > 0.0):
        raise CampaignError(f"{where}: 'std' and 'within' have to be positive")
    first = take.get(table, where, "first", bool, False)
    return Event(take.get(table, where, "connector", str), **values, first=first, **told)


def read(path: Path) -> Campaign:
    """The campaign in a TOML file, checked. Raises `CampaignError` or `ParameterError`, one line each."""
    data = take.load(path)
    if "truth" in data:
        raise CampaignError(f"{path}: has a [truth]: it is a template; cosim-gap simulate makes a campaign of it")
    _no_strangers(data, "", str(path))
    folder = path.parent
    system = take.file(data, str(path), "system", folder)
    if not system.is_file():
        raise CampaignError(f"{path}: system = '{data['system']}': no such file")
    effects = take.file(data, str(path), "effects", folder) if "effects" in data else None
    tables = take.tables(data, str(path), "run")
    only_events = "channel" not in data and any("event" in t for t in tables)
    channels = () if only_events else channels_of(data, path)
    warnings: list[str] = []
    runs = tuple(_run(t, f"{path}: run {i}", folder, channels, warnings) for i, t in enumerate(tables, 1))
    if not runs:
        raise CampaignError(f"{path}: there are no runs")
    _distinguish(runs, tables, path)
    _find_duplicates(runs, warnings)
    base = base_of(data, path)
    name = take.get(data, str(path), "name", str, path.stem)
    return Campaign(name, system, effects, channels, runs, base, warnings, path)


def base_of(data: dict[str, Any], path: Path) -> dict[str, float]:
    """Tolerances of the base parameters, by name; raises `CampaignError` or `ParameterError`."""
    base: dict[str, float] = {}
    for i, table in enumerate(take.tables(data, str(path), "base"), 1):
        where = f"{path}: base {i}"
        _no_strangers(table, "base", where)
        tolerance = take.number(table, where, "tolerance")
        if not 0.0 <= tolerance < 1.0:
            raise ParameterError(f"{where}: tolerance = {tolerance:g} has to lie between 0 and 1")
        parameter = take.get(table, where, "parameter", str)
        if parameter in base:
            raise CampaignError(f"{where}: '{parameter}' is there twice")
        base[parameter] = tolerance
    return base


def use_of(table: dict[str, Any], where: str) -> str | None:
    """What a run is for; raises `CampaignError`."""
    use = table.get("use")
    if use not in (None, "fit", "holdout"):
        raise CampaignError(f"{where}: use = '{use}' is neither fit nor holdout")
    return use


def _distinguish(runs: tuple[Run, ...], tables: list[dict[str, Any]], path: Path) -> None:
    """Give runs of the same name that of their file with its folder; every run is told by its name."""
    names = [r.name for r in runs]
    for run, table in zip(runs, tables, strict=True):
        if names.count(run.name) > 1 and "name" not in table and "file" in table:
            run.name = str(Path(table["file"]).with_suffix("").as_posix())
    for run in runs:
        if [r.name for r in runs].count(run.name) > 1:
            raise CampaignError(f"{path}: two runs are called '{run.name}'; give them names of their own with 'name'")


def _find_duplicates(runs: tuple[Run, ...], warnings: list[str]) -> None:
    for i, a in enumerate(runs):
        for b in runs[:i]:
            shared = set(a.series) & set(b.series)
            if shared and all(
                len(a.series[c][1]) == len(b.series[c][1]) and np.array_equal(a.series[c][1], b.series[c][1])
                for c in shared
            ):
                warnings.append(f"runs '{b.name}' and '{a.name}' hold the same values: one is a copy")
