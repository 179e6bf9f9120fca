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
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from deepsea_cosim.core.errors import SimulationError
from deepsea_cosim.gap.estimation.differences import FiniteDifferences
from deepsea_cosim.gap.estimation.dispersion import estimate_dispersion
from deepsea_cosim.gap.estimation.fit import Fit, FitFailed, FitTask, SimulationAnswer, SimulationRequest
from deepsea_cosim.gap.estimation.linear import LinearisedModel, LinearStep, profile_nuisances
from deepsea_cosim.gap.estimation.scheduler import run_fits
from deepsea_cosim.gap.problem.noise import rms
from deepsea_cosim.gap.problem.parameters import EstimatedParameter, Point, point_of
from deepsea_cosim.gap.problem.problem import Problem
from deepsea_cosim.gap.problem.stop import StopRequested

Steps = Generator[SimulationRequest, SimulationAnswer, None]


@dataclass(frozen=True, kw_only=True)
class DescentSettings:
    """How a fit descends."""

    exact_below: float = 10.0
    """Normalised RMS below which the error of the fit's longer step matters and is corrected."""
    slack: float = 0.001
    """Step of a difference for each unit of normalised RMS that is left beyond 1: far away larger steps see better."""
    slow_share: float = 0.02
    """Share of the cost that a step has to gain for larger differences to be kept."""
    outlier_window: float = 0.5
    """Time over which a residual's RMS is taken to find stretches out of step [s]."""
    outlier_from: float = 2.0
    """Times the channel's usual RMS from which a stretch counts for no more than that in the next step."""
    trials: int = 4
    """Steps that are tried from a point."""
    least_gain: float = 0.3
    """Gain in cost below which a step is not worth a run."""
    small_gain: float = 2.0
    """Gain in cost below which the next step will not be worth one."""
    foretold_within: float = 0.1
    """How nearly a step has to have done what was foretold for its derivatives to serve again."""
    base_radius: float = 1.0
    """Trust radius of a base parameter at the start, in its tolerance."""


SETTINGS = DescentSettings()


