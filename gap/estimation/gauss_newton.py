"""Bounded Gauss-Newton on normalised residuals, as a coroutine that asks for simulations so that fits run side by side.

Cost of a point:

    C(u) = sum(r^2) / s + sum((u / sd)^2) + sum(q^2),   r = (measured - model(u) - N q) / noise

q are the linear nuisances (a bias per channel, a clock error per run) with priors of their own, in closed form with u;
s is the dispersion of r where the step begins, at least 1: what a model misses is neither noise that it beats nor as
many readings as it lasts. So the base parameters stay near what is stated until there is something that they explain.

A valve that saturates a millisecond later moves a pressure by hundreds of noise levels for that millisecond. Such a
residual is followed only with the derivative at the point itself: differences are taken as small as the simulations are
smooth, and anew where the last ones did not foretell a step. Near the noise each accepted point is also run exactly,
beside the long steps of the differences.

Stretches in which machine and model are out of step do not lead a fit (`robust_weights`); once it has arrived without
them, it ends with all readings counting in full, from the point on its way that leaves least.
"""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ..problem.noise import rms
from ..problem.parameters import EstimatedParameter, Point, point_of
from ..problem.problem import Problem
from ..problem.stop import StopRequested
from .differences import Differences
from .dispersion import estimate_dispersion, robust_weights
from .fit import Fit, FitFailed, FitTask, SimulationAnswer, SimulationRequest
from .linear import Linear, LinearStep, profile_nuisances

Steps = Generator[SimulationRequest, SimulationAnswer, None]


class _Best(NamedTuple):
    """The point on a fit's way that left least: u (k,), the model's long vector and its correction (n,)."""

    rms: float
    u: np.ndarray
    model: np.ndarray
    correction: np.ndarray


