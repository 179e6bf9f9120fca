"""A fit as a value: where it stands, what is left, how it ended."""

from __future__ import annotations

from collections.abc import Generator, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from ..problem.noise import rms
from ..problem.parameters import EstimatedParameter, Point, penalty, point_of


@dataclass(frozen=True, eq=False)
class Fit:
    """Parameters (k), their normalised values (k,), the model's prediction (n,), its derivative (n, k), the rest."""

    parameters: tuple[EstimatedParameter, ...]
    normalised: np.ndarray
    model: np.ndarray
    jacobian: np.ndarray
    nuisances: np.ndarray
    """In prior standard deviations: a bias of each channel, then a clock error of each run."""
    channels: int
    residual: np.ndarray
    """Normalised: readings minus model and nuisances, divided by the noise (n,)."""
    correction: np.ndarray
    """Exact runs less those at the fit's step, where that was last found (n,)."""
    dispersion: float
    """What a squared residual counts for less because neighbours share it; at least 1."""
    converged: bool = False
    unfinished: bool = False
    """It was asked to stop on its way."""
    averaged: Mapping[str, np.ndarray] = field(default_factory=dict)
    """Of periods, by name, the derivative (n,) by what they do on the average over many turns."""

    @property
    def point(self) -> dict[str, float]:
        """The point in the problem's terms."""
        return point_of(self.parameters, self.normalised)

    @property
    def rms(self) -> float:
        """Normalised RMS of the residual."""
        return rms(self.residual)

    @property
    def status(self) -> str:
        """How it ended: converged, at_bound (an effect's parameter at an end of its range), at_tolerance (base
        parameters only), stalled or unfinished."""
        if self.unfinished:
            return "unfinished"
        if not self.converged:
            return "stalled"
        at_end = {x.kind for x, end in zip(self.parameters, self.at_bound, strict=True) if end}
        if at_end - {"base"}:
            return "at_bound"
        return "at_tolerance" if at_end else "converged"

    @property
    def at_bound(self) -> tuple[bool, ...]:
        """Of every parameter, whether it stands at an end of its range."""
        ends = zip(self.parameters, self.normalised, strict=True)
        return tuple(bool(min(u - x.low, x.high - u) < 1e-6 * (x.high - x.low)) for x, u in ends)

    def penalty(self) -> float:
        """What parameters and the sensors' biases cost, in prior standard deviations squared; clocks may differ as
        they like."""
        return penalty(self.parameters, self.normalised, self.nuisances[: self.channels])


class SimulationRequest(NamedTuple):
    """Points to be simulated: at the fit's step, and exactly."""

    at_fit_step: list[Point]
    exact: list[Point]


class SimulationAnswer(NamedTuple):
    """Their predictions (n,); None where a run failed."""

    at_fit_step: list[np.ndarray | None]
    exact: list[np.ndarray | None]


FitTask = Generator[SimulationRequest, SimulationAnswer, Fit]
"""Yields points, is sent their predictions, returns a fit."""


class FitFailed(Exception):
    """No point near the start of a fit could be simulated."""
