"""A campaign of measurements (campaign.toml and its run files), read and checked before anything is simulated.

See docs/gap.md for the format. Values are converted to SI as soon as they are read.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ...core.errors import ParameterError, UsageError
from ...core.repeated import repeated
from ...core.units import unit
from ..settings import FILE_LIMITS
from .campaign import BaseTolerance, Campaign, CampaignError, Channel, FactorTolerance, Run
from .duplicates import copies, distinguish
from .events import check_events, read_event
from .keys import FACTOR
from .limits import check_amount
from .run_files import FileFormat, file_format, read_run_file
from .tables import reject_unknown_keys, take

__all__ = ["CampaignError", "base_of", "channels_of", "read", "take", "use_of"]


def channels_of(data: dict[str, Any], path: Path) -> tuple[Channel, ...]:
    """The channels of a campaign's or template's data, checked."""
    if "channel" not in data:
        raise CampaignError(f"{path}: 'channel' is missing")
    tables = take.tables(data, str(path), "channel")
    channels = tuple(_channel(t, f"{path}: channel {i}") for i, t in enumerate(tables, 1))
    of_column: dict[str, Channel] = {}
    of_connector: dict[str, Channel] = {}
    for channel in channels:
        other = of_column.setdefault(channel.column, channel)
        other = of_connector.setdefault(channel.connector, channel) if other is channel else other
        if other is not channel:
            raise CampaignError(f"{path}: channels '{other.column}' and '{channel.column}' share a column or connector")
    if not any(c.role == "output" for c in channels):
        raise CampaignError(f"{path}: no channel has the role output; there is nothing to compare")
    return channels


def _channel(table: dict[str, Any], where: str) -> Channel:
    reject_unknown_keys(table, "channel", where)
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
    jitter = take.number(table, where, "clock_jitter") if "clock_jitter" in table else None
    if jitter is not None and not jitter >= 0.0:
        raise CampaignError(f"{where}: clock_jitter = {jitter:g} s is negative")
    scatter = take.number(table, where, "model_form_scatter") * factor if "model_form_scatter" in table else None
    if scatter is not None and not scatter >= 0.0:
        raise CampaignError(f"{where}: model_form_scatter = {table['model_form_scatter']!r} {name} is negative")
    faulty = table.get("faulty_readings", "leave_out")
    if faulty not in ("leave_out", "keep"):
        raise CampaignError(f"{where}: faulty_readings = {faulty!r} is neither leave_out nor keep")
    scale = take.number(table, where, "scale", 1.0)
    if scale == 0.0:
        raise CampaignError(f"{where}: scale = 0 would leave nothing of the readings")
    return Channel(column, connector, name, role, noise, jitter, scatter, faulty == "keep", scale)


def _run(
    table: dict[str, Any], where: str, folder: Path, channels: tuple[Channel, ...], default: FileFormat,
    warnings: list[str],
) -> Run:  # fmt: skip
    events = tuple(read_event(t, f"{where}, event {i}") for i, t in enumerate(take.tables(table, where, "event"), 1))
    parameters = take.get(table, where, "parameters", dict, {})
    for address, value in parameters.items():
        if not isinstance(value, (bool, int, float, str)):
            raise CampaignError(
                f"{where}: '{address}' = {value!r} has to be a number, a boolean or a string; "
                "an address with dots stands in quotes"
            )
    use, form = use_of(table, where), file_format(table, where, default)
    if events and "file" not in table:
        stop = take.number(table, where, "stop_time")
        if not stop > 0.0:
            raise CampaignError(f"{where}: stop_time = {stop:g} s has to be positive")
        check_events(where, events, stop)
        name = take.label(table, where, "name", where.rpartition(": ")[2])
        return Run(name, dict(parameters), use, {}, stop, events)
    if "stop_time" in table:
        raise CampaignError(f"{where}: 'stop_time' is for runs without a file; this one ends with its file")
    path = take.file(table, where, "file", folder)
    series = read_run_file(path, channels, form, warnings)
    moving = [c for c in channels if c.connector in series and np.ptp(series[c.connector][1]) > 0.0]
    if not moving:
        raise CampaignError(f"{path}: every channel is constant; there is nothing to learn from this run")
    if not any(c.role == "output" and c.connector in series for c in channels):
        raise CampaignError(f"{path}: no output channel was measured")
    last = max(float(t[-1]) for t, _ in series.values())
    check_events(where, events, last)
    name = take.label(table, where, "name", path.stem)
    return Run(name, dict(parameters), use, series, last, events, form.time_unit, path)


def read(path: Path) -> Campaign:
    """The campaign in a TOML file, checked. Raises `CampaignError` or `ParameterError`, one line each."""
    data = take.load(path)
    if "truth" in data:
        raise CampaignError(f"{path}: has a [truth]: it is a template; cosim-gap simulate makes a campaign of it")
    reject_unknown_keys(data, "", str(path))
    folder = path.parent
    system = take.file(data, str(path), "system", folder)
    if not system.is_file():
        raise CampaignError(f"{path}: system = '{data['system']}': no such file")
    effects = take.file(data, str(path), "effects", folder) if "effects" in data else None
    tables = take.tables(data, str(path), "run")
    only_events = "channel" not in data and any("event" in t for t in tables)
    channels = () if only_events else channels_of(data, path)
    check_amount(data, path)
    warnings: list[str] = []
    default = file_format(data, str(path))
    runs = tuple(_run(t, f"{path}: run {i}", folder, channels, default, warnings) for i, t in enumerate(tables, 1))
    if not runs:
        raise CampaignError(f"{path}: there are no runs")
    distinguish(runs, tables, path)
    for first, again in copies(runs, {c.connector for c in channels if c.role == "output"}):
        warnings.append(f"runs '{first.name}' and '{again.name}' hold the same values: one is a copy")
    base = base_of(data, path)
    name = take.label(data, str(path), "name", path.stem)
    return Campaign(name, system, effects, channels, runs, base, warnings, path, _accepted(data, path))


def _accepted(data: dict[str, Any], path: Path) -> tuple[str, ...]:
    """The ids of the effects that are taken as known; whether the catalogue has them is seen with it."""
    accepted = take.strings(data, str(path), "accept")
    if (duplicate := repeated(accepted)) is not None:
        raise CampaignError(f"{path}: accept: '{duplicate}' is there twice")
    if not all(id.strip() for id in accepted):
        raise CampaignError(f"{path}: accept: an effect's name is empty")
    return accepted


def base_of(data: dict[str, Any], path: Path) -> dict[str, BaseTolerance]:
    """Tolerances of the base parameters, by name; raises `CampaignError` or `ParameterError`."""
    base: dict[str, BaseTolerance] = {}
    for i, table in enumerate(take.tables(data, str(path), "base"), 1):
        where = f"{path}: base {i}"
        reject_unknown_keys(table, "base", where)
        tolerance = _tolerance(table, where)
        parameter = take.get(table, where, "parameter", str)
        if parameter in base:
            raise CampaignError(f"{where}: '{parameter}' is there twice")
        base[parameter] = tolerance
    return base


def _tolerance(table: dict[str, Any], where: str) -> BaseTolerance:
    if isinstance(table.get("tolerance"), dict):
        take.reject_unknown_keys(table["tolerance"], FACTOR, f"{where}: tolerance")
        factor = take.number(table["tolerance"], f"{where}: tolerance", "factor")
        if not 1.0 < factor <= FILE_LIMITS.largest_factor:
            allowed = f"has to be above 1, {FILE_LIMITS.largest_factor:g} at most"
            raise ParameterError(f"{where}: tolerance: factor = {factor:g} {allowed}")
        return FactorTolerance(factor)
    tolerance = take.number(table, where, "tolerance")
    if not 0.0 <= tolerance < 1.0:
        remedy = f"; what is known worse has a factor: {{ factor = {1.0 + tolerance:g} }}" if tolerance > 0.0 else ""
        raise ParameterError(f"{where}: tolerance = {tolerance:g} has to lie between 0 and 1{remedy}")
    return tolerance


def use_of(table: dict[str, Any], where: str) -> str | None:
    """What a run is for; raises `CampaignError`."""
    use = table.get("use")
    if use not in (None, "fit", "holdout"):
        raise CampaignError(f"{where}: use = '{use}' is neither fit nor holdout")
    return use