class _Descent:
    """The working state of one fit: `run` lowers the cost from u, `result` is the fit where it stands."""

    def __init__(
        self, problem: Problem, parameters: tuple[EstimatedParameter, ...], u: np.ndarray,
        nuisance_jacobian: np.ndarray, like: Fit | None, at: Fit | None,
    ):  # fmt: skip
        self.problem, self.parameters, self.nuisance_jacobian = problem, parameters, nuisance_jacobian
        self.settings = problem.settings.fit
        self.u = u.astype(float).copy()
        self.like, self.at = like, at
        self.sd = np.array([x.sd for x in parameters])
        self.borrowed = 0 if like is None else len(like.parameters)
        self.foretold = at is not None and at.foretold
        self.corrected = like is not None or self.foretold
        self.unweighted = at is not None and at.unweighted
        self.fine = self.arrived = self.better = self.unfinished = False
        self.real_gain = 0.0
        self.coarse = self.model = self.correction = self.residual = np.zeros(0)
        self.q = np.zeros(0)
        self.jacobian = np.zeros((0, 0))
        self.radius = np.zeros(0)
        self.best = _Best(np.inf, self.u, self.model, self.correction)

    def run(self, iterations: int) -> Steps:
        """At most so many steps; where it is asked to stop, it ends where it stands."""
        yield from self._start()
        try:
            for i in range(iterations):
                if i and self.problem.stop_requested:
                    raise StopRequested
                yield from self._correct()
                share = np.ones(len(self.residual)) if self.unweighted else robust_weights(self.problem, self.residual)
                dispersion = estimate_dispersion(self.problem, share * self.residual)
                yield from self._differentiate(self._difference_step(share * self.residual))
                if (yield from self._step(share, dispersion)):
                    break
        except StopRequested:
            self.unfinished = True

    def _start(self) -> Steps:
        """The model where the fit begins; half way to what is delivered where that does not run."""
        if self.at is not None:
            self.coarse, self.correction = self.at.model - self.at.correction, self.at.correction
        else:
            for _ in range(self.settings.trials):
                found = (yield SimulationRequest([point_of(self.parameters, self.u)], [])).coarse[0]
                if found is not None:
                    self.coarse = found
                    break
                self.u *= 0.5
            else:
                raise FitFailed
            self.correction = np.zeros(len(self.coarse)) if self.like is None else self.like.correction
        self.model = self.coarse + self.correction
        self.q, self.residual = profile_nuisances(self.problem, self.model, self.nuisance_jacobian, 1.0)
        self.jacobian = np.zeros((len(self.model), len(self.u)))
        if self.like is not None:
            self.jacobian[:, : self.borrowed] = self.like.jacobian
        if self.foretold and self.at is not None:
            self.jacobian[:] = self.at.jacobian
        self.best = _Best(rms(self.residual), self.u, self.model, self.correction)
        at_start = zip(self.parameters, self.u, strict=True)
        base = self.settings.base_radius
        self.radius = np.array([base if x.kind == "base" else max(1.0, abs(v)) for x, v in at_start])

    def _correct(self) -> Steps:
        """Near the noise, the difference between exact runs and those at the fit's step."""
        if self.corrected or rms(self.residual) >= self.settings.exact_below:
            return
        model = (yield SimulationRequest([], [point_of(self.parameters, self.u)])).exact[0]
        if model is None:
            raise FitFailed
        self.model = model
        self.correction, self.corrected = model - self.coarse, True
        self.q, self.residual = profile_nuisances(self.problem, model, self.nuisance_jacobian, 1.0)

    def _difference_step(self, weighted: np.ndarray) -> float:
        """Far away the way is seen better by larger differences."""
        h = least = self.problem.discretisation.difference_step
        if not self.fine:
            h = float(np.clip(self.settings.slack * (rms(weighted) - 1.0), least, self.settings.wide_step))
            self.fine = h == least
        return h

    def _differentiate(self, h: float) -> Steps:
        if not self.foretold:
            which = range(self.borrowed, len(self.u))
            differences = Differences(self.problem, self.parameters, self.u, which, self.coarse)
            self.jacobian[:, self.borrowed :] = yield from differences.find(h)

    def _cost(self, residual: np.ndarray, u: np.ndarray, q: np.ndarray, dispersion: float) -> float:
        return float(residual @ residual / dispersion + np.sum((u / self.sd) ** 2) + q @ q)

    def _step(self, share: np.ndarray, dispersion: float) -> Generator[SimulationRequest, SimulationAnswer, bool]:
        """The first of some trial steps that lowers the cost; returns whether the fit has ended."""
        profiled = profile_nuisances(self.problem, self.model, self.nuisance_jacobian, dispersion, share)
        self.q, weighted = profiled
        line = Linear.around(
            self.problem, self.u, self.model, self.jacobian, self.nuisance_jacobian, share=share
        )  # fmt: skip
        now, gain = self._cost(weighted, self.u, self.q, dispersion), 0.0
        self.arrived = self.better = False
        for _ in range(1 if self.foretold else self.settings.trials):
            step = line.step(self.parameters, dispersion, self.radius)
            gain = now - self._cost(line.predicted_residual(step), self.u + step.d, step.q, dispersion)
            self.arrived = gain < self.settings.least_gain
            if self.arrived:
                break
            tried = yield from self._try(step, share, dispersion, now, gain)
            if tried is not None:
                weighted = tried
                break
        self.residual = weighted / share
        return self._ended(now, gain)

    def _try(
        self, step: LinearStep, share: np.ndarray, dispersion: float, now: float, gain: float
    ) -> Generator[SimulationRequest, SimulationAnswer, np.ndarray | None]:
        """Run the model a step away; the weighted residual there if it is better, else a smaller radius."""
        exactly = self.corrected and self.like is None
        wanted: list[Point] = [point_of(self.parameters, self.u + step.d)]
        answer = yield SimulationRequest(wanted, wanted if exactly else [])
        there, exact = answer.coarse[0], answer.exact[0] if exactly else None
        if there is None or (exactly and exact is None):
            self.radius = 0.3 * np.minimum(self.radius, np.maximum(np.abs(step.d), 1e-3))
            return None
        trial = exact if exact is not None else there + self.correction
        q, residual = profile_nuisances(self.problem, trial, self.nuisance_jacobian, dispersion, share)
        self.real_gain = now - self._cost(residual, self.u + step.d, q, dispersion)
        self.better = self.real_gain > 0.0
        if self.better:
            self.u, self.q, self.coarse, self.model = self.u + step.d, q, there, trial
            self.correction = self.model - self.coarse
            if self.real_gain > 0.5 * gain:
                self.radius = np.maximum(self.radius, 2.0 * np.abs(step.d))
            return residual
        if not self.foretold:
            self.radius = 0.3 * np.maximum(np.abs(step.d), 1e-3)
        return None

    def _ended(self, now: float, gain: float) -> bool:
        """Whether no further step is worth its runs."""
        settings, left = self.settings, rms(self.residual)
        if left < self.best.rms:
            self.best = _Best(left, self.u, self.model, self.correction)
        enough = max(settings.small_gain, settings.slow_share * now * (not self.fine))
        slow = (
            self.arrived or not (self.better or self.foretold) or (self.better and 0.5 * gain < self.real_gain < enough)
        )
        if slow and self.fine:
            return True
        self.fine = self.fine or slow
        self.foretold = self.better and not slow and abs(self.real_gain / gain - 1.0) < settings.foretold_within
        return False

    def result(self) -> Fit:
        """The fit where it stands."""
        converged = self.fine and (self.arrived or (self.better and self.real_gain < self.settings.small_gain))
        dispersion = estimate_dispersion(self.problem, self.residual)
        channels = len(self.problem.observations.span)
        return Fit(
            self.parameters, self.u, self.model, self.jacobian, self.q, channels, self.residual, self.correction,
            dispersion, converged, self.foretold, self.unweighted, self.unfinished,
        )  # fmt: skip


