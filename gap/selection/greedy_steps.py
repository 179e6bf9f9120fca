"""Steps of the greedy search where an effect makes the machine depend on them as the delivered model does not."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ..estimation.gauss_newton import fit
from ..estimation.scheduler import run_fits
from ..problem.noise import rms
from ..problem.parameters import Point
from ..problem.problem import Problem
from .greedy import MOST
from .hypothesis import Hypothesis


def shorten_fit_step(problem: Problem, points: Sequence[Point], left: float) -> Problem:
    """With the longest step of a fit, not longer than now, whose error at the points is small beside the normalised RMS
    that is left; or with the shortest allowed."""
    settings, noise = problem.settings.numerics, problem.observations.noise_std
    exact = problem.exact(points)
    most = max(settings.coarse_error, settings.coarse_share * left)
    now = problem.discretisation.coarsening
    for coarsening in (f for f in settings.coarsenings if f == now or settings.least_coarsening <= f < now):
        problem = problem.with_discretisation(coarsening=coarsening)
        errors = [
            rms((y - z) / noise)
            for y, z in zip(exact, problem.evaluate(points), strict=True) if y is not None and z is not None
        ]  # fmt: skip
        if max(errors, default=0.0) < most:
            break
    return problem


class Refined(NamedTuple):
    """The problem with a macro step short enough for its best fit, and the hypotheses in their order."""

    problem: Problem
    hypotheses: list[Hypothesis]


def refine_macro_step(problem: Problem, hypotheses: Sequence[Hypothesis], nuisance_jacobian: np.ndarray) -> Refined:
    """Halve all macro steps while the best fit's extrapolated run depends on them, and fit the best anew."""
    made, settings = list(hypotheses), problem.settings.numerics
    for _ in range(settings.max_halvings):
        if problem.stop_requested:
            break
        order = sorted(range(len(made)), key=lambda k: made[k].penalised_deviance)
        best = made[order[0]]
        halved = problem.with_discretisation(macro_step=problem.macro_step / 2.0)
        before, after = problem.exact([best.fit.point])[0], halved.exact([best.fit.point])[0]
        noise = problem.observations.noise_std
        change = 0.0 if before is None or after is None else rms((after - before) / noise)
        if change < max(settings.unresolved, settings.unresolved_share * best.fit.rms):
            break
        d = halved.discretisation
        own_order = 2 if d.method == settings.second_order_method else 1
        problem = halved.with_discretisation(richardson_order=d.richardson_order or own_order)
        again = [made[k] for k in order[: settings.refitted]]
        tasks = [fit(problem, h.fit.parameters, h.fit.normalised, nuisance_jacobian, MOST) for h in again]
        made = [freeze_fit(h) for h in made]
        for k, found in zip(order, run_fits(problem, tasks), strict=False):
            if found is not None:
                made[k] = replace(made[k], fit=found, finished=False)
    return Refined(problem, made)


def freeze_fit(h: Hypothesis) -> Hypothesis:
    """A hypothesis whose fit rests on other macro steps than now cannot go on."""
    return replace(h, fit=replace(h.fit, converged=True), quick=False, finished=True)
