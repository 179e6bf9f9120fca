"""The catalogue of effects (effects.toml): what a real system may have that its model lacks, as parameters.

    [[effect]]                      [[effect.parameter]]                [[base]]
    id, text, group                 address, neutral, bounds, prior     parameter, tolerance
                                    also, shape, starts, period, frequency

    [[effect.form]]                 [[effect.form.parameter]]
    id, text                        address, neutral, bounds, prior, also, starts

    [[curve]]
    id, text, effects, x, y, knots, knots_of, parameters, prior, formula, names

    [[sensor]]                      [[sensor.form]]
    id, text, group, quantity (bias, scale, lag, delay, drift, curvature), neutral, bounds, prior
                                    id, text, quantity (split), neutral, bounds, prior, starts

    [[effect]] and [[sensor]] may have equation, source and test beside, for people; an [[effect]] longest_step [s]

    [[region]]                      [[experiment]]                      [[measurable]]
    text, signal                    parameter, values                   connector, noise_std
    above, below, rate, size

    [estimation]
    parameters = {address = value}: settings for runs at longer steps than the package's, a solver's tolerance

A third party makes its own effects known to the diagnosis by writing such a file for its own FMU.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from math import inf
from typing import Any

import numpy as np

from ...core.errors import CosimError


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
    period: bool = False
    """Whether it is a time after which something comes again [s], so that a small change of it shifts what is late in a
    run by a whole turn."""
    frequency: bool = False
    """Whether it is a shape that something swings in proportion to, likewise."""

    def values(self, value: float) -> dict[str, float]:
        """`value` at every address."""
        return dict.fromkeys((self.address, *self.also), value)


@dataclass(frozen=True)
class Form:
    """Another form of an effect than its plain one: further parameters, which change nothing at their neutral values.

    It is tried where something is left. `starts` of its parameters are values at which it shows.
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
    longest_step: float = inf
    """Macro step [s] beyond which the coupling is not stable where the effect is in."""

    @property
    def all_parameters(self) -> tuple[Parameter, ...]:
        """Those of its forms among them."""
        return (*self.parameters, *(p for f in self.forms for p in f.parameters))

    @property
    def main(self) -> Parameter:
        """The parameter that says how strong the effect is."""
        return next(p for p in self.parameters if not p.shape)


@dataclass(frozen=True)
class Curve:
    """What no formula fits: a quantity over another, added to what effects make of it, with values at knots.

    It is tried in the place of the plain form of any of its `effects` that is in.
    """

    id: str
    text: str
    effects: tuple[str, ...]
    x: str
    y: str
    """Units."""
    knots: tuple[float, ...]
    parameters: tuple[str, ...]
    """Addresses, one for each knot."""
    prior: float
    """Usual size of the values."""
    knots_of: str = ""
    """Address of what the knots are shares of; empty: they are in the unit of x."""
    formula: str = ""
    """The quantity over x without the curve, to be drawn beside it; empty: 0."""
    names: Mapping[str, str] = field(default_factory=dict)
    """Address of each further name in the formula."""


@dataclass(frozen=True)
class SensorFormParameter:
    """What a form of a sensor's effect has beyond the plain one."""

    quantity: str
    neutral: float
    low: float
    high: float
    prior: float
    starts: tuple[float, ...] = ()


@dataclass(frozen=True)
class SensorForm:
    """Another form of a sensor's effect."""

    id: str
    text: str
    parameter: SensorFormParameter


@dataclass(frozen=True)
class SensorEffect:
    """An effect of a measurement, possible in every channel."""

    id: str
    text: str
    group: str
    quantity: str
    neutral: float
    low: float
    high: float
    prior: float
    """Of a bias and of a drift in spans of the channel, by the minute; of a curvature what it amounts to at the ends of
    the span, in spans."""
    forms: tuple[SensorForm, ...] = ()

    @property
    def starts(self) -> tuple[float, ...]:
        """Values to try first: none but the neutral one."""
        return ()


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
    sensors: tuple[SensorEffect, ...] = ()
    curves: tuple[Curve, ...] = ()
    base: tuple[Base, ...] = ()
    regions: tuple[Region, ...] = ()
    experiments: tuple[Experiment, ...] = ()
    measurables: tuple[Measurable, ...] = ()
    estimation: dict[str, Any] = field(default_factory=dict)
    """Settings of the runs at longer steps than the package's, by address."""
    source: str = field(default="", compare=False, repr=False)
    """What it was read from."""

    @contextmanager
    def named_in_errors(self) -> Iterator[None]:
        """Around what its entries are used for: errors then begin with what it was read from."""
        try:
            yield
        except CosimError as error:
            if self.source:
                error.args = (f"{self.source}: {error}",)
            raise

    def effect(self, id: str) -> Effect | None:
        """The effect of that id."""
        return next((e for e in self.effects if e.id == id), None)
