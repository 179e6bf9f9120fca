"""A campaign of measurements as values: channels, runs, events, and the package they were compared with."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import inf
from pathlib import Path
from typing import Any

import numpy as np

from ...core.errors import CosimError
from ...core.units import UNITS, unit


class CampaignError(CosimError):
    """A campaign that cannot be used; names file, place and remedy."""


@dataclass(frozen=True)
class Channel:
    """A measured quantity: a column of the run files and the connector it belongs to."""

    column: str
    connector: str
    unit: str
    role: str = "output"
    noise_std: float | None = None
    """In SI; None: to be estimated from the data."""
    clock_jitter: float | None = None
    """Standard deviation of the times of its readings [s]; None: the usual share of a sample interval."""
    model_form_scatter: float | None = None
    """What a good model of this channel may miss, as a standard deviation in SI; None: nothing is stated."""
    keep_faulty: bool = False
    """Glitches, drop-outs and stuck stretches are not left out."""
    scale: float = 1.0
    """What one of the column's numbers is in `unit`: of a sensor that gives volts, or -1 for another sign."""


@dataclass(frozen=True)
class FactorTolerance:
    """How well a base parameter is known, as a factor above 1 that it may be larger or smaller by."""

    factor: float


BaseTolerance = float | FactorTolerance
"""A share of the value (0: known exactly), or a factor."""


@dataclass(frozen=True)
class Event:
    """A measured moment: from `after` [s] a connector took so long to come to stay within `within` of `target`.

    It has to stay there until `until` [s] only, if that is given: then the machine is told to move on. With `first` it
    counts when it comes there for the first time, whether it stays or not.
    Either the duration `time` was measured, or only that it was at most or at least a limit. target and within are in
    the unit of the FMU's variable, times and `std` in seconds.
    """

    connector: str
    target: float
    within: float
    after: float
    std: float
    until: float = inf
    first: bool = False
    time: float | None = None
    at_most: float | None = None
    at_least: float | None = None

    @property
    def label(self) -> str:
        """For people."""
        return f"{self.connector} reaches {self.target:g}"


@dataclass
class Run:
    """A measured run. `series[connector]` = times [s] and values [SI], without the samples that are missing."""

    name: str
    parameters: dict[str, Any]
    use: str | None
    series: dict[str, tuple[np.ndarray, np.ndarray]]
    stop: float
    events: tuple[Event, ...] = ()
    time_unit: str | None = None
    """Unit of the times in its file as the campaign states it; None: it is left to the file, else s."""
    file: Path | None = None
    """Where its readings stand."""


NOTHING_TO_FIT = "every run has use = 'holdout', so there is nothing to fit; take that out of one run at least"


@dataclass
class Campaign:
    """Channels, runs, the package they were compared with, and what was found odd while reading."""

    name: str
    system: Path
    effects: Path | None
    channels: tuple[Channel, ...]
    runs: tuple[Run, ...]
    base: dict[str, BaseTolerance] = field(default_factory=dict)
    """Tolerances of base parameters that the campaign itself gives."""
    warnings: list[str] = field(default_factory=list)
    file: Path = Path("campaign.toml")
    """Where it stands, for messages."""
    accept: tuple[str, ...] = ()
    """Ids of effects that are taken as known to be there."""

    @property
    def outputs(self) -> list[Channel]:
        """Channels that are compared."""
        return [c for c in self.channels if c.role == "output"]

    @property
    def inputs(self) -> list[Channel]:
        """Channels that drive the model."""
        return [c for c in self.channels if c.role == "input"]

    @property
    def lacks_training(self) -> bool:
        """Whether there is no run to fit."""
        return all(r.use == "holdout" for r in self.runs)


def si(name: str) -> str:
    """The SI unit of the same quantity in the project's table."""
    stated = unit(name)
    si_names = (u.name for u in UNITS.values() if u.same_dimension(stated) and u.factor == 1.0 and u.offset == 0.0)
    si_name = next(si_names, None)
    if si_name is None:
        raise CampaignError(f"unit '{name}': the SI unit of that quantity is not known here")
    return si_name


def unit_in_fmu(channel: Channel, units: Mapping[str, str], where: str) -> dict[str, str]:
    """{connector: its unit in the FMU}, that of SI where it has none; raises `CampaignError` for another quantity."""
    fmu_unit = units.get(channel.connector, si(channel.unit))
    if not unit(channel.unit).same_dimension(unit(fmu_unit)):
        raise CampaignError(f"{where}: it is in {channel.unit}, but '{channel.connector}' is in {fmu_unit}")
    return {channel.connector: fmu_unit}
