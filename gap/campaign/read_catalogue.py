"""Reads the catalogue of effects, from a file or from a package."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import pairwise
from math import inf
from pathlib import Path
from typing import Any, TypeVar

from ...core.errors import PackageError
from ...core.plain_numbers import shown_value
from ...core.regular import require_regular
from ...core.repeated import repeated
from ...core.toml_tables import Tables
from ..settings import FILE_LIMITS
from . import keys
from .catalogue import (
    Base,
    Catalogue,
    Curve,
    Effect,
    Experiment,
    Form,
    Measurable,
    Parameter,
    Region,
    SensorEffect,
    SensorForm,
    SensorFormParameter,
)

T = TypeVar("T")

PACKED = "resources/effects.toml"
"""Where the catalogue lies in an .ssp."""

SCHEMA = 1
"""Version of the format."""

VERDICTS = ("none", "unknown")
"""What no effect is called."""


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
        width, prior = bounds[1] - bounds[0], self.above_zero(table, entry, "prior")
        if not FILE_LIMITS.finest_range * max(map(abs, bounds)) < width <= FILE_LIMITS.widest_range:
            raise self.error(f"{entry}: 'bounds' = {bounds} are no range that can be searched")
        if not FILE_LIMITS.finest_range * width <= prior <= FILE_LIMITS.widest_prior * width:
            raise self.error(f"{entry}: 'prior' = {prior:g} does not go with the bounds {bounds}")
        return neutral, bounds[0], bounds[1], prior

    def parameter(self, table: dict[str, Any], entry: str) -> Parameter:
        self.reject_unknown_keys(table, keys.PARAMETER, entry)
        address = self.get(table, entry, "address", str)
        entry = f"{entry}, {address}"
        neutral, low, high, prior = self.range(table, entry)
        starts = tuple(self.numbers(table, entry, "starts", ()))
        if not all(low <= v <= high for v in starts):
            raise self.error(f"{entry}: 'starts' = {list(starts)} has to be numbers within the bounds")
        also, shape = self.strings(table, entry, "also"), self.get(table, entry, "shape", bool, False)
        period, frequency = (self.get(table, entry, key, bool, False) for key in ("period", "frequency"))
        if frequency and not (shape and len(starts) > 1 and low >= 0.0):
            raise self.error(f"{entry}: 'frequency' is for a 'shape' that is not negative, with two 'starts' or more")
        return Parameter(address, neutral, low, high, prior, also, shape, starts, period, frequency)

    def effect(self, table: dict[str, Any], entry: str) -> Effect:
        self.reject_unknown_keys(table, keys.EFFECT, entry)
        self.notes(table, entry)
        parameters = tuple(self.parameter(p, entry) for p in self.tables(table, entry, "parameter"))
        if not any(not p.shape for p in parameters):
            raise self.error(f"{entry}: has no parameter that is not a shape")
        id, text, group = (self.label(table, entry, key) for key in ("id", "text", "group"))
        forms = tuple(
            self.form(f, f"{entry}: form {f.get('id', k)}")
            for k, f in enumerate(self.tables(table, entry, "form"), 1)
        )
        if (duplicate := repeated([f.id for f in forms])) is not None:
            raise self.error(f"{entry}: form {duplicate}: is listed twice")
        longest = self.above_zero(table, entry, "longest_step") if "longest_step" in table else inf
        return Effect(id, text, group, parameters, forms, longest)

    def notes(self, table: dict[str, Any], entry: str) -> None:
        for key in keys.NOTES:
            self.get(table, entry, key, str, "")

    def form(self, table: dict[str, Any], entry: str) -> Form:
        self.reject_unknown_keys(table, keys.FORM, entry)
        id, text = (self.label(table, entry, key) for key in ("id", "text"))
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

    def curve(self, table: dict[str, Any], entry: str) -> Curve:
        self.reject_unknown_keys(table, keys.CURVE, entry)
        id, text, x, y = (self.label(table, entry, key) for key in ("id", "text", "x", "y"))
        knots, parameters = tuple(self.numbers(table, entry, "knots")), self.strings(table, entry, "parameters")
        if len(knots) < 3 or any(b <= a for a, b in pairwise(knots)):
            raise self.error(f"{entry}: 'knots' = {list(knots)} has to be three numbers at least, in rising order")
        if len(parameters) != len(knots):
            raise self.error(f"{entry}: 'parameters' has {len(parameters)} addresses for {len(knots)} knots")
        effects = self.strings(table, entry, "effects")
        if not effects:
            raise self.error(f"{entry}: 'effects' has to name what the curve can be a form of")
        formula, knots_of = (self.get(table, entry, key, str, "") for key in ("formula", "knots_of"))
        names = self.get(table, entry, "names", dict, {})
        if "x" in names or not all(isinstance(a, str) for a in names.values()):
            raise self.error(f"{entry}: 'names' has to give an address for each name in the formula other than x")
        prior = self.above_zero(table, entry, "prior")
        return Curve(id, text, effects, x, y, knots, parameters, prior, knots_of, formula, names)

    def sensor(self, table: dict[str, Any], entry: str) -> SensorEffect:
        self.reject_unknown_keys(table, keys.SENSOR, entry)
        self.notes(table, entry)
        id, text, group, quantity = (self.label(table, entry, key) for key in ("id", "text", "group", "quantity"))
        if quantity not in keys.QUANTITIES:
            raise self.error(f"{entry}: 'quantity' = '{quantity}' is none of {', '.join(keys.QUANTITIES)}")
        neutral, low, high, prior = self.range(table, entry)
        if neutral != (right := 1.0 if quantity == "scale" else 0.0):
            raise self.error(f"{entry}: 'neutral' = {neutral:g}; a {quantity} is absent at {right:g}")
        if quantity in ("lag", "delay") and low < 0.0:
            raise self.error(f"{entry}: 'bounds' = [{low:g}, {high:g}]; a {quantity} cannot be negative")
        forms = [self.sensor_form(f, f"{entry}: form {f.get('id', k)}") for k, f in
                 enumerate(self.tables(table, entry, "form"), 1)]  # fmt: skip
        return SensorEffect(id, text, group, quantity, neutral, low, high, prior, tuple(forms))

    def sensor_form(self, table: dict[str, Any], entry: str) -> SensorForm:
        self.reject_unknown_keys(table, keys.SENSOR_FORM, entry)
        id, text, quantity = (self.get(table, entry, key, str) for key in ("id", "text", "quantity"))
        if quantity not in keys.SHAPES:
            raise self.error(f"{entry}: 'quantity' = '{quantity}' is none of {', '.join(keys.SHAPES)}")
        neutral, low, high, prior = self.range(table, entry)
        starts = tuple(self.numbers(table, entry, "starts"))
        if not all(low <= v <= high and v != neutral for v in starts) or not starts:
            raise self.error(f"{entry}: 'starts' = {list(starts)} has to be values within the bounds at which it shows")
        return SensorForm(id, text, SensorFormParameter(quantity, neutral, low, high, prior, starts))

    def base(self, table: dict[str, Any], entry: str) -> Base:
        self.reject_unknown_keys(table, keys.BASE, entry)
        tolerance = self.number(table, entry, "tolerance")
        if not 0.0 < tolerance < 1.0:
            raise self.error(f"{entry}: 'tolerance' = {tolerance:g} has to lie between 0 and 1")
        return Base(self.get(table, entry, "parameter", str), tolerance)

    def region(self, table: dict[str, Any], entry: str) -> Region:
        self.reject_unknown_keys(table, keys.REGION, entry)
        limits: dict[str, float] = {key: self.number(table, entry, key) for key in ("above", "below") if key in table}
        if not limits:
            raise self.error(f"{entry}: needs 'above' or 'below'")
        if limits.get("above", -inf) >= limits.get("below", inf):
            raise self.error(f"{entry}: nothing is above {limits['above']:g} and below {limits['below']:g}")
        rate, size = (self.get(table, entry, key, bool, False) for key in ("rate", "size"))
        text, signal = (self.get(table, entry, key, str) for key in ("text", "signal"))
        return Region(text, signal, limits.get("above", -inf), limits.get("below", inf), rate, size)

    def experiment(self, table: dict[str, Any], entry: str) -> Experiment:
        self.reject_unknown_keys(table, keys.EXPERIMENT, entry)
        values = tuple(self.numbers(table, entry, "values"))
        if not values:
            raise self.error(f"{entry}: 'values' is empty")
        return Experiment(self.get(table, entry, "parameter", str), values)

    def measurable(self, table: dict[str, Any], entry: str) -> Measurable:
        self.reject_unknown_keys(table, keys.MEASURABLE, entry)
        return Measurable(self.get(table, entry, "connector", str), self.above_zero(table, entry, "noise_std"))


def parse(text: str, shown: str = "effects.toml") -> Catalogue:
    """The catalogue in a TOML text; `PackageError` names the entry that is wrong."""
    return _catalogue(Tables(PackageError).parse(text, shown), shown)


def _catalogue(data: dict[str, Any], shown: str) -> Catalogue:
    reader = _Reader()
    reader.reject_unknown_keys(data, keys.CATALOGUE, shown)
    if data.get("schema", SCHEMA) != SCHEMA or isinstance(data.get("schema"), bool):
        raise reader.error(f"{shown}: schema = {shown_value(data['schema'])} is not known; this is {SCHEMA}")

    def all_of(kind: str, name: str, make: Callable[[dict[str, Any], str], T]) -> tuple[T, ...]:
        tables = reader.tables(data, shown, kind)
        named = ((t, t.get(name, i)) for i, t in enumerate(tables, 1))
        return tuple(make(t, f"{shown}: {kind} {id if isinstance(id, str) else shown_value(id)}") for t, id in named)

    effects = all_of("effect", "id", reader.effect)
    sensors = all_of("sensor", "id", reader.sensor)
    ids = [*(e.id for e in effects), *(s.id for s in sensors)]
    if (twice := repeated(ids)) is not None:
        raise reader.error(f"{shown}: effect {twice}: is listed twice")
    for id in ids:
        if id in VERDICTS:
            raise reader.error(f"{shown}: effect {id}: that is the name of a verdict; call it otherwise")
    if (duplicate := repeated([s.quantity for s in sensors])) is not None:
        raise reader.error(f"{shown}: two sensor entries are a {duplicate}; one is enough for all channels")
    curves = all_of("curve", "id", reader.curve)
    _check_curves(reader, curves, effects, shown)
    _check_addresses(reader, curves, effects, shown)
    base = all_of("base", "parameter", reader.base)
    if (duplicate := repeated([b.parameter for b in base])) is not None:
        raise reader.error(f"{shown}: base {duplicate}: is listed twice")
    if not ids:
        raise reader.error(f"{shown}: holds no effects")
    estimation = reader.get(data, shown, "estimation", dict, {})
    reader.reject_unknown_keys(estimation, keys.ESTIMATION, f"{shown}: estimation")
    settings = reader.get(estimation, f"{shown}: estimation", "parameters", dict) if estimation else {}
    for address in settings:
        reader.number(settings, f"{shown}: estimation", address)
    return Catalogue(
        effects,
        sensors,
        curves,
        base,
        all_of("region", "text", reader.region),
        all_of("experiment", "parameter", reader.experiment),
        all_of("measurable", "connector", reader.measurable),
        settings,
        shown,
    )


def _check_curves(reader: _Reader, curves: Sequence[Curve], effects: Sequence[Effect], shown: str) -> None:
    if (duplicate := repeated([c.id for c in curves])) is not None:
        raise reader.error(f"{shown}: curve {duplicate}: is listed twice")
    for c in curves:
        for id in c.effects:
            effect = next((e for e in effects if e.id == id), None)
            if effect is None:
                raise reader.error(f"{shown}: curve {c.id}: 'effects' names '{id}', which is no effect here")
            if any(f.id == c.id for f in effect.forms):
                raise reader.error(f"{shown}: curve {c.id}: effect {id} has a form of that name; call it otherwise")


def _check_addresses(reader: _Reader, curves: Sequence[Curve], effects: Sequence[Effect], shown: str) -> None:
    """A parameter belongs to one entry."""
    entry_of: dict[str, str] = {}
    entries = [(f"effect {e.id}", [a for p in e.all_parameters for a in (p.address, *p.also)]) for e in effects]
    for entry, addresses in [*entries, *((f"curve {c.id}", c.parameters) for c in curves)]:
        if (duplicate := repeated(addresses)) is not None:
            raise reader.error(f"{shown}: {entry}: has '{duplicate}' twice")
        for address in addresses:
            if entry_of.setdefault(address, entry) != entry:
                raise reader.error(f"{shown}: {entry_of[address]} and {entry} both have '{address}'")


def load(path: Path) -> Catalogue:
    """The catalogue in a file."""
    return _catalogue(Tables(PackageError).load(path), str(path))


def load_from_package(package: Path) -> Catalogue:
    """The catalogue packed in an .ssp."""
    import zipfile
    import zlib

    from ...ssp.reader import DEFAULT, no_package

    require_regular(package, PackageError)
    try:
        with zipfile.ZipFile(package) as archive:
            if DEFAULT not in archive.namelist():
                raise PackageError(f"{package}: {no_package(archive.namelist())}")
            Tables(PackageError).check_size(archive.getinfo(PACKED).file_size, f"{package}/{PACKED}")
            return parse(archive.read(PACKED).decode("utf-8"), f"{package}/{PACKED}")
    except KeyError:
        raise PackageError(f"{package}: holds no {PACKED}; name a catalogue with 'effects' in the campaign") from None
    except (zipfile.BadZipFile, UnicodeDecodeError, RuntimeError, zlib.error) as error:  # also an encrypted one
        raise PackageError(f"{package}: not a zip archive or damaged ({error})") from None
