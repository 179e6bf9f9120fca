"""What the report shows beside the contents of diagnosis.json: time series and units, as plain values.

Nothing here knows how a diagnosis is made; `collect` fills these values from the pipeline's state.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Channel:
    """A measured quantity, and the unit in which it was measured."""

    label: str
    """Its key in diagnosis.json: a connector, or an event."""
    column: str
    """Its name in the run files."""
    unit: str
    """In which it was measured; "1" for a plain number."""
    factor: float = 1.0
    """A difference in `unit` per difference in the unit of diagnosis.json."""


@dataclass(frozen=True, eq=False)
class Trace:
    """A channel in one run: times (n,) [s] and values (n,) in the unit in which it was measured.

    Models have the sensor's bias and the clock's error that belong to them, so that measured minus model is the
    residual of the diagnosis.
    """

    channel: str
    """Label of the channel."""
    t: Array
    measured: Array
    delivered: Array
    calibrated: Array
    explained: Array | None
    """None where no effect is in the best hypothesis."""
    noise: Array
    """Standard deviation of the noise."""


@dataclass(frozen=True, eq=False)
class InputTrace:
    """A measured signal that drives the model: times (n,) [s] and values (n,)."""

    column: str
    unit: str
    t: Array
    measured: Array


@dataclass(frozen=True)
class Condition:
    """A parameter that the campaign states for a run."""

    name: str
    value: object
    unit: str


@dataclass(frozen=True, eq=False)
class RunSignals:
    """The traces of a run, and under which conditions it was measured."""

    name: str
    held_out: bool
    stop: float
    """End of the run [s]."""
    conditions: tuple[Condition, ...] = ()
    traces: tuple[Trace, ...] = ()
    inputs: tuple[InputTrace, ...] = ()


@dataclass(frozen=True, eq=False)
class MeanCurve:
    """Mean of the residual over narrow intervals of a signal: (m,) each."""

    x: Array
    y: Array


@dataclass(frozen=True, eq=False)
class Dependence:
    """What the best hypothesis leaves of a channel, against the signal that it varies with most: (n,) each."""

    channel: str
    """Label of the channel whose residual it is."""
    x_name: str
    x_unit: str
    x: Array
    residual: Array
    """In the unit in which the channel was measured."""
    noise: float
    """Standard deviation of the noise, in the same unit."""
    share: float
    """Share of the residual's energy that its mean at that signal predicts on data it was not taken from."""
    mean: MeanCurve
    """The mean residual over the signal."""


@dataclass(frozen=True, eq=False)
class Signals:
    """All that the report needs beside diagnosis.json."""

    system: str = ""
    """File name of the package."""
    channels: tuple[Channel, ...] = ()
    runs: tuple[RunSignals, ...] = ()
    """In the order of the campaign, those that it holds out last."""
    dependences: tuple[Dependence, ...] = ()
    parameter_units: Mapping[str, str] = field(default_factory=dict)
    """Unit of each parameter, by its address."""
    neutral: Mapping[str, float] = field(default_factory=dict)
    """Value at which an effect's parameter does nothing, by its name."""

    def channel(self, label: str, unit: str = "1") -> Channel:
        """The channel of that label; one that is not known is shown in the unit of diagnosis.json."""
        matches = (c for c in self.channels if c.label == label)
        return next(matches, Channel(label, label, unit))

    def unit_of(self, name: str) -> str:
        """Unit of a parameter, whose name may lack its component."""
        return unit_of_parameter(self.parameter_units, name)


def unit_of_parameter(units: Mapping[str, str], name: str) -> str:
    """Unit of a parameter, whose name may lack its component; units: by address."""
    if name in units:
        return units[name]
    matches = (u for address, u in units.items() if address.partition(".")[2] == name)
    return next(matches, "1")


def without_signals(data: Mapping[str, Any]) -> Signals:
    """What can be told of the signals from diagnosis.json alone: names and units of the channels, no series."""
    channels = data["budget"]["per_channel"]
    return Signals(channels=tuple(Channel(label, label, c["unit"]) for label, c in channels.items()))