def fit(
    problem: Problem,
    parameters: tuple[EstimatedParameter, ...],
    u: np.ndarray,
    nuisance_jacobian: np.ndarray,
    iterations: int,
    like: Fit | None = None,
    at: Fit | None = None,
) -> FitTask:
    """Lower the cost from u (k,), in at most that many iterations without outlying stretches and as many with them.

    like: a fit of the first of the parameters nearby; its derivatives and its correction are kept, and only the other
    parameters' are found. That is cheap, and enough to see whether an effect is worth more.
    at: a fit at u that is to go on.
    """
    if at is None or not at.unweighted:
        descent = _Descent(problem, parameters, u, nuisance_jacobian, like, at)
        yield from descent.run(iterations)
        led = descent.result()
        if like is not None or not led.converged or np.all(robust_weights(problem, led.residual) == 1.0):
            return led
        best = descent.best
        u = best.u
        at = replace(
            led, normalised=u, model=best.model, correction=best.correction, foretold=False, unweighted=True
        )  # fmt: skip
    last = _Descent(problem, parameters, u, nuisance_jacobian, None, at)
    yield from last.run(iterations)
    return last.result()


def with_wide_differences(problem: Problem, at: Fit, nuisance_jacobian: np.ndarray) -> FitTask:
    """The fit where it stands, run exactly, with derivatives that serve for larger moves."""
    coarse = at.model - at.correction
    every = range(len(at.normalised))
    differences = Differences(problem, at.parameters, at.normalised, every, coarse)
    try:
        jacobian = yield from differences.find(problem.settings.fit.wide_step)
        model = (yield SimulationRequest([], [at.point])).exact[0]
    except StopRequested:
        return replace(at, unfinished=True)
    if model is None:
        raise FitFailed
    q, residual = profile_nuisances(problem, model, nuisance_jacobian, at.dispersion)
    return replace(
        at, jacobian=jacobian, model=model, correction=model - coarse, nuisances=q, residual=residual, foretold=False
    )  # fmt: skip
