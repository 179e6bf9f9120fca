"""The clock of a run's file: unit of its times, and where in it the model starts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...core.units import unit
from ..measurements.table import FloatArray
from ..settings import FILE_LIMITS, ONBOARDING
from .model import Model
from .sources import Source

UNITS_OF_TIME = ("s", "ms", "us", "min", "h")


@dataclass(frozen=True)
class Clock:
    """How a run's times become those of the model."""

    unit: str
    """In which the file counts."""
    stated: bool
    """Whether the file says so."""
    start: float | None
    """Time of the file that is 0 s of the model [s]; None: 0."""
    doubt: str = ""
    """A question for the user."""

    def times(self, source: Source) -> FloatArray:
        """Times of the readings (n,) [s] on the model's clock."""
        seconds = source.time * unit(self.unit).factor
        return seconds - (self.start or 0.0)


def read_clock(source: Source, model: Model) -> Clock:
    """The clock as the file, the length of the scenario and the model's step suggest it."""
    name, stated = source.time_unit or "s", source.time_unit is not None or source.stamped
    doubt = ""
    if not stated:
        name, doubt = _guessed_unit(source, model)
    seconds = source.time * unit(name).factor
    first, length = float(seconds[0]), float(seconds[-1] - seconds[0])
    interval = float(np.median(np.diff(seconds)))
    early, late = -FILE_LIMITS.early_start * interval, FILE_LIMITS.late_start * length
    if early <= first <= late and not source.stamped:
        return Clock(name, stated, None, doubt)
    return Clock(name, stated, first, doubt)


def _guessed_unit(source: Source, model: Model) -> tuple[str, str]:
    """The unit of times that state none, and a question where it is not sure."""
    length, interval = float(np.ptp(source.time)), float(np.median(np.diff(source.time)))
    if model.stop:
        near = {u: abs(np.log(length * unit(u).factor / model.stop)) for u in UNITS_OF_TIME}
        best = min(near, key=near.__getitem__)
        if near[best] <= np.log(ONBOARDING.time_within) and near["s"] > np.log(ONBOARDING.time_within):
            return best, f"is time in {best}? The run is then as long as the scenario ({model.stop:g} s)"
    if model.step is not None:
        apart = {u: interval * unit(u).factor / model.step for u in ("s", "ms", "us")}
        most = ONBOARDING.reads_per_step
        if not 1.0 / most <= apart["s"] <= most:
            usual = [u for u in ("ms", "us") if 1.0 / most <= apart[u] <= most]
            if usual:
                return usual[0], f"is time in {usual[0]}? Readings are then {apart[usual[0]]:g} macro steps apart"
    elif interval >= 1.0 and len(source.time) > 100 and np.array_equal(source.time, np.round(source.time)):
        return "s", f"is time in s? Its readings are {interval:g} s apart, and ms would be as likely"
    return "s", ""
