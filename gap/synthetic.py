"""Makes a synthetic campaign from a scenario with chosen effects switched on, for examples and for planning.

The template is a campaign.toml whose runs need not exist yet. Beyond the campaign's own keys it has

    [truth]                 what the machine has and the campaign does not tell: addresses and values, and sensors as
                            "sensor.<connector>.<bias|scale|lag|delay|drift|...>" (SI)
    [[run]] stop_time       end of the run [s]; default: the scenario's
    [[run]] rate            samples a second; default 100
    seed                    of the noise; default 0

Written are campaign.toml, the run files and, apart from them, answer.toml with the truth. A machine has no macro step:
the readings are what runs at `SyntheticSettings.step` and at twice that tend to.
"""

from __future__ import annotations

import csv
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..core.files import make_folder, replacing
from ..core.units import convert, unit
from ..master.simulation.session import Session
from .campaign.campaign import CampaignError, Channel, si, unit_in_fmu
from .campaign.keys import QUANTITIES, SHAPES
from .campaign.read import base_of, channels_of, take, use_of
from .problem.parameters import sensor_quantity
from .problem.sensors import Sensor
from .settings import FILE_LIMITS, SyntheticSettings

SETTINGS = SyntheticSettings()


def _sensors(truth: dict[str, Any], channels: tuple[Channel, ...], where: str) -> dict[str, Sensor]:
    """Sensors by connector, from the truth's sensor entries."""
    connectors = {c.connector for c in channels}
    quantities: dict[str, dict[str, float]] = {}
    for address in truth:
        if address.startswith("sensor."):
            connector, quantity = sensor_quantity(address)
            if connector not in connectors or quantity not in (*QUANTITIES, *SHAPES):
                raise CampaignError(f"{where}: truth: '{address}' names no channel or none of {', '.join(QUANTITIES)}")
            value = take.number(truth, f"{where}: truth", address)
            if (quantity in ("lag", "delay") and value < 0.0) or (quantity == "scale" and value == 0.0):
                raise CampaignError(f"{where}: truth: '{address}' = {value:g}: no sensor has such a {quantity}")
            quantities.setdefault(connector, {})[quantity] = value
    return {connector: Sensor(**values) for connector, values in quantities.items()}


def _toml(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, dict):
        return _table(value)
    if isinstance(value, str):
        return '"' + value.replace("\\", "\\\\").replace('"', '\\"') + '"'
    return repr(value)


def _table(values: dict[str, Any]) -> str:
    return "{ " + ", ".join(f'"{key}" = {_toml(value)}' for key, value in values.items()) + " }"


def _converged(
    session: Session, record: list[str], stop: float, parameters: dict[str, Any]
) -> tuple[np.ndarray, np.ndarray]:
    """(times (n,), signals (n, k)) of a run without the macro step's error of first order, at every second step."""
    t, double = session.run(record, stop, 2.0 * SETTINGS.step, parameters)
    fine, single = session.run(record, stop, SETTINGS.step, parameters)
    return t, np.stack([2.0 * np.interp(t, fine, y) - z for y, z in zip(single.T, double.T, strict=True)], axis=1)


def _check_files(template: Path, runs: list[dict[str, Any]]) -> None:
    """Each run has a file of its own in the campaign's folder."""
    names = [take.get(run, f"{template}: run {i}", "file", str) for i, run in enumerate(runs, 1)]
    for i, name in enumerate(names, 1):
        if Path(name).name != name or not name.strip() or "\0" in name:
            raise CampaignError(f"{template}: run {i}: file = {name!r} has to be the name of a file, without folders")
        if name in ("campaign.toml", "answer.toml") or name in names[: i - 1]:
            raise CampaignError(f"{template}: run {i}: file = '{name}' is written for something else already")


def _check_folder(template: Path, folder: Path, files: list[str]) -> None:
    """What is there is replaced only where an earlier call has made it, which leaves an answer.toml."""
    for name in ("campaign.toml", "answer.toml", *files):
        target = folder / name
        if target.exists() and (target.samefile(template) or not (folder / "answer.toml").is_file()):
            raise CampaignError(f"{target}: is there already and would be replaced; choose another folder with --out")


@dataclass(frozen=True)
class _PlannedRun:
    """A run of the template."""

    file: str
    parameters: dict[str, Any]
    use: str | None
    stop: float
    rate: float

    @property
    def times(self) -> np.ndarray:
        """Times of the samples [s]."""
        return np.arange(round(self.stop * self.rate) + 1) / self.rate


def _plan_run(run: dict[str, Any], where: str, ends: float | None) -> _PlannedRun:
    take.reject_unknown_keys(run, ("file", "parameters", "use", "stop_time", "rate"), where)
    stop = take.number(run, where, "stop_time", ends or 1.0)
    rate = take.number(run, where, "rate", SETTINGS.rate)
    if not (stop > 0.0 and rate > 0.0):
        raise CampaignError(f"{where}: 'stop_time' and 'rate' have to be positive")
    if stop * rate > SETTINGS.max_samples:
        raise CampaignError(f"{where}: {stop * rate:.1e} samples are more than {SETTINGS.max_samples:.0e}")
    if stop * rate < FILE_LIMITS.min_samples - 1:
        raise CampaignError(f"{where}: {stop * rate:.3g} samples; a diagnosis needs {FILE_LIMITS.min_samples}")
    parameters = take.get(run, where, "parameters", dict, {})
    return _PlannedRun(take.get(run, where, "file", str), parameters, use_of(run, where), stop, rate)


