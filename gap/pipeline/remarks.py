"""What is odd about a fit and is told beside it."""

from __future__ import annotations

from dataclasses import replace

from ..estimation.nuisances import usual_bias, usual_clock_error
from ..problem.noise import rms
from .state import State


def add_remarks(state: State) -> State:
    """With warnings about the most probable hypothesis."""
    remarks = [*_base_at_tolerance(state), *_sensors(state), *_experiments(state), *_step(state)]
    return replace(state, warnings=(*state.warnings, *remarks))


def base_at_tolerance(state: State) -> list[str]:
    """Base parameters that stand at the end of their tolerance in the most probable hypothesis."""
    fit = state.reported.hypothesis.fit
    ends = zip(fit.parameters, fit.normalised, strict=True)
    return [x.name for x, u in ends if x.kind == "base" and abs(u) > 0.999 * min(-x.low, x.high)]


def _base_at_tolerance(state: State) -> list[str]:
    tolerance = {x.name: x.tolerance_text for x in state.problem.base}
    return [
        f"{name} is at the end of its tolerance of {tolerance[name]}; it may lie beyond"
        for name in base_at_tolerance(state)
    ]


def _sensors(state: State) -> list[str]:
    problem, fit, settings = state.problem, state.reported.hypothesis.fit, state.problem.settings.noise
    texts = []
    for k, (label, q) in enumerate(zip(problem.labels, fit.nuisances[: fit.channels], strict=False)):
        if abs(q) > settings.bias_warning_from:
            value = f"{q * usual_bias(problem, k):.2g} {problem.units.get(label, '1')}"
            texts.append(f"{label}: its sensor seems to read {value} too much, more than sensors usually do")
    for r, (conditions, q) in enumerate(zip(problem.runs, fit.nuisances[fit.channels :], strict=True)):
        if abs(q) > settings.clock_warning_from:
            off = 1e3 * q * usual_clock_error(problem, r)
            texts.append(f"{conditions.name}: its clock seems to be off by {off:.2g} ms")
    for name, values in problem.differing_values(fit.point).items():
        stated = [run.values[name] for run in problem.runs]
        share = next(v / s for v, s in zip(values, stated, strict=True) if s) - 1.0
        texts.append(
            f"{name} is {share:+.2%} off what each run states; calibrated.ssv, which is for all, leaves it out"
        )
    return texts


def _experiments(state: State) -> list[str]:
    catalogue = state.problem.catalogue
    if catalogue.experiments or catalogue.measurables:
        return []
    return ["the catalogue lists no experiments and no measurables, so nothing can be said of what to measure next"]


def _step(state: State) -> list[str]:
    change = rms(state.step_change / state.problem.observations.noise_std) if len(state.step_change) else 0.0
    if change < state.problem.settings.numerics.step_warning_from:
        return []
    return [f"halving the model's step moves it by {change:.2f} times the noise: take a shorter step"]
