"""Residuals of all samples, those included that were compared as a swing: nothing is judged by them, they are drawn."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..estimation.fit import Fit
from ..estimation.nuisances import sensor_offsets
from ..problem.problem import Problem


def residuals_of_all_samples(problem: Problem, fits: Sequence[Fit], training: Problem) -> tuple[np.ndarray, ...]:
    """Normalised residuals (n,) of the model as delivered and of fits of the training problem, with their biases; NaN
    where a run fails."""
    whole = replace(problem, observations=problem.samples, recorded=None)
    observations = whole.observations
    biases = [np.zeros(len(observations.span)), *(sensor_offsets(whole, f, training) for f in fits)]
    models = whole.exact([{}, *(f.point for f in fits)])
    unknown = np.full(len(observations), np.nan)
    return tuple(
        unknown if m is None else observations.whiten(m + b[observations.channel])
        for m, b in zip(models, biases, strict=True)
    )


def among_all_samples(problem: Problem, residual: np.ndarray) -> np.ndarray:
    """A normalised residual (n,) of a problem at its place among all samples (m,): NaN for those of a swing."""
    if problem.recorded is None:
        return residual
    whole = {(b.run, b.channel): b for b in problem.recorded.series}
    spread = np.full(len(problem.recorded), np.nan)
    for b in problem.observations.series:
        source = whole[b.run, b.channel]
        spread[source.place][np.isin(source.t, b.t)] = residual[b.place]
    return spread
