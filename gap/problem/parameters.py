"""Quantities to be estimated, and effects as sets of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

Point = Mapping[str, float]
"""Normalised parameters by name; those left out are 0, the model as delivered."""


@dataclass(frozen=True)
class EstimatedParameter:
    """A quantity to be estimated: value = start + scale * u, low <= u <= high; u has the prior N(0, sd).

    With a `factor` it is on a logarithmic scale instead: value = start * factor^u, and scale = log(factor) is the
    relative change for a small u.
    """

    name: str
    kind: str
    """base (a factor), effect (a parameter's value) or sensor (sensor.<connector>.<quantity>)."""
    start: float
    scale: float
    low: float
    high: float
    sd: float
    addresses: tuple[str, ...] = ()
    shape: bool = False
    starts: tuple[float, ...] = ()
    """Of a shape: normalised values to try first."""
    factor: float | None = None
    weights: tuple[float, ...] = ()
    """Of a shape of a curve: what is added to each of the addresses for a value of 1."""
    accepted: bool = False
    """Of an effect that is known to be there: refitted together with the base parameters."""
    longest_run: float = 0.0
    """Of a period: how long it goes on, as long as the longest run [s]; 0: it is none."""
    frequency: bool = False
    """Whether it is a shape that something swings in proportion to."""

    @property
    def in_every_set(self) -> bool:
        """Whether every hypothesis has it."""
        return self.kind == "base" or self.accepted

    @property
    def tolerance_text(self) -> str:
        """The tolerance of a base parameter, for people."""
        return f"{100 * self.scale:.3g}%" if self.factor is None else f"a factor of {self.factor:g}"

    def shift(self, u: float, until: float, turns: float) -> float:
        """Of a period at u: the change of u that shifts what comes at a time [s] by so many of its turns."""
        return turns * self.value(u) ** 2 / (until * abs(self.scale))

    def longest_difference(self, u: float, turns: float) -> float:
        """The longest step of a difference at u: of a period, what shifts the end of a run by so many turns."""
        if not self.longest_run or not self.value(u):
            return float("inf")
        return self.shift(u, self.longest_run, turns)

    def step_inside(self, u: float, h: float) -> float:
        """A step of h at most from u that stays in the range: upwards if there is room, else to where there is more."""
        up, down = self.high - u, u - self.low
        return h if h <= up else -min(h, down) if down > up else up

    def value(self, u: float) -> float:
        """The value of the quantity, without the last digits: what is a range's end but for rounding is that end."""
        exact = self.start + self.scale * u if self.factor is None else self.start * self.factor**u
        value = float(f"{exact:.14g}")
        return 0.0 if abs(value) < 1e-12 * abs(self.scale) else value


@dataclass(frozen=True)
class EffectForm:
    """Another form of an effect than its plain one: further parameters, at 0 the plain one."""

    id: str
    text: str
    parameters: tuple[EstimatedParameter, ...]


@dataclass(frozen=True)
class EffectCandidate:
    """A possible cause: an effect of the machine, or one of a sensor."""

    id: str
    text: str
    group: str
    parameters: tuple[EstimatedParameter, ...]
    weight: float = 1.0
    """Share of its id's prior probability: an effect of any of n channels is n candidates."""
    forms: tuple[EffectForm, ...] = ()
    """In which it may be."""
    form: EffectForm | None = None
    """In which it is; None: the plain one."""

    def as_accepted(self) -> EffectCandidate:
        """The effect as one that is known to be there, in its plain form."""
        return replace(self, parameters=tuple(replace(x, accepted=True) for x in self.parameters), forms=())

    def in_form(self, form: EffectForm) -> EffectCandidate:
        """The plain effect in one of its forms, whose parameters are then shapes of it."""
        form_parameters = tuple(replace(x, starts=()) for x in form.parameters)
        return replace(self, parameters=(*self.parameters, *form_parameters), form=form)

    @property
    def name(self) -> str:
        """The label, with the form."""
        return self.label if self.form is None else f"{self.label} [{self.form.id}]"

    @property
    def key(self) -> frozenset[str]:
        """What it consists of: itself, and its form."""
        return frozenset([self.label, self.name])

    @property
    def main(self) -> EstimatedParameter:
        """The parameter that says how strong the effect is."""
        return next(x for x in self.parameters if not x.shape)

    @property
    def label(self) -> str:
        """The id, with the channel of a sensor's effect."""
        name = self.parameters[0].name
        return f"{self.id}({sensor_quantity(name)[0]})" if name.startswith("sensor.") else self.id


def sensor_quantity(name: str) -> tuple[str, str]:
    """Connector and quantity of a sensor's parameter, such as "sensor.arm.x_h.bias"."""
    connector, _, quantity = name.removeprefix("sensor.").rpartition(".")
    return connector, quantity


def point_of(parameters: Sequence[EstimatedParameter], u: np.ndarray) -> dict[str, float]:
    """The point at the normalised values u (k,)."""
    return {x.name: v for x, v in zip(parameters, u.tolist(), strict=True)}


def penalty(parameters: Sequence[EstimatedParameter], u: np.ndarray, biases: np.ndarray | None = None) -> float:
    """What normalised values u (k,) and sensors' biases cost: their squares in prior standard deviations."""
    strain = float(sum((v / x.sd) ** 2 for x, v in zip(parameters, u, strict=True)))
    return strain if biases is None else strain + float(biases @ biases)
