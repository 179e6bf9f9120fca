"""The catalogue of effects (effects.toml): what a real system may have that its model lacks, as parameters.

    [[effect]]                      [[effect.parameter]]                [[base]]
    id, text, group                 address, neutral, bounds, prior     parameter, tolerance
                                    also, shape, starts

    [[sensor]]
    id, text, group, quantity (bias, scale, lag, delay), neutral, bounds, prior

    [[region]]                      [[experiment]]                      [[measurable]]
    text, signal                    parameter, values                   connector, noise_std
    above, below, rate, size

    [estimation]
    parameters = {address = value}: settings for runs at longer steps than the package's, a solver's tolerance

A third party makes its own effects known to the diagnosis by writing such a file for its own FMU.
"""

from __future__ import annotations

import tomllib
from dataclasses import dataclass, field
from math import inf
from pathlib import Path
from typing import Any

import numpy as np

from ..core.errors import PackageError

PACKED = "resources/effects.toml"
"""Where the catalogue lies in an .ssp."""

QUANTITIES = ("bias", "scale", "lag", "delay")


@dataclass(frozen=True)
class Parameter:
    """One parameter of an effect: set at `address` (and at every one of `also`); exactly absent at `neutral`.

    A `shape` parameter has no effect of its own while the others of its effect are neutral.
    """

    address: str
    neutral: float
    low: float
    high: float
    prior: float
    also: tuple[str, ...] = ()
    shape: bool = False
    starts: tuple[float, ...] = ()
    """Of a shape: values from which a fit starts; empty: the neutral one."""

    def values(self, value: float) -> dict[str, float]:
        """`value` at every address."""
        return dict.fromkeys((self.address, *self.also), value)


@dataclass(frozen=True)
class Effect:
    """A candidate cause."""

    id: str
    text: str
    group: str
    parameters: tuple[Parameter, ...]

    @property
    def main(self) -> Parameter:
        """The parameter that says how strong the effect is."""
        return next(p for p in self.parameters if not p.shape)


@dataclass(frozen=True)
class Sensor:
    """An effect of a measurement, possible in every channel."""

    id: str
    text: str
    group: str
    quantity: str
    neutral: float
    low: float
    high: float
    prior: float


@dataclass(frozen=True)
class Base:
    """A parameter that is known only within a relative tolerance."""

    parameter: str
    tolerance: float


@dataclass(frozen=True)
class Region:
    """A part of a run in which a gap may lie: where a signal (or its rate) is above or below a value."""

    text: str
    signal: str
    above: float = -inf
    below: float = inf
    rate: bool = False
    size: bool = False
    """The signal's magnitude counts."""

    def holds(self, x: np.ndarray) -> np.ndarray:
        """Mask of the samples x (n,) in the region."""
        x = np.abs(x) if self.size else x
        return (x > self.above) & (x < self.below)


@dataclass(frozen=True)
class Experiment:
    """A condition that a further run could change, and the values it could take."""

    parameter: str
    values: tuple[float, ...]


@dataclass(frozen=True)
class Measurable:
    """A connector that could be measured, and the noise that a usual sensor has there, in the FMU's unit."""

    connector: str
    noise_std: float


@dataclass(frozen=True)
class Catalogue:
    """Effects, sensor effects and uncertain base parameters of a system; regions, and what could be measured next."""

    effects: tuple[Effect, ...]
    sensors: tuple[Sensor, ...] = ()
    base: tuple[Base, ...] = ()
    regions: tuple[Region, ...] = ()
    experiments: tuple[Experiment, ...] = ()
    measurables: tuple[Measurable, ...] = ()
    estimation: dict[str, Any] = field(default_factory=dict)
    """Settings of the runs at longer steps than the package's, by address."""

    def effect(self, id: str) -> Effect | None:
        """The effect of that id."""
        return next((e for e in self.effects if e.id == id), None)


class _Reader:
    """Takes values out of tables, with errors that name file and entry."""

    def __init__(self, shown: str):
        self.shown = shown

    def fault(self, entry: str, text: str) -> PackageError:
        return PackageError(f"{self.shown}: {entry}: {text}")

    def get(self, table: dict[str, Any], entry: str, key: str, kind: type | tuple[type, ...]) -> Any:
        if key not in table:
            raise self.fault(entry, f"'{key}' is missing")
        value = table[key]
        if not isinstance(value, kind) or (isinstance(value, bool) and kind is not bool):
            raise self.fault(entry, f"'{key}' = {value!r} has the wrong type")
        return value

    def range(self, table: dict[str, Any], entry: str) -> tuple[float, float, float, float]:
        number = (int, float)
        neutral, prior = (float(self.get(table, entry, key, number)) for key in ("neutral", "prior"))
        bounds = self.get(table, entry, "bounds", list)
        if len(bounds) != 2 or not all(isinstance(b, number) for b in bounds) or not bounds[0] < bounds[1]:
            raise self.fault(entry, f"'bounds' = {bounds} has to be two numbers, the lower first")
        if not bounds[0] <= neutral <= bounds[1]:
            raise self.fault(entry, f"'neutral' = {neutral:g} lies outside the bounds {bounds}")
        if not prior > 0.0:
            raise self.fault(entry, f"'prior' = {prior:g} has to be positive")
        return neutral, float(bounds[0]), float(bounds[1]), prior

    def parameter(self, table: dict[str, Any], entry: str) -> Parameter:
        address = self.get(table, entry, "address", str)
        also = tuple(table.get("also", ()))
        neutral, low, high, prior = self.range(table, f"{entry}, {address}")
        starts = table.get("starts", [])
        if not isinstance(starts, list) or not all(isinstance(v, (int, float)) and low <= v <= high for v in starts):
            raise self.fault(f"{entry}, {address}", f"'starts' = {starts} has to be numbers within the bounds")
        shape = bool(table.get("shape", False))
        return Parameter(address, neutral, low, high, prior, also, shape, tuple(map(float, starts)))


