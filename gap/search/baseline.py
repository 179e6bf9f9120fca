"""The baseline: the base parameters fitted within their tolerances, without any effect."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...core.errors import SimulationError
from ..estimation.dispersion import estimate_dispersion
from ..estimation.fit import Fit
from ..estimation.linear import profile_nuisances
from ..problem.problem import Problem
from ..selection.hypothesis import Hypothesis
from .bank import without_responses
from .refinement import polish, refine
from .sets import Proposal


def as_delivered(
    problem: Problem, nominal: np.ndarray, coarse: np.ndarray, nuisance_jacobian: np.ndarray
) -> Hypothesis:
    """The model as delivered, without derivatives: its long vector from exact runs and from those at the fit's step."""
    q, residual = profile_nuisances(problem, nominal, nuisance_jacobian, 1.0)
    count, dispersion = len(problem.base), estimate_dispersion(problem, residual)
    fit = Fit(
        problem.base, np.zeros(count), nominal, np.zeros((len(nominal), count)), q, len(problem.observations.span),
        residual, nominal - coarse, dispersion,
    )  # fmt: skip
    return Hypothesis((), fit)


def unfitted_base(problem: Problem, nominal: np.ndarray, nuisance_jacobian: np.ndarray) -> Hypothesis:
    """The model as delivered (n,) in place of a refit for which there was no time."""
    h = as_delivered(problem, nominal, nominal, nuisance_jacobian)
    return replace(h, fit=replace(h.fit, unfinished=True))


def deliver(problem: Problem, nuisance_jacobian: np.ndarray) -> Hypothesis:
    """The model as delivered, simulated."""
    (coarse,), (exact,) = problem.answer([{}], [{}])
    if coarse is None or exact is None:
        failure = problem.simulator.failure
        raise SimulationError(f"{problem.campaign.system.name}: the model as delivered does not run: {failure}")
    return as_delivered(problem, exact, coarse, nuisance_jacobian)


def refit_base(problem: Problem, nuisance_jacobian: np.ndarray, delivered: Hypothesis) -> Hypothesis:
    """The base parameters alone, from the model as delivered, with derivatives anew where they have gone far."""
    settings, at = problem.settings.search, delivered
    if not problem.base:
        return replace(delivered, fit=replace(delivered.fit, converged=True))
    for _ in range(settings.base_looks):
        fit = at.fit
        bank = without_responses(problem, fit.point, fit.model - fit.correction, fit.correction)
        found = refine(problem, bank, [Proposal((), fit.point, 0.0)], nuisance_jacobian, settings.steps)
        if not found or found[0].penalised_deviance > at.penalised_deviance - settings.better:
            break
        at = found[0]
    return polish(problem, [at], nuisance_jacobian, settings.polish_looks)[0]
