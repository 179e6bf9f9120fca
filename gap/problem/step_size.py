"""Which steps the simulations of a diagnosis take: macro steps, and those of finite differences.

What a macro step changes is never called physics. A coupling of second order leaves next to nothing of it, else its
error is extrapolated away (`Problem.exact`), first for the model as delivered; but an effect may bring the machine near
to swinging, where its motion depends on the step as it never did before, so the best fits are asked again
(`search.leaders`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from ...core.errors import SimulationError
from .noise import rms
from .problem import Problem


@dataclass(frozen=True, eq=False)
class StepAssessment:
    """The problem with a discretisation and a noise that allow for the macro step's error."""

    problem: Problem
    nominal: np.ndarray
    """The model as delivered (n,)."""
    change: np.ndarray
    """How far halving the package's step moves each entry (n,); empty where it does not run at half of it."""
    unresolved: str = ""
    """What is to be said where the step changes more than the noise may be widened by."""


def assess_step_error(problem: Problem) -> StepAssessment:
    """Run the model as delivered at its step and at half of it.

    Settles by which method and order the problem's runs are made, and widens its noise by what that leaves.
    """
    name, h, settings = problem.campaign.system.name, problem.macro_step, problem.settings.numerics
    at_step = problem.at_step({}, h)
    if at_step is None:
        hint = "; are the inputs in the units that the campaign says?" if problem.campaign.inputs else ""
        failure = problem.simulator.failure
        raise SimulationError(f"{name}: the model as delivered does not run the campaign: {failure}{hint}")
    half = problem.at_step({}, h / 2.0)
    if half is None:
        unknown = "The model does not run at half its step, so what its step changes is unknown."
        widened = _widened(problem, at_step, np.zeros_like(at_step))
        return StepAssessment(widened, at_step, np.zeros(0), unknown)
    numerical = error = at_step - half
    change = rms(numerical / problem.observations.noise_std)
    if change > settings.second_order_from and (second_order := _second_order(problem, change)) is not None:
        return replace(second_order, change=numerical)
    double = problem.at_step({}, 2.0 * h) if change > settings.extrapolate_from else None
    if double is not None:
        doubled = rms((double - at_step) / problem.observations.noise_std)
        problem = problem.with_discretisation(richardson_order=2 if doubled > 2.0**1.5 * change else 1)
        richardson = problem.discretisation.richardson
        error = richardson(double, at_step) - richardson(at_step, half)
    return StepAssessment(_widened(problem, at_step, error), at_step, numerical, _unresolved(problem, at_step, error))


def _unresolved(problem: Problem, model: np.ndarray, error: np.ndarray) -> str:
    """In which channels the step's error is more than their noise may be widened by."""
    most = problem.settings.noise.step_error_share
    worst: dict[str, float] = {}
    observations = problem.observations.without_model_roughness(model)
    for b in observations.blocks:
        share = observations.step_error_share(b, error)
        if share > most:
            label = problem.labels[b.channel]
            worst[label] = max(worst.get(label, 0.0), share)
    if not worst:
        return ""
    shares = ", ".join(f"{label} by {share:.1f} times its noise" for label, share in worst.items())
    return f"The model's step of {1e3 * problem.macro_step:g} ms alone changes {shares}: what it changes is no gap."


def simulate_as_chosen(problem: Problem, chosen: Problem) -> StepAssessment:
    """The model as delivered for other runs, simulated as was chosen for those of a problem."""
    d = chosen.discretisation
    problem = problem.with_discretisation(macro_step=d.macro_step, richardson_order=d.richardson_order, method=d.method)
    factors = (2.0, 1.0, 0.5) if d.richardson_order else (1.0, 0.5)
    runs = [problem.at_step({}, d.macro_step * k) for k in factors]
    models = [run for run in runs if run is not None]
    if len(models) < len(runs):
        if len(models) and not d.richardson_order:  # not at half its step
            return StepAssessment(_widened(problem, models[0], np.zeros_like(models[0])), models[0], np.zeros(0))
        name, failure = problem.campaign.system.name, problem.simulator.failure
        raise SimulationError(f"{name}: the model as delivered does not run what is held out: {failure}")
    limits = [d.richardson(a, b) for a, b in pairwise(models)] if d.richardson_order else models
    error = limits[0] - limits[1]
    return StepAssessment(_widened(problem, models[-2], error), models[-2], error)