def parse(text: str, shown: str = "effects.toml") -> Catalogue:
    """The catalogue in a TOML text; `PackageError` names the entry that is wrong."""
    try:
        data = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise PackageError(f"{shown}: not valid TOML ({error})") from None
    reader = _Reader(shown)
    effects = []
    for i, table in enumerate(data.get("effect", []), 1):
        entry = f"effect {table.get('id', i)}"
        parameters = tuple(reader.parameter(p, entry) for p in reader.get(table, entry, "parameter", list))
        if not any(not p.shape for p in parameters):
            raise reader.fault(entry, "has no parameter that is not a shape")
        names = (reader.get(table, entry, key, str) for key in ("id", "text", "group"))
        effects.append(Effect(*names, parameters))
    sensors = []
    for i, table in enumerate(data.get("sensor", []), 1):
        entry = f"sensor {table.get('id', i)}"
        names = [reader.get(table, entry, key, str) for key in ("id", "text", "group", "quantity")]
        if names[3] not in QUANTITIES:
            raise reader.fault(entry, f"'quantity' = '{names[3]}' is none of {', '.join(QUANTITIES)}")
        sensors.append(Sensor(*names, *reader.range(table, entry)))
    base = []
    for i, table in enumerate(data.get("base", []), 1):
        entry = f"base {table.get('parameter', i)}"
        tolerance = float(reader.get(table, entry, "tolerance", (int, float)))
        if not 0.0 < tolerance < 1.0:
            raise reader.fault(entry, f"'tolerance' = {tolerance:g} has to lie between 0 and 1")
        base.append(Base(reader.get(table, entry, "parameter", str), tolerance))
    regions = tuple(_region(t, reader, i) for i, t in enumerate(data.get("region", []), 1))
    experiments, measurables = [], []
    for i, table in enumerate(data.get("experiment", []), 1):
        entry = f"experiment {table.get('parameter', i)}"
        values = reader.get(table, entry, "values", list)
        if not values or not all(isinstance(v, (int, float)) for v in values):
            raise reader.fault(entry, f"'values' = {values} has to be a list of numbers")
        experiments.append(Experiment(reader.get(table, entry, "parameter", str), tuple(map(float, values))))
    for i, table in enumerate(data.get("measurable", []), 1):
        entry = f"measurable {table.get('connector', i)}"
        noise = float(reader.get(table, entry, "noise_std", (int, float)))
        if not noise > 0.0:
            raise reader.fault(entry, f"'noise_std' = {noise:g} has to be positive")
        measurables.append(Measurable(reader.get(table, entry, "connector", str), noise))
    estimation = {}
    if "estimation" in data:
        estimation = reader.get(data["estimation"], "estimation", "parameters", dict)
    ids = [e.id for e in (*effects, *sensors)]
    for id in ids:
        if ids.count(id) > 1:
            raise reader.fault(f"effect {id}", "is listed twice")
    if not effects and not sensors:
        raise PackageError(f"{shown}: holds no effects")
    return Catalogue(
        tuple(effects), tuple(sensors), tuple(base), regions, tuple(experiments), tuple(measurables), estimation
    )  # fmt: skip


def _region(table: dict[str, Any], reader: _Reader, i: int) -> Region:
    entry = f"region {table.get('text', i)}"
    limits = {key: float(reader.get(table, entry, key, (int, float))) for key in ("above", "below") if key in table}
    if not limits:
        raise reader.fault(entry, "needs 'above' or 'below'")
    flags = {key: reader.get(table, entry, key, bool) for key in ("rate", "size") if key in table}
    return Region(reader.get(table, entry, "text", str), reader.get(table, entry, "signal", str), **limits, **flags)


def load(path: Path) -> Catalogue:
    """The catalogue in a file."""
    try:
        return parse(path.read_text(encoding="utf-8"), str(path))
    except OSError as error:
        raise PackageError(f"{path}: cannot be read ({error.strerror})") from None
    except UnicodeDecodeError:
        raise PackageError(f"{path}: is not a text file in UTF-8") from None


def load_from_package(package: Path) -> Catalogue:
    """The catalogue packed in an .ssp."""
    import zipfile

    if not package.is_file():
        raise PackageError(f"{package}: no such file")
    try:
        with zipfile.ZipFile(package) as archive:
            return parse(archive.read(PACKED).decode("utf-8"), f"{package}/{PACKED}")
    except KeyError:
        raise PackageError(f"{package}: holds no {PACKED}; name a catalogue with 'effects' in the campaign") from None
    except (zipfile.BadZipFile, UnicodeDecodeError) as error:
        raise PackageError(f"{package}: not a zip archive or damaged ({error})") from None
