"""What is odd about a fit and is told beside it."""

from __future__ import annotations

from ..estimation.nuisances import usual_bias, usual_clock_error
from ..problem.noise import rms
from ..selection.posterior import NONE, UNKNOWN
from .state import State


def remarks(state: State) -> list[str]:
    """Warnings about the chosen hypothesis."""
    made = [*_base_at_tolerance(state), *_sensors(state), *_step(state)]
    top = state.causes[0]
    if top.effects not in (NONE, UNKNOWN) and top.ambiguous_with:
        names = ", ".join(" + ".join(e) for e in top.ambiguous_with)
        made.append(f"this campaign can hardly tell {' + '.join(top.effects)} from {names}")
    return made


def _base_at_tolerance(state: State) -> list[str]:
    fit = state.chosen.hypothesis.fit
    return [
        f"{x.name} is at the end of its tolerance of {x.tolerance_text}; it may lie beyond"
        for x, u in zip(fit.parameters, fit.normalised, strict=True) if x.kind == "base" and abs(u) > 0.999
    ]  # fmt: skip


def _sensors(state: State) -> list[str]:
    problem, fit, settings = state.problem, state.chosen.hypothesis.fit, state.problem.settings.noise
    made = []
    for k, (label, q) in enumerate(zip(problem.labels, fit.nuisances[: fit.channels], strict=False)):
        if abs(q) > settings.told_bias:
            value = f"{q * usual_bias(problem, k):.2g} {problem.units.get(label, '1')}"
            made.append(f"{label}: its sensor seems to read {value} too much, more than sensors usually do")
    for r, (info, q) in enumerate(zip(problem.runs, fit.nuisances[fit.channels :], strict=True)):
        if abs(q) > settings.told_clock:
            off = 1e3 * q * usual_clock_error(problem, r)
            made.append(f"{info.name}: its clock seems to be off by {off:.2g} ms")
    for name, values in problem.differing_values(fit.point).items():
        share = values[0] / problem.runs[0].values[name] - 1.0
        made.append(f"{name} is {share:+.2%} off what each run states; calibrated.ssv, which is for all, leaves it out")
    return made


def _step(state: State) -> list[str]:
    change = rms(state.step_change / state.problem.observations.noise_std)
    if change < state.problem.settings.numerics.told_step_error:
        return []
    return [f"halving the model's step moves it by {change:.2f} noise floors: take a shorter step"]