@dataclass(frozen=True, eq=False, kw_only=True)
class DescentFit(Fit):
    """A fit that can be gone on with."""

    reuses_jacobian: bool = False
    """The derivatives have foretold the last step and serve for the next."""
    unweighted: bool = False
    """All readings count in full from here on."""


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
        nuisance_jacobian: np.ndarray, nearby: Fit | None, resumed: DescentFit | None,
    ):  # fmt: skip
        self.problem, self.parameters, self.nuisance_jacobian = problem, parameters, nuisance_jacobian
        self.settings = SETTINGS
        self.u = u.astype(float).copy()
        self.nearby, self.resumed = nearby, resumed
        self.sd = np.array([x.sd for x in parameters])
        self.borrowed = 0 if nearby is None else len(nearby.parameters)
        self.reuses_jacobian = resumed is not None and resumed.reuses_jacobian
        self.corrected = nearby is not None or self.reuses_jacobian
        self.unweighted = resumed is not None and resumed.unweighted
        self.finest = self.no_gain_left = self.improved = self.unfinished = False
        self.actual_gain = 0.0
        self.coarse_model = self.model = self.correction = self.residual = np.zeros(0)
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
                weights = (
                    np.ones(len(self.residual)) if self.unweighted else robust_weights(self.problem, self.residual)
                )
                dispersion = estimate_dispersion(self.problem, weights * self.residual)
                yield from self._differentiate(self._difference_step(weights * self.residual))
                if (yield from self._step(weights, dispersion)):
                    break
        except StopRequested:
            self.unfinished = True

    def _start(self) -> Steps:
        """The model where the fit begins; half way to what is delivered where that does not run."""
        if self.resumed is not None:
            self.coarse_model, self.correction = self.resumed.model - self.resumed.correction, self.resumed.correction
        else:
            for _ in range(self.settings.trials):
                coarse = (yield SimulationRequest([point_of(self.parameters, self.u)], [])).at_fit_step[0]
                if coarse is not None:
                    self.coarse_model = coarse
                    break
                self.u *= 0.5
            else:
                raise FitFailed
            self.correction = np.zeros(len(self.coarse_model)) if self.nearby is None else self.nearby.correction
        self.model = self.coarse_model + self.correction
        self.q, self.residual = profile_nuisances(self.problem, self.model, self.nuisance_jacobian, 1.0)
        self.jacobian = np.zeros((len(self.model), len(self.u)))
        if self.nearby is not None:
            self.jacobian[:, : self.borrowed] = self.nearby.jacobian
        if self.reuses_jacobian and self.resumed is not None:
            self.jacobian[:] = self.resumed.jacobian
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
        self.correction, self.corrected = model - self.coarse_model, True
        self.q, self.residual = profile_nuisances(self.problem, model, self.nuisance_jacobian, 1.0)

    def _difference_step(self, weighted: np.ndarray) -> float:
        """Far away the way is seen better by larger differences."""
        h = least = self.problem.discretisation.difference_step
        if not self.finest:
            h = float(np.clip(self.settings.slack * (rms(weighted) - 1.0), least, self.problem.settings.fit.wide_step))
            self.finest = h == least
        return h

    def _differentiate(self, h: float) -> Steps:
        if not self.reuses_jacobian:
            which = range(self.borrowed, len(self.u))
            differences = FiniteDifferences(self.problem, self.parameters, self.u, which, self.coarse_model)
            self.jacobian[:, self.borrowed :] = yield from differences.compute(h)

    def _cost(self, residual: np.ndarray, u: np.ndarray, q: np.ndarray, dispersion: float) -> float:
        return float(residual @ residual / dispersion + np.sum((u / self.sd) ** 2) + q @ q)

    def _step(self, weights: np.ndarray, dispersion: float) -> Generator[SimulationRequest, SimulationAnswer, bool]:
        """The first of some trial steps that lowers the cost; returns whether the fit has ended."""
        profiled = profile_nuisances(self.problem, self.model, self.nuisance_jacobian, dispersion, weights)
        self.q, weighted = profiled
        linearised = LinearisedModel.around(
            self.problem, self.u, self.model, self.jacobian, self.nuisance_jacobian, weights=weights
        )  # fmt: skip
        current_cost, predicted_gain = self._cost(weighted, self.u, self.q, dispersion), 0.0
        self.no_gain_left = self.improved = False
        for _ in range(1 if self.reuses_jacobian else self.settings.trials):
            step = linearised.step(self.parameters, dispersion, self.radius)
            predicted_gain = current_cost - self._cost(
                linearised.predicted_residual(step), self.u + step.d, step.q, dispersion
            )
            self.no_gain_left = predicted_gain < self.settings.least_gain
            if self.no_gain_left:
                break
            accepted_residual = yield from self._try_step(step, weights, dispersion, current_cost, predicted_gain)
            if accepted_residual is not None:
                weighted = accepted_residual
                break
        self.residual = weighted / weights
        return self._has_ended(current_cost, predicted_gain)

    def _try_step(
        self, step: LinearStep, weights: np.ndarray, dispersion: float, current_cost: float, predicted_gain: float
    ) -> Generator[SimulationRequest, SimulationAnswer, np.ndarray | None]:
        """Run the model a step away; the weighted residual there if it is better, else a smaller radius."""
        exactly = self.corrected and self.nearby is None
        points: list[Point] = [point_of(self.parameters, self.u + step.d)]
        answer = yield SimulationRequest(points, points if exactly else [])
        trial_coarse, exact = answer.at_fit_step[0], answer.exact[0] if exactly else None
        if trial_coarse is None or (exactly and exact is None):
            self.radius = 0.3 * np.minimum(self.radius, np.maximum(np.abs(step.d), 1e-3))
            return None
        trial = exact if exact is not None else trial_coarse + self.correction
        q, residual = profile_nuisances(self.problem, trial, self.nuisance_jacobian, dispersion, weights)
        self.actual_gain = current_cost - self._cost(residual, self.u + step.d, q, dispersion)
        self.improved = self.actual_gain > 0.0
        if self.improved:
            self.u, self.q, self.coarse_model, self.model = self.u + step.d, q, trial_coarse, trial
            self.correction = self.model - self.coarse_model
            if self.actual_gain > 0.5 * predicted_gain:
                self.radius = np.maximum(self.radius, 2.0 * np.abs(step.d))
            return residual
        if not self.reuses_jacobian:
            self.radius = 0.3 * np.maximum(np.abs(step.d), 1e-3)
        return None

    def _has_ended(self, current_cost: float, predicted_gain: float) -> bool:
        """Whether no further step is worth its runs."""
        settings, residual_rms = self.settings, rms(self.residual)
        if residual_rms < self.best.rms:
            self.best = _Best(residual_rms, self.u, self.model, self.correction)
        enough = max(settings.small_gain, settings.slow_share * current_cost * (not self.finest))
        slow = (
            self.no_gain_left
            or not (self.improved or self.reuses_jacobian)
            or (self.improved and 0.5 * predicted_gain < self.actual_gain < enough)
        )
        if slow and self.finest:
            return True
        self.finest = self.finest or slow
        self.reuses_jacobian = (
            self.improved and not slow and abs(self.actual_gain / predicted_gain - 1.0) < settings.foretold_within
        )
        return False

    def result(self) -> DescentFit:
        """The fit where it stands."""
        converged = self.finest and (
            self.no_gain_left or (self.improved and self.actual_gain < self.settings.small_gain)
        )
        dispersion = estimate_dispersion(self.problem, self.residual)
        channels = len(self.problem.observations.span)
        return DescentFit(
            self.parameters, self.u, self.model, self.jacobian, self.q, channels, self.residual, self.correction,
            dispersion, converged, self.unfinished, reuses_jacobian=self.reuses_jacobian, unweighted=self.unweighted,
        )  # fmt: skip


