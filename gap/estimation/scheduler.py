"""Runs fits side by side, so that their simulations share the processes."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress

from ..problem.problem import Problem
from ..problem.stop import StopRequested
from .fit import Fit, FitFailed, FitTask, SimulationAnswer, SimulationRequest


def run_fits(problem: Problem, fits: Sequence[FitTask]) -> list[Fit | None]:
    """The outcome of every fit; None for one that failed."""
    results: list[Fit | None] = [None] * len(fits)
    waiting: dict[int, SimulationRequest] = {}

    def advance(i: int, answer: SimulationAnswer | None) -> None:
        try:
            waiting[i] = next(fits[i]) if answer is None else fits[i].send(answer)
        except StopIteration as done:
            waiting.pop(i, None)
            results[i] = done.value
        except FitFailed:
            waiting.pop(i, None)

    def interrupt(i: int) -> None:
        """The fit where it stands, if it has begun."""
        with suppress(FitFailed, StopRequested):
            try:
                fits[i].throw(StopRequested())
            except StopIteration as done:
                results[i] = done.value

    for i in range(len(fits)):
        advance(i, None)
    while waiting:
        requests = dict(waiting)
        try:
            coarse, exact = problem.evaluate_both(
                [p for r in requests.values() for p in r.at_fit_step], [p for r in requests.values() for p in r.exact]
            )
        except StopRequested:
            for i in waiting:
                interrupt(i)
            break
        for i, r in requests.items():
            answer = SimulationAnswer(coarse[: len(r.at_fit_step)], exact[: len(r.exact)])
            coarse, exact = coarse[len(r.at_fit_step) :], exact[len(r.exact) :]
            advance(i, answer)
    return results
