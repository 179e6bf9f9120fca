"""The linear nuisances of every fit: a bias of each channel's sensor and a clock error of each run."""

from __future__ import annotations

import numpy as np

from ..problem.problem import Problem
from .fit import Fit


def nuisance_jacobian_at(problem: Problem, model: np.ndarray) -> np.ndarray:
    """Columns (n, m) of the nuisances, in the unit of the readings for one prior standard deviation each."""
    observations = problem.observations
    columns = []
    for k in range(len(observations.span)):
        columns.append(np.where((observations.channel == k) & observations.takes_bias, usual_bias(problem, k), 0.0))
    slope = observations.slope(model)
    for r in range(len(problem.runs)):
        columns.append(np.where(observations.run == r, -usual_clock_error(problem, r) * slope, 0.0))
    return np.stack(columns, axis=1)


def usual_bias(problem: Problem, channel: int) -> float:
    """Usual bias of a channel's sensor, in its unit."""
    observations, settings = problem.observations, problem.settings.noise
    return float(
        max(settings.bias_of_span * observations.span[channel], settings.bias_of_level * observations.level[channel])
    )


def sensor_offsets(problem: Problem, fit: Fit, training: Problem) -> np.ndarray:
    """What the sensors of a problem's channels (k,) read too much, in their units, by a fit of the training problem."""
    labelled = zip(training.labels, fit.nuisances[: fit.channels], strict=False)
    biases = {label: q * usual_bias(training, j) for j, (label, q) in enumerate(labelled)}
    return np.array([biases.get(label, 0.0) for label in problem.labels[: len(problem.observations.span)]])


def usual_clock_error(problem: Problem, run: int) -> float:
    """Usual misalignment of a run's clock [s]."""
    settings = problem.settings.noise
    intervals = [b.interval for b in problem.samples.series if b.run == run]
    return min(settings.max_clock_offset, settings.clock_offset * min(intervals, default=0.0))
