"""Which steps the simulations of a diagnosis take: macro steps, and those of finite differences.

What a macro step changes is never called physics. A coupling of second order leaves next to nothing of it, else its
error is extrapolated away (`Problem.exact`), first for the model as delivered; but an effect may bring the machine near
to swinging, where its motion depends on the step as it never did before, so the best fits are asked again (`resolve`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from ...core.errors import SimulationError
from ...master.algorithms import NAMES
from ..estimation.gauss_newton import drive, fit
from ..selection.greedy import MOST, Hypothesis
from .noise import rms
from .problem import DIFFERENCES, Point, Problem

NUMERICAL = 0.03
"""RMS change, in floors, that halving the macro step makes and that is worth an extrapolation."""

SECOND_ORDER, GAINS, SWINGING = "nepce", 0.3, 0.15
"""A coupling of second order that every FMU can take, and the share of the default one's error that it may have to be
taken. A run of it costs twice as much, so it is tried from that RMS change on: the machine is near to swinging."""

LONGER, ENOUGH = 2, 0.1
"""How often the package's step is doubled for it at most, and the change [floors] that this may make."""

FACTORS = (8, 4, 2, 1)
"""Macro steps of an estimation, in those of exact runs."""

COARSE_ERROR = 5.0
"""Largest RMS difference of a coarse run to one at the package's step, in floors, before correction."""

SHORTEST = 2
"""Fewest steps of the package in a macro step that is shortened for a machine that swings; a run then costs half of one
at the package's step."""

LONG_STEPS = 0.1
"""Error that a long macro step may make, as a share of what is left."""

UNRESOLVED, SHARE = 0.2, 0.1
"""RMS change, in floors and as a share of what is left, by which the extrapolated run at a best fit may still depend on
the step."""

HALVINGS, REFITTED = 2, 4
"""How often the step of exact runs is halved at most, and the fits that are made anew then."""

ROUGH = 0.1
"""How far, in its own size, a change may be from half of that of twice the step to be smooth."""


def numerical_gap(problem: Problem) -> tuple[np.ndarray, np.ndarray]:
    """The model as delivered, and how far halving its step moves each entry.

    Settles by which order the problem's runs are extrapolated, and widens its floors by what that leaves.
    """
    name, h = problem.campaign.system.name, problem.fine
    at_step = problem.at_step({}, h)
    if at_step is None:
        hint = "; are the inputs in the units that the campaign says?" if problem.campaign.inputs else ""
        raise SimulationError(f"{name}: the model as delivered does not run the campaign: {problem.failure}{hint}")
    half = problem.at_step({}, h / 2.0)
    if half is None:
        raise SimulationError(f"{name}: the model does not run at half its step: {problem.failure}")
    numerical = left = at_step - half
    change = rms(numerical / problem.obs.floor)
    if change > SWINGING and (better := _second_order(problem, change)) is not None:
        problem.obs.widen(*better)
        return better[0], numerical
    double = problem.at_step({}, 2.0 * h) if change > NUMERICAL else None
    if double is not None:
        problem.order = 2 if rms((double - at_step) / problem.obs.floor) > 2.0**1.5 * change else 1
        left = problem.limit(double, at_step) - problem.limit(at_step, half)
    problem.obs.widen(at_step, left)
    return at_step, numerical


def as_chosen(problem: Problem, chosen: Problem) -> np.ndarray:
    """The model as delivered for other runs, simulated as was chosen for those of a problem; widens their floors."""
    problem.fine, problem.order, problem.method = chosen.fine, chosen.order, chosen.method
    runs = [problem.at_step({}, problem.fine * k) for k in ((2.0, 1.0, 0.5) if problem.order else (1.0, 0.5))]
    found = [run for run in runs if run is not None]
    if len(found) < len(runs):
        name = problem.campaign.system.name
        raise SimulationError(f"{name}: the model as delivered does not run what is held out: {problem.failure}")
    limits = [problem.limit(a, b) for a, b in pairwise(found)] if problem.order else found
    problem.obs.widen(found[-2], limits[0] - limits[1])
    return found[-2]


