"""Problems whose model is a formula, so that a fit's answer is known: they stand in for `Problem`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from deepsea_cosim.gap.problem.discretisation import Discretisation
from deepsea_cosim.gap.problem.observations import Observations, RawBlock, gather
from deepsea_cosim.gap.problem.parameters import EffectCandidate, EstimatedParameter, Point
from deepsea_cosim.gap.problem.problem import RunConditions
from deepsea_cosim.gap.problem.stop import StopToken
from deepsea_cosim.gap.settings import DEFAULT, Settings

Model = Callable[[Point, float], np.ndarray | None]
"""The prediction at a point from runs at a macro step [s]; None where they have to stop."""

STEP = 1.0
"""Macro step of exact runs [s] unless a test says otherwise."""


@dataclass(frozen=True)
class FormulaSimulator:
    """What a fit asks of `Simulator`."""

    smooth: dict[str, bool] = field(default_factory=dict)
    failure: str = ""
    stop: StopToken = field(default_factory=StopToken)


@dataclass(frozen=True, eq=False)
class FormulaProblem:
    """The part of `Problem` that fits and the search use. What a macro step adds is the model's affair alone: exact
    runs are not extrapolated."""

    model: Model
    observations: Observations
    base: tuple[EstimatedParameter, ...] = ()
    candidates: tuple[EffectCandidate, ...] = ()
    accepted: tuple[EffectCandidate, ...] = ()
    runs: tuple[RunConditions, ...] = (RunConditions("run", 0.0, {}, {}, {}),)
    labels: tuple[str, ...] = ("m.x",)
    discretisation: Discretisation = field(default_factory=lambda: Discretisation(STEP))
    settings: Settings = DEFAULT
    simulator: FormulaSimulator = field(default_factory=FormulaSimulator)
    stop_requested: bool = False
    recorded: Observations | None = None
    asked: list[tuple[list[Point], list[Point]]] = field(default_factory=list)
    """Points of each call of `evaluate_both`: at the fit's step, and exact."""

    @property
    def samples(self) -> Observations:
        """All samples as they were measured."""
        return self.recorded or self.observations

    @property
    def macro_step(self) -> float:
        """Of exact runs [s]."""
        return self.discretisation.macro_step

    @property
    def fit_step(self) -> float:
        """Of a fit's runs [s]."""
        return self.discretisation.fit_step

    def with_discretisation(self, **changes: Any) -> FormulaProblem:
        """The same with other steps."""
        return replace(self, discretisation=replace(self.discretisation, **changes))

    def of_runs(self, runs: Sequence[int]) -> FormulaProblem:
        """The same, for it has one run."""
        assert list(runs) == [0]
        return self

    def until(self, end: float) -> FormulaProblem:
        """The same of the samples until then [s]."""
        inside, whole = self.observations.time <= end, self.model

        def model(point: Point, step: float) -> np.ndarray | None:
            y = whole(point, step)
            return None if y is None else y[inside]

        return replace(self, model=model, observations=self.observations.until(end))

    def evaluate_both(
        self, coarse: Sequence[Point], exact: Sequence[Point]
    ) -> tuple[list[np.ndarray | None], list[np.ndarray | None]]:
        """Long vectors (n,) at the fit's step, and exact ones."""
        self.asked.append((list(coarse), list(exact)))
        return [self.model(p, self.fit_step) for p in coarse], [self.model(p, self.macro_step) for p in exact]

    def evaluate(self, points: Sequence[Point]) -> list[np.ndarray | None]:
        """Long vectors at the fit's step."""
        return self.evaluate_both(points, [])[0]

    def exact(self, points: Sequence[Point]) -> list[np.ndarray | None]:
        """Exact predictions."""
        return self.evaluate_both([], points)[1]


def at_any_step(machine: Callable[[Point], np.ndarray | None]) -> Model:
    """A model whose runs do not depend on the macro step."""
    return lambda point, step: machine(point)


def one_channel(t: np.ndarray, y: np.ndarray, noise_std: float, stated: bool = True) -> Observations:
    """One run of one channel: readings y (n,) at times t [s]."""
    return gather([RawBlock(0, 0, "m.x", t, y, noise_std, None, stated)])


def measured(
    machine: Callable[[Point], np.ndarray], truth: Point, t: np.ndarray, noise_std: float = 0.01, seed: int = 0
) -> Observations:
    """One channel of a machine at its true point, with white noise."""
    return one_channel(t, machine(truth) + np.random.default_rng(seed).normal(0.0, noise_std, len(t)), noise_std)
