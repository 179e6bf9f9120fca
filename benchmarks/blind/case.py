"""A case of the benchmark: which machine, which runs, which channels, what is wrong with it and how strongly."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from .effect_forms import Form
from .effects import Effect
from .machine import Machine
from .measure import Channel
from .system import KEYS

Array = NDArray[np.float64]

BASE = {
    "hydraulics.oil.nu0": "nu0",
    "hydraulics.oil.alpha": "alpha",
    "hydraulics.oil.beta": "beta",
    "hydraulics.cylinder.B_h": "cylinder_damping",
    "hydraulics.cylinder.c_l": "leakage",
    "hydraulics.valve.q_rated": "rated_flow",
    "hydraulics.line.length": "line_length",
    "hydraulics.relief.p_crack": "relief_pressure",
    "arm.C_D": "drag_coefficient",
    "arm.C_M": "inertia_coefficient",
    "arm.load_weight": "load_weight",
    "arm.beam_mass": "beam_mass",
}
"""Base parameters: SSP address and the plant's name."""

GRID = 1e-3
"""Time between the simulated points (s)."""


@dataclass(frozen=True)
class Conditions:
    """What is known of a run: conditions, its length (s) and its rate of sampling (1/s)."""

    depth: float
    load_weight: float
    current: float
    target: float
    t_start: float
    ramp_time: float
    hold_time: float
    stop: float
    rate: float

    @property
    def at(self) -> Array:
        """Times of the samples (s)."""
        return np.arange(int(self.stop * self.rate) + 1) / self.rate

    def parameters(self) -> dict[str, float]:
        """The known conditions by SSP address."""
        return {
            "depth": self.depth,
            "arm.load_weight": self.load_weight,
            "arm.current_speed": self.current,
            "hydraulics.command.target": self.target,
            "hydraulics.command.t_start": self.t_start,
            "hydraulics.command.ramp_time": self.ramp_time,
            "hydraulics.command.hold_time": self.hold_time,
        }

    def machine(self) -> Machine:
        """The plain machine in these conditions."""
        names = ("depth", "load_weight", "current", "target", "t_start", "ramp_time", "hold_time")
        return Machine(**{name: getattr(self, name) for name in names})


@dataclass(frozen=True)
class Wrong:
    """An effect at work: knob and shapes, or for sensors the channel's error; its size in noise floors."""

    effect: Effect
    sign: float
    shapes: dict[str, float]
    amplitude: float
    column: str | None = None
    """Column of the sensor that errs; None: an effect of the machine."""
    size: float = np.nan
    """Whitened RMS of what it changes beyond the best refit of the base parameters within their tolerance."""
    size_linear: float = np.nan
    """The same beyond a linear refit, which overstates what is large and alike to a base parameter."""
    size_net: float = np.nan
    """The latter beyond sensors' own biases and the recording's delay, too."""
    wanted: float = np.nan
    form: Form | None = None
    """Which other form than the plain one it has; the values are among the shapes."""

    @property
    def plant(self) -> dict[str, float]:
        """Parameters of the plant, or of the sensor."""
        return self.effect.plant(self.sign, self.amplitude, self.shapes)


@dataclass(frozen=True)
class Case:
    """All that makes a case; see `draw`."""

    seed: int
    index: int
    kind: str
    runs: tuple[Conditions, ...]
    channels: tuple[Channel, ...]
    delay: float
    tolerance: float
    factors: dict[str, float]
    noise_stated: bool
    wrong: tuple[Wrong, ...] = ()
    size_all: float = 0.0
    edition: int = 1
    notes: list[str] = field(default_factory=list)


def machine_of(run: Conditions, factors: Mapping[str, float], wrong: tuple[Wrong, ...] = ()) -> Machine:
    """The machine in a run, with its true base parameters and effects."""
    m = run.machine()
    m = replace(m, **{BASE[address]: getattr(m, BASE[address]) * factor for address, factor in factors.items()})
    for w in wrong:
        if w.column is None:
            m = replace(m, **w.plant)
    return m


def span_of(run_signals: list[Array], channel: Channel) -> float:
    """Largest less smallest value of a channel over all runs (SI)."""
    k = KEYS.index(channel.kind.key)
    return max(s[:, k].max() for s in run_signals) - min(s[:, k].min() for s in run_signals)


def erring(channels: tuple[Channel, ...], wrong: tuple[Wrong, ...], spans: dict[str, float]) -> tuple[Channel, ...]:
    """The channels with the sensor effects in them; `spans` (SI) turn bias, drift and bow from shares into values."""
    result = []
    for channel in channels:
        error: dict[str, float] = {}
        for w in wrong:
            if w.column == channel.kind.key:
                error |= w.plant
                span = spans[channel.kind.key]
                error |= {name: w.plant[name] * span for name in ("bias", "drift", "bow") if name in w.plant}
                if "bow" in w.plant:
                    error["bow_span"] = span
        result.append(replace(channel, error=error))
    return tuple(result)
