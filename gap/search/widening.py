"""Derivatives that serve for refits without a part of the data."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..estimation.cross_validation import cross_validate
from ..estimation.scheduler import run_fits
from ..estimation.wide_jacobian import with_wide_jacobian
from ..problem.problem import Problem
from ..selection.hypothesis import Hypothesis
from .rounds import search_cost


def widen_derivatives(
    problem: Problem, hypotheses: Sequence[Hypothesis], nuisance_jacobian: np.ndarray
) -> list[Hypothesis]:
    """The best few, and the baseline, with derivatives that serve for refits without a part of the data.

    Those over wide steps serve, unless the fit's own foretell better what is left out: where a machine sticks and
    slips, larger moves are another motion. Those by a period over many of its turns are put beside them.
    """
    widened, settings = list(hypotheses), problem.settings.search
    near = search_cost(widened[0]) + settings.polish_within if widened else 0.0
    chosen = [
        k for k, h in enumerate(widened) if not h.candidates or (k < settings.wide_leaders and search_cost(h) < near)
    ]
    tasks = [with_wide_jacobian(problem, widened[k].fit, nuisance_jacobian) for k in chosen]
    for k, wide in zip(chosen, run_fits(problem, tasks), strict=True):
        if wide is not None:
            with_own_jacobian = replace(wide, jacobian=widened[k].fit.jacobian)
            validated = {f: cross_validate(problem, f, nuisance_jacobian) for f in (wide, with_own_jacobian)}
            best = min(validated, key=lambda f: validated[f].structured_energy)
            widened[k] = replace(widened[k], fit=best)
        widened[k] = _with_averaged_periods(problem, widened[k])
    return widened


def _with_averaged_periods(problem: Problem, h: Hypothesis) -> Hypothesis:
    """With the derivatives by its periods over many of their turns, if it has some and these run."""
    averaged = {}
    for x in (x for x in h.fit.parameters if x.longest_run):
        u, share = h.fit.point[x.name], problem.settings.search.period_average
        beside = [min(max(v, x.low), x.high) for v in (u * (1.0 - share), u * (1.0 + share))]
        less, more = problem.evaluate([{**h.fit.point, x.name: v} for v in beside])
        if less is not None and more is not None and beside[1] > beside[0]:
            averaged[x.name] = (more - less) / (beside[1] - beside[0])
    return replace(h, fit=replace(h.fit, averaged=averaged)) if averaged else h