def _seed(data: dict[str, Any], template: Path) -> int:
    seed: int = take.get(data, str(template), "seed", int, 0)
    if seed < 0 or isinstance(seed, bool):
        raise CampaignError(f"{template}: seed = {seed} has to be 0 or more")
    return seed


def make(template: Path, folder: Path, say: Callable[[str], None] = lambda text: None) -> Path:
    """Run the template's scenario and write the campaign into `folder`; returns its campaign.toml."""
    data = take.load(template)
    keys = "name", "system", "effects", "channel", "run", "base", "truth", "seed"
    take.reject_unknown_keys(data, keys, str(template))
    package = take.file(data, str(template), "system", template.parent)
    if not package.is_file():
        raise CampaignError(f"{template}: system = '{data['system']}': no such file")
    channels = channels_of(data, template)
    for c in channels:
        if c.role == "input":
            raise CampaignError(f"{template}: channel '{c.column}': a template has no channels that drive the model")
    truth = take.get(data, str(template), "truth", dict, {})
    sensors = _sensors(truth, channels, str(template))
    if not truth:
        say("[truth] is empty: the machine is the model as delivered, with noise")
    hidden = {address: value for address, value in truth.items() if not address.startswith("sensor.")}
    for address, value in hidden.items():
        if isinstance(value, (int, float)) and not isinstance(value, bool):
            take.number(hidden, f"{template}: truth", address)
    seed = _seed(data, template)
    tables = take.tables(data, str(template), "run")
    if not tables:
        raise CampaignError(f"{template}: there are no runs")
    _check_files(template, tables)
    _check_folder(template, folder, [run["file"] for run in tables])
    base_of(data, template)
    head = _head(data, template, package, channels)
    with Session(package) as session:
        names = session.system.units()
        for c in channels:
            names |= unit_in_fmu(c, names, f"{template}: channel '{c.column}'")
        runs = [_plan_run(t, f"{template}: run {i}", session.structure.stop_time) for i, t in enumerate(tables, 1)]
        for run in runs:
            session.values({**run.parameters, **hidden})
        make_folder(folder)
        with replacing(folder / "answer.toml") as part:
            answer = "[truth]\n" + "".join(f'"{k}" = {_toml(v)}\n' for k, v in truth.items())
            part.write_text(answer, encoding="utf-8")
        rng = np.random.default_rng(seed)
        for run in runs:
            t, rows = _converged(session, [c.connector for c in channels], run.stop, {**run.parameters, **hidden})
            columns = [run.times]
            for k, c in enumerate(channels):
                signal = convert(rows[:, k], names[c.connector], si(c.unit))
                y = sensors.get(c.connector, Sensor()).observe(t, signal, run.times)
                y = y + rng.normal(0.0, c.noise_std or 0.0, len(y))
                columns.append((y - unit(c.unit).offset) / unit(c.unit).factor)
                if not np.abs(columns[-1]).max() <= FILE_LIMITS.largest_quantity:
                    raise CampaignError(f"{template}: channel '{c.column}': its readings are no quantity of a machine")
            with replacing(folder / run.file) as part, part.open("w", newline="", encoding="utf-8") as file:
                writer = csv.writer(file)
                writer.writerow(["time", *(c.column for c in channels)])
                writer.writerows([f"{v:.9g}" for v in row] for row in np.column_stack(columns))
            say(f"{folder / run.file}  {len(columns[0])} samples")
    target = folder / "campaign.toml"
    with replacing(target) as part:
        part.write_text("\n".join([*head, *_tail(data, runs)]) + "\n", encoding="utf-8")
    say(str(target))
    return target


def _head(data: dict[str, Any], template: Path, package: Path, channels: tuple[Channel, ...]) -> list[str]:
    """Lines of the campaign's name, package, catalogue and channels."""
    lines = [f"name = {_toml(str(data.get('name', template.stem)))}", f"system = {_toml(str(package.resolve()))}"]
    if "effects" in data:
        lines.append(f"effects = {_toml(str(take.file(data, str(template), 'effects', template.parent).resolve()))}")
    for c in channels:
        lines += ["", "[[channel]]", f"column = {_toml(c.column)}", f"connector = {_toml(c.connector)}"]
        lines.append(f"unit = {_toml(c.unit)}")
        if c.noise_std is not None:
            lines.append(f"noise_std = {c.noise_std / unit(c.unit).factor!r}")
        if c.keep_faulty:
            lines.append('faulty_readings = "keep"')
        if c.clock_jitter is not None:
            lines.append(f"clock_jitter = {c.clock_jitter!r}")
        if c.model_form_scatter is not None:
            lines.append(f"model_form_scatter = {c.model_form_scatter / unit(c.unit).factor!r}")
    return lines


def _tail(data: dict[str, Any], runs: list[_PlannedRun]) -> list[str]:
    """Lines of the campaign's runs and base parameters."""
    lines = []
    for run in runs:
        lines += ["", "[[run]]", f"file = {_toml(run.file)}"]
        if run.parameters:
            lines.append(f"parameters = {_table(run.parameters)}")
        if run.use is not None:
            lines.append(f"use = {_toml(run.use)}")
    for base in data.get("base", []):
        lines += ["", "[[base]]", *(f"{key} = {_toml(value)}" for key, value in base.items())]
    return lines