def fit(
    problem: Problem,
    parameters: tuple[EstimatedParameter, ...],
    u: np.ndarray,
    nuisance_jacobian: np.ndarray,
    iterations: int,
    nearby: Fit | None = None,
    resumed: DescentFit | None = None,
) -> FitTask:
    """Lower the cost from u (k,), in at most that many iterations without outlying stretches and as many with them.

    nearby: a fit near u of the first of the parameters; its derivatives and its correction are kept, and only the
    other parameters' are found. That is cheap, and enough to see whether an effect is worth more.
    resumed: a fit at u that is to go on.
    """
    if resumed is None or not resumed.unweighted:
        descent = _Descent(problem, parameters, u, nuisance_jacobian, nearby, resumed)
        yield from descent.run(iterations)
        robust = descent.result()
        if nearby is not None or not robust.converged or np.all(robust_weights(problem, robust.residual) == 1.0):
            return robust
        best = descent.best
        u = best.u
        resumed = replace(
            robust, normalised=u, model=best.model, correction=best.correction, reuses_jacobian=False, unweighted=True
        )  # fmt: skip
    full_descent = _Descent(problem, parameters, u, nuisance_jacobian, None, resumed)
    yield from full_descent.run(iterations)
    return full_descent.result()


def robust_weights(problem: Problem, residual: np.ndarray) -> np.ndarray:
    """By how much each reading of a normalised residual (n,) counts in the next step, from 0 to 1.

    Where a machine swings or rests a second longer than the model, the residual is large whatever the parameters are,
    and says nothing about the way to go: there, where its RMS over a window is more than some times the channel's usual
    one, and than the noise, it counts no more than that. (An M-estimator with weights of windows.)
    """
    observations, settings = problem.observations, SETTINGS
    local = np.abs(residual)
    for b in observations.blocks:
        m = min(len(b.t), 1 + round(settings.outlier_window / b.interval)) if b.interval > 0.0 else 1
        if m > 1:
            ones = np.ones(m)
            power = np.convolve(residual[b.place] ** 2, ones, "same") / np.convolve(np.ones(len(b.t)), ones, "same")
            local[b.place] = np.sqrt(power)
    weights = np.ones(len(residual))
    for k in range(len(observations.span)):
        in_channel = observations.channel == k
        if not in_channel.any():
            continue
        usual = settings.outlier_from * max(1.0, float(np.median(local[in_channel])))
        weights[in_channel] = np.minimum(1.0, usual / np.maximum(local[in_channel], usual))
    return weights


def run_fit(problem: Problem, task: FitTask) -> Fit:
    """The outcome of one fit; raises `SimulationError` where no point near its start can be simulated."""
    outcome = run_fits(problem, [task])[0]
    if outcome is None and problem.stop_requested:
        raise StopRequested
    if outcome is None:
        failure = problem.simulator.failure
        raise SimulationError(f"{problem.campaign.system.name}: a refit cannot be simulated: {failure}")
    return outcome
