"""Fits gone on with to the end: exact runs where they stand, derivatives from small steps."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..problem.problem import Problem
from ..selection.hypothesis import Hypothesis
from .quasi_newton import QuickFit, as_hypothesis, begin_fit, differentiate, iterate
from .response_bank import response_rows


@dataclass(eq=False)
class _Polished:
    """A hypothesis on its way."""

    latest: Hypothesis
    confirmed: Hypothesis | None = None
    """As it stood at its last exact run that was better than the one before."""
    gained: float = np.inf
    """What the steps since then have gained, in -2 log probability."""
    active: bool = True

    def take_back(self) -> None:
        """To the last exact run."""
        self.latest = self.confirmed or self.latest


def polish(
    problem: Problem, hypotheses: Sequence[Hypothesis], nuisance_jacobian: np.ndarray, rounds: int,
    derivatives_known: bool = False,
) -> list[Hypothesis]:  # fmt: skip
    """The hypotheses fitted on with exact runs where they stand and derivatives from small steps, side by side.

    A valve that saturates a millisecond later moves a pressure by hundreds of noise levels for that millisecond: near
    the data only the derivative at the point itself leads on; they are taken anew after a round that has gained much,
    and after others what its steps have found serves. Where they are known, the first round takes those that are not
    there yet only. A hypothesis that does not run stays as it is.
    """
    settings, every = problem.settings.search, [_Polished(h) for h in hypotheses]
    for k in range(rounds + 1):
        begun = _run_exactly(problem, [p for p in every if p.active], nuisance_jacobian)
        if not begun:
            break
        for p in every:
            p.active = False
        if k < rounds:
            outdated = [f for p, f in begun if p.gained > settings.jacobian_refresh_gain]
            differentiate(problem, outdated, missing_only=derivatives_known and k == 0)
        for p, f in begun:
            p.confirmed = as_hypothesis(problem, f, converged=True)
        if k < rounds:
            iterate(problem, [f for _, f in begun], response_rows(problem), nuisance_jacobian, settings.polish_steps)
        for p, f in begun:
            assert p.confirmed is not None
            p.gained = p.confirmed.penalised_deviance - f.cost
            p.active = p.gained > settings.least_gain
            p.latest = as_hypothesis(problem, f) if p.active else p.confirmed
    return [p.latest for p in every]


def _run_exactly(
    problem: Problem, under_way: Sequence[_Polished], nuisance_jacobian: np.ndarray
) -> list[tuple[_Polished, QuickFit]]:
    """Fits from exact runs where the hypotheses stand; a step that the exact run does not bear out is taken back, and
    that hypothesis is at its end."""
    begun: list[tuple[_Polished, QuickFit]] = []
    if not under_way or problem.stop_requested:
        return begun
    for p, exact in zip(under_way, problem.exact([p.latest.fit.point for p in under_way]), strict=True):
        f = None if exact is None else _begin_from(problem, p.latest, exact, nuisance_jacobian)
        if f is None or (p.confirmed is not None and not f.cost < p.confirmed.penalised_deviance):
            p.take_back()
        else:
            begun.append((p, f))
    return begun


def _begin_from(problem: Problem, h: Hypothesis, exact: np.ndarray, nuisance_jacobian: np.ndarray) -> QuickFit:
    fit = h.fit
    correction = exact - (fit.model - fit.correction)
    return begin_fit(
        problem, h.candidates, fit.parameters, fit.normalised, exact, correction, fit.jacobian, nuisance_jacobian
    )  # fmt: skip
