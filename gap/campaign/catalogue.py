"""The catalogue of effects (effects.toml): what a real system may have that its model lacks, as parameters.

    [[effect]]                      [[effect.parameter]]                [[base]]
    id, text, group                 address, neutral, bounds, prior     parameter, tolerance
                                    also, shape, starts

    [[effect.form]]                 [[effect.form.parameter]]
    id, text                        address, neutral, bounds, prior, also, starts

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

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from math import inf
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from ...core.errors import PackageError
from ...core.repeated import repeated
from ...core.toml_tables import Tables

T = TypeVar("T")

PACKED = "resources/effects.toml"
"""Where the catalogue lies in an .ssp."""

SCHEMA = 1
"""Version of the format."""

VERDICTS = ("none", "unknown")
"""What no effect is called."""

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
class Form:
    """Another form of an effect than its plain one: further parameters, which change nothing at their neutral values.

    It is tried where the effect is in. `starts` of its parameters are values at which it shows.
    """

    id: str
    text: str
    parameters: tuple[Parameter, ...]


@dataclass(frozen=True)
class Effect:
    """A candidate cause."""

    id: str
    text: str
    group: str
    parameters: tuple[Parameter, ...]
    forms: tuple[Form, ...] = ()

    @property
    def all_parameters(self) -> tuple[Parameter, ...]:
        """Those of its forms among them."""
        return (*self.parameters, *(p for f in self.forms for p in f.parameters))

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


class _Reader(Tables):
    """Takes the catalogue's entries out of their tables."""

    def __init__(self) -> None:
        super().__init__(PackageError)

    def above_zero(self, table: dict[str, Any], entry: str, key: str) -> float:
        value = self.number(table, entry, key)
        if not value > 0.0:
            raise self.error(f"{entry}: '{key}' = {value:g} has to be positive")
        return value

    def range(self, table: dict[str, Any], entry: str) -> tuple[float, float, float, float]:
        neutral, bounds = self.number(table, entry, "neutral"), self.numbers(table, entry, "bounds")
        if len(bounds) != 2 or not bounds[0] < bounds[1]:
            raise self.error(f"{entry}: 'bounds' = {bounds} has to be two numbers, the lower first")
        if not bounds[0] <= neutral <= bounds[1]:
            raise self.error(f"{entry}: 'neutral' = {neutral:g} lies outside the bounds {bounds}")
        return neutral, bounds[0], bounds[1], self.above_zero(table, entry, "prior")

    def parameter(self, table: dict[str, Any], entry: str) -> Parameter:
        self.no_strangers(table, ("address", "neutral", "bounds", "prior", "also", "shape", "starts"), entry)
        address = self.get(table, entry, "address", str)
        entry = f"{entry}, {address}"
        neutral, low, high, prior = self.range(table, entry)
        starts = tuple(self.numbers(table, entry, "starts", ()))
        if not all(low <= v <= high for v in starts):
            raise self.error(f"{entry}: 'starts' = {list(starts)} has to be numbers within the bounds")
        also, shape = self.strings(table, entry, "also"), self.get(table, entry, "shape", bool, False)
        return Parameter(address, neutral, low, high, prior, also, shape, starts)

    def effect(self, table: dict[str, Any], entry: str) -> Effect:
        self.no_strangers(table, ("id", "text", "group", "parameter", "form"), entry)
        parameters = tuple(self.parameter(p, entry) for p in self.tables(table, entry, "parameter"))
        if not any(not p.shape for p in parameters):
            raise self.error(f"{entry}: has no parameter that is not a shape")
        id, text, group = (self.get(table, entry, key, str) for key in ("id", "text", "group"))
        forms = tuple(
            self.form(f, f"{entry}: form {f.get('id', k)}")
            for k, f in enumerate(self.tables(table, entry, "form"), 1)
        )
        if (twice := repeated([f.id for f in forms])) is not None:
            raise self.error(f"{entry}: form {twice}: is listed twice")
        return Effect(id, text, group, parameters, forms)

    def form(self, table: dict[str, Any], entry: str) -> Form:
        self.no_strangers(table, ("id", "text", "parameter"), entry)
        id, text = (self.get(table, entry, key, str) for key in ("id", "text"))
        parameters = tuple(
            replace(self.parameter(p, entry), shape=True) for p in self.tables(table, entry, "parameter")
        )
        if not parameters:
            raise self.error(f"{entry}: has no parameter")
        for p in parameters:
            if not p.starts:
                raise self.error(f"{entry}, {p.address}: needs 'starts', values at which the form shows")
            if p.neutral in p.starts:
                raise self.error(f"{entry}, {p.address}: 'starts' holds the neutral value {p.neutral:g}")
        return Form(id, text, parameters)

    def sensor(self, table: dict[str, Any], entry: str) -> Sensor:
        self.no_strangers(table, ("id", "text", "group", "quantity", "neutral", "bounds", "prior"), entry)
        id, text, group, quantity = (self.get(table, entry, key, str) for key in ("id", "text", "group", "quantity"))
        if quantity not in QUANTITIES:
            raise self.error(f"{entry}: 'quantity' = '{quantity}' is none of {', '.join(QUANTITIES)}")
        neutral, low, high, prior = self.range(table, entry)
        if neutral != (right := 1.0 if quantity == "scale" else 0.0):
            raise self.error(f"{entry}: 'neutral' = {neutral:g}; a {quantity} is absent at {right:g}")
        if quantity in ("lag", "delay") and low < 0.0:
            raise self.error(f"{entry}: 'bounds' = [{low:g}, {high:g}]; a {quantity} cannot be negative")
        return Sensor(id, text, group, quantity, neutral, low, high, prior)

    def base(self, table: dict[str, Any], entry: str) -> Base:
        self.no_strangers(table, ("parameter", "tolerance"), entry)
        tolerance = self.number(table, entry, "tolerance")
        if not 0.0 < tolerance < 1.0:
            raise self.error(f"{entry}: 'tolerance' = {tolerance:g} has to lie between 0 and 1")
        return Base(self.get(table, entry, "parameter", str), tolerance)

    def region(self, table: dict[str, Any], entry: str) -> Region:
        self.no_strangers(table, ("text", "signal", "above", "below", "rate", "size"), entry)
        limits: dict[str, float] = {key: self.number(table, entry, key) for key in ("above", "below") if key in table}
        if not limits:
            raise self.error(f"{entry}: needs 'above' or 'below'")
        if limits.get("above", -inf) >= limits.get("below", inf):
            raise self.error(f"{entry}: nothing is above {limits['above']:g} and below {limits['below']:g}")
        rate, size = (self.get(table, entry, key, bool, False) for key in ("rate", "size"))
        text, signal = (self.get(table, entry, key, str) for key in ("text", "signal"))
        return Region(text, signal, limits.get("above", -inf), limits.get("below", inf), rate, size)

    def experiment(self, table: dict[str, Any], entry: str) -> Experiment:
        self.no_strangers(table, ("parameter", "values"), entry)
        values = tuple(self.numbers(table, entry, "values"))
        if not values:
            raise self.error(f"{entry}: 'values' is empty")
        return Experiment(self.get(table, entry, "parameter", str), values)

    def measurable(self, table: dict[str, Any], entry: str) -> Measurable:
        self.no_strangers(table, ("connector", "noise_std"), entry)
        return Measurable(self.get(table, entry, "connector", str), self.above_zero(table, entry, "noise_std"))


