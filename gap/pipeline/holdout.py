"""Runs that a campaign holds out: simulated only with what the others have taught."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ...core.errors import SimulationError
from ..campaign.campaign import Campaign
from ..checks.campaign_sanity import check_campaign
from ..checks.time_unit import check_time
from ..estimation.fit import Fit
from ..estimation.linear import profile_nuisances
from ..estimation.nuisances import nuisance_jacobian_at, sensor_offsets
from ..problem.build import build_problem
from ..problem.find_swings import as_compared, compare_swings
from ..problem.problem import Problem
from ..problem.step_size import simulate_as_chosen


@dataclass(frozen=True, eq=False)
class HoldoutRuns:
    """The problem of the held-out runs, the model as delivered there (n,), and what was noticed about them."""

    problem: Problem
    nominal: np.ndarray
    warnings: tuple[str, ...] = ()
    residuals: dict[bytes, np.ndarray] = field(default_factory=dict)
    """Those that were asked for: the last stages need them again, when nothing can be simulated any more."""

    @property
    def nominal_residual(self) -> np.ndarray:
        """Normalised residual of the model as delivered."""
        return self.problem.observations.whiten(self.nominal)

    def residual_of(self, fit: Fit, training: Problem) -> np.ndarray:
        """Normalised residual (n,) at a fit's point, with its sensor biases and a clock of each run's own."""
        key = fit.normalised.tobytes() + fit.nuisances.tobytes() + repr(sorted(fit.point)).encode()
        if key not in self.residuals:
            self.residuals[key] = self._simulated_residual(fit, training)
        return self.residuals[key]

    def _simulated_residual(self, fit: Fit, training: Problem) -> np.ndarray:
        model = self.problem.exact([fit.point])[0]
        if model is None:
            failure = self.problem.simulator.failure
            raise SimulationError(f"the held-out runs cannot be simulated at the point found: {failure}")
        observations = self.problem.observations
        clocks = nuisance_jacobian_at(self.problem, model)[:, len(observations.span) :]
        offsets = sensor_offsets(self.problem, fit, training)
        shifted = model + np.where(observations.takes_bias, offsets[observations.channel], 0.0)
        return profile_nuisances(self.problem, shifted, clocks, fit.dispersion).residual

    def like(self, training: Problem) -> HoldoutRuns:
        """The same, simulated with the macro step that the fits rest on now."""
        d = training.discretisation
        problem = self.problem.with_discretisation(macro_step=d.macro_step, richardson_order=d.richardson_order)
        return replace(self, problem=problem, residuals={})


def build_holdout(training: Problem, campaign: Campaign) -> HoldoutRuns:
    """The held-out runs of a campaign, simulated as those that are learned from."""
    pool, stop = training.simulator.pool, training.simulator.stop
    problem = build_problem(campaign, training.catalogue, pool, stop, training.settings)
    problem = replace(problem, base=training.base, candidates=training.candidates, accepted=training.accepted)
    time_warnings = check_time(problem)
    assessed = simulate_as_chosen(problem, training)
    warnings = (*time_warnings, *check_campaign(assessed.problem, assessed.nominal))
    problem = compare_swings(with_middles_of(assessed.problem, training), assessed.nominal)
    return HoldoutRuns(problem, as_compared(problem, assessed.nominal), warnings)


def with_middles_of(problem: Problem, training: Problem) -> Problem:
    """A problem in which a sensor's curvature is about the same middle of its range as in what is learned from."""
    observations, known = problem.observations, dict(zip(training.labels, training.observations.middle, strict=False))
    own = zip(problem.labels, observations.middle, strict=False)
    middle = np.array([known.get(label, m) for label, m in own])
    return replace(problem, observations=replace(observations, middle=middle))


def split_runs(campaign: Campaign) -> Sequence[Campaign]:
    """The campaign with the runs to learn from, and, if there are any, with those that are held out."""
    held_out = tuple(r for r in campaign.runs if r.use == "holdout")
    training = replace(campaign, runs=tuple(r for r in campaign.runs if r.use != "holdout"))
    return [training, replace(campaign, runs=held_out, warnings=[])] if held_out else [training]