def _second_order(problem: Problem, change: float) -> tuple[np.ndarray, np.ndarray] | None:
    """The model as delivered and its error, by a coupling of second order where that gains; else the problem stays.

    What runs tend to as the step goes to 0 is the same by every method. The macro step is then the longest one with an
    error that does not matter, or the package's with the error extrapolated away.
    """
    h = problem.fine
    problem.method = SECOND_ORDER
    found = [problem.at_step({}, step) for step in (h, h / 2.0)]
    if found[0] is None or found[1] is None or rms((found[0] - found[1]) / problem.obs.floor) > GAINS * change:
        problem.method = NAMES[0]
        return None
    here, left = found[0], found[0] - found[1]
    if rms(left / problem.obs.floor) > NUMERICAL:
        problem.order = 2
        return here, left
    for _ in range(LONGER):
        there = problem.at_step({}, 2.0 * problem.fine)
        if there is None or rms((there - here) / problem.obs.floor) > ENOUGH:
            break
        problem.fine *= 2.0
        left, here = there - here, there
    return here, left


def lengthen(problem: Problem, delivered: np.ndarray, step: float) -> None:
    """The longest macro step, up to `FACTORS` times the package's [s], whose runs are near enough to be corrected."""
    for factor in FACTORS:
        problem.factor = factor
        if factor * problem.fine > FACTORS[0] * step * (1.0 + 1e-9):
            continue
        if factor == 1:
            return
        y = problem.evaluate([{}])[0]
        if y is not None and rms((y - delivered) / problem.obs.floor) < COARSE_ERROR:
            return


def shorten(problem: Problem, points: Sequence[Point], left: float) -> None:
    """The longest macro step, not longer than now, whose error at the points is small beside the RMS that is left; or
    `SHORTEST`."""
    exact = problem.exact(points)
    most = max(COARSE_ERROR, LONG_STEPS * left)
    for factor in (f for f in FACTORS if f == problem.factor or SHORTEST <= f < problem.factor):
        problem.factor = factor
        errors = [
            rms((y - z) / problem.obs.floor)
            for y, z in zip(exact, problem.evaluate(points), strict=True) if y is not None and z is not None
        ]  # fmt: skip
        if max(errors, default=0.0) < most:
            return


def resolve(problem: Problem, hypotheses: Sequence[Hypothesis], N: np.ndarray) -> None:
    """Halve all macro steps while the best fit's extrapolated run depends on them, and fit the best anew, in place."""
    for _ in range(HALVINGS):
        if problem.hurry():
            return
        ranked = sorted(hypotheses, key=lambda h: h.merit)
        best = ranked[0]
        before = problem.exact([best.fit.point])[0]
        problem.fine /= 2.0
        after = problem.exact([best.fit.point])[0]
        change = 0.0 if before is None or after is None else rms((after - before) / problem.obs.floor)
        if change < max(UNRESOLVED, SHARE * best.fit.rms):
            problem.fine *= 2.0
            return
        problem.order = problem.order or (2 if problem.method == SECOND_ORDER else 1)
        asks = [fit(problem, h.fit.unknowns, h.fit.u, N, MOST) for h in ranked[:REFITTED]]
        for h in ranked:
            lay_aside(h)
        for h, found in zip(ranked, drive(problem, asks), strict=False):
            if found is not None:
                h.fit, h.finished = found, False


def lay_aside(h: Hypothesis) -> None:
    """A hypothesis whose fit rests on other macro steps than now cannot go on."""
    h.fit, h.quick, h.finished = replace(h.fit, converged=True), False, True


def choose_difference(problem: Problem) -> None:
    """The smallest finite difference at which the simulations are smooth.

    A change of all base parameters at once is compared with half of that of twice the step: runs of a solver that
    chooses its steps differ by its tolerance, however small the change is.
    """
    if not problem.base:
        return
    signs = np.random.default_rng(0).choice([-1.0, 1.0], len(problem.base))
    for h in DIFFERENCES:
        problem.difference = h
        points = [{x.name: k * h * s for x, s in zip(problem.base, signs, strict=True)} for k in (0.0, 1.0, 2.0)]
        here, one, two = problem.evaluate(points)
        if here is None or one is None or two is None:
            continue
        first, second = one - here, two - one
        seen = np.abs(first) >= max(float(np.median(np.abs(first))), 1e-300)
        if seen.any() and np.median(np.abs((second - first)[seen] / first[seen])) < ROUGH:
            return