def parse(text: str, shown: str = "effects.toml") -> Catalogue:
    """The catalogue in a TOML text; `PackageError` names the entry that is wrong."""
    return _catalogue(Tables(PackageError).parse(text, shown), shown)


def _catalogue(data: dict[str, Any], shown: str) -> Catalogue:
    reader = _Reader()
    tables = ("effect", "sensor", "base", "region", "experiment", "measurable", "estimation")
    reader.no_strangers(data, ("schema", *tables), shown)
    if data.get("schema", SCHEMA) != SCHEMA:
        raise reader.error(f"{shown}: schema = {data['schema']!r} is not known; this is {SCHEMA}")

    def all_of(kind: str, name: str, make: Callable[[dict[str, Any], str], T]) -> tuple[T, ...]:
        tables = reader.tables(data, shown, kind)
        return tuple(make(t, f"{shown}: {kind} {t.get(name, i)}") for i, t in enumerate(tables, 1))

    effects = all_of("effect", "id", reader.effect)
    sensors = all_of("sensor", "id", reader.sensor)
    ids = [*(e.id for e in effects), *(s.id for s in sensors)]
    for id in ids:
        if ids.count(id) > 1:
            raise reader.error(f"{shown}: effect {id}: is listed twice")
        if id in VERDICTS:
            raise reader.error(f"{shown}: effect {id}: that is the name of a verdict; call it otherwise")
    if (twice := repeated([s.quantity for s in sensors])) is not None:
        raise reader.error(f"{shown}: two sensor entries are a {twice}; one is enough for all channels")
    belongs: dict[str, str] = {}
    for e in effects:
        addresses = [a for p in e.all_parameters for a in (p.address, *p.also)]
        if (twice := repeated(addresses)) is not None:
            raise reader.error(f"{shown}: effect {e.id}: has '{twice}' twice")
        for address in addresses:
            if belongs.setdefault(address, e.id) != e.id:
                raise reader.error(f"{shown}: effects {belongs[address]} and {e.id} both have '{address}'")
    base = all_of("base", "parameter", reader.base)
    if (twice := repeated([b.parameter for b in base])) is not None:
        raise reader.error(f"{shown}: base {twice}: is listed twice")
    if not ids:
        raise reader.error(f"{shown}: holds no effects")
    estimation = reader.get(data, shown, "estimation", dict, {})
    reader.no_strangers(estimation, ("parameters",), f"{shown}: estimation")
    return Catalogue(
        effects,
        sensors,
        base,
        all_of("region", "text", reader.region),
        all_of("experiment", "parameter", reader.experiment),
        all_of("measurable", "connector", reader.measurable),
        reader.get(estimation, f"{shown}: estimation", "parameters", dict) if estimation else {},
    )


def load(path: Path) -> Catalogue:
    """The catalogue in a file."""
    return _catalogue(Tables(PackageError).load(path), str(path))


def load_from_package(package: Path) -> Catalogue:
    """The catalogue packed in an .ssp."""
    import zipfile

    from ...ssp.reader import DEFAULT, no_package

    if not package.is_file():
        raise PackageError(f"{package}: no such file")
    try:
        with zipfile.ZipFile(package) as archive:
            if DEFAULT not in archive.namelist():
                raise PackageError(f"{package}: {no_package(archive.namelist())}")
            return parse(archive.read(PACKED).decode("utf-8"), f"{package}/{PACKED}")
    except KeyError:
        raise PackageError(f"{package}: holds no {PACKED}; name a catalogue with 'effects' in the campaign") from None
    except (zipfile.BadZipFile, UnicodeDecodeError) as error:
        raise PackageError(f"{package}: not a zip archive or damaged ({error})") from None