def _widened(problem: Problem, model: np.ndarray, error: np.ndarray) -> Problem:
    return replace(problem, observations=problem.observations.with_numerical_error(model, error))


def _second_order(problem: Problem, change: float) -> StepAssessment | None:
    """The model as delivered by a coupling of second order where that gains.

    What runs tend to as the step goes to 0 is the same by every method. The macro step is then the longest one with an
    error that does not matter, or the package's with the error extrapolated away.
    """
    h, settings, noise = problem.macro_step, problem.settings.numerics, problem.observations.noise_std
    problem = problem.with_discretisation(method=settings.second_order_method)
    single, half = (problem.at_step({}, step) for step in (h, h / 2.0))
    if single is None or half is None or rms((single - half) / noise) > settings.second_order_gain * change:
        return None
    error = single - half
    if rms(error / noise) > settings.extrapolate_from:
        problem = problem.with_discretisation(richardson_order=2)
        return StepAssessment(_widened(problem, single, error), single, error)
    for _ in range(settings.second_order_doublings):
        double = problem.at_step({}, 2.0 * problem.macro_step)
        if double is None or rms((double - single) / noise) > settings.second_order_error:
            break
        problem = problem.with_discretisation(macro_step=2.0 * problem.macro_step)
        error, single = double - single, double
    return StepAssessment(_widened(problem, single, error), single, error)


def choose_fit_step(problem: Problem, nominal: np.ndarray, package_step: float) -> Problem:
    """With the longest step of a fit whose runs are near enough to be corrected.

    nominal: the model as delivered (n,); package_step: of which it is at most some multiple [s].
    """
    settings = problem.settings.numerics
    longest = settings.coarsenings[0] * package_step * (1.0 + 1e-9)
    for coarsening in settings.coarsenings:
        trial = problem.with_discretisation(coarsening=coarsening)
        if trial.fit_step > longest:
            continue
        if coarsening == 1:
            return trial
        y = trial.evaluate([{}])[0]
        if y is not None and rms((y - nominal) / problem.observations.noise_std) < settings.coarse_error:
            return trial
    return problem.with_discretisation(coarsening=settings.coarsenings[-1])


def choose_difference_step(problem: Problem) -> Problem:
    """With the smallest finite difference at which the simulations are smooth.

    A change of all base parameters at once is compared with half of that of twice the step: runs of a solver that
    chooses its steps differ by its tolerance, however small the change is.
    """
    settings = problem.settings.numerics
    if not problem.base:
        return problem
    drawn = np.random.default_rng(0).choice([-1.0, 1.0], len(problem.base))
    for h in settings.difference_steps:
        parameters = zip(problem.base, drawn, strict=True)
        signs = [1.0 if x.low > -2.0 * h else -1.0 if x.high < 2.0 * h else s for x, s in parameters]
        problem = problem.with_discretisation(difference_step=h)
        points = [{x.name: k * h * s for x, s in zip(problem.base, signs, strict=True)} for k in (0.0, 1.0, 2.0)]
        at_start, one, two = problem.evaluate(points)
        if at_start is None or one is None or two is None:
            continue
        first, second = one - at_start, two - one
        significant = np.abs(first) >= max(float(np.median(np.abs(first))), 1e-300)
        smooth = settings.smooth_within
        if significant.any() and np.median(np.abs((second - first)[significant] / first[significant])) < smooth:
            break
    return problem
