"""When a run starts, ends and communicates."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...core.errors import UsageError
from ...ssp.model import SystemStructure

DEFAULT_STEPS = 1000
"""Steps of a run where neither the package and its FMUs nor the user says how long one is."""


class TimeGrid(NamedTuple):
    """Start, stop and macro step of a run [s], and the number of `steps`."""

    start: float
    stop: float
    step: float
    steps: int


def time_grid(structure: SystemStructure, stop: float | None = None, step: float | None = None) -> TimeGrid:
    """Start, stop, step [s] and number of steps; the last one is shorter when the step does not divide the time.

    stop, step: instead of the package's. Raises `UsageError` for what makes no run.
    """
    start = structure.start_time
    if stop is None:
        stop = structure.stop_time
    if stop is None:
        raise UsageError("the package has no DefaultExperiment with a stopTime; give one with --stop-time")
    if not np.isfinite(stop):
        raise UsageError(f"stop time {stop:g}: it has to be a number of seconds")
    if stop <= start:
        raise UsageError(f"stop time {stop:g} s: it has to be later than the start time {start:g} s")
    if step is None and structure.step_size is not None:
        step = min(structure.step_size, stop - start)  # a shorter run than the package's may be one step
    if step is None:
        step = (stop - start) / DEFAULT_STEPS
    if not (np.isfinite(step) and step > 0.0):
        raise UsageError(f"step {step:g} s: it has to be positive")
    if step > (stop - start) * (1.0 + 1e-9):
        raise UsageError(f"step {step:g} s is longer than the whole run of {stop - start:g} s")
    count = (stop - start) / step
    if start + step == start or stop - step == stop:
        raise UsageError(f"step {step:g} s is less than what times around {stop:g} s resolve")
    if count > 1e10:
        raise UsageError(f"step {step:g} s would take {count:.1e} steps; choose a longer one")
    rounding = max(1e-6, 4.0 * np.finfo(float).eps * max(abs(start), abs(stop)) / step)
    n = round(count) if abs(count - round(count)) < rounding else int(count) + 1
    return TimeGrid(start, stop, step, n)
