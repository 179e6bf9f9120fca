"""From fits to evidence: which hypothesis the data prefer.

Evidence of a hypothesis h whose left-out residual, in units of its spread, has the structured energy E_h (a Laplace
approximation; noise has no part in E, see `Observations.structured_energy`):

    S_h = independent ln(E_h + moved_h + discrepancy + chance(readings) + scatter) + penalty_h + occam_h - 2 ln prior_h

`independent` is the number of pieces that a wrong model's residual counts for, `discrepancy` the energy in which two
models differ that are both right for what they are about, `scatter` that of the form (all three calibrated); readings
share chance(readings) by accident. `moved_h` is what moving the parameters to where S_h is least adds: a fit stands
elsewhere, for it counts every reading. All terms are those of one likelihood (`evidence_terms`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import comb

import numpy as np

from ..estimation.cross_validation import cross_validate
from ..estimation.fit import Fit
from ..estimation.linear import LinearisedModel
from ..problem.noise import rms
from ..problem.problem import Problem
from .hypothesis import Hypothesis
from .probability_calibration import Curvature, ProbabilityCalibration


@dataclass(frozen=True, eq=False)
class RankedHypothesis:
    """A hypothesis with its evidence, held-out residual (n,) and the energy that its readings share."""

    hypothesis: Hypothesis
    cv_residual: np.ndarray
    structured_energy: float
    """Per reading, in units of its spread."""
    curvature: Curvature
    neg2_log_posterior: float = 0.0
    terms: dict[str, float] = field(default_factory=dict)
    """What that is made of."""
    without_bias: Mapping[tuple[str, ...], float] = field(default_factory=dict)
    """Structured energies of sets that lack a sensor's bias that it has, by their effects."""

    @property
    def gap(self) -> float:
        """Held-out normalised RMS."""
        return rms(self.cv_residual)


def curvature(problem: Problem, fit: Fit, nuisance_jacobian: np.ndarray) -> Curvature:
    """How a fit's cost changes around it; nuisances count as parameters whose prior has a standard deviation of 1.

    A period counts by what it does on the average: its minimum is a thousandth wide, but one of hundreds that are
    nearly as deep, and all of them together are what the data leave of its range.
    """
    nuisances = nuisance_jacobian.shape[1]
    jacobian = fit.jacobian.copy()
    for k, x in enumerate(fit.parameters):
        jacobian[:, k] = fit.averaged.get(x.name, jacobian[:, k])
    sd = np.array([*(x.sd for x in fit.parameters), *[1.0] * nuisances])
    linearised = LinearisedModel.around(problem, fit.normalised, fit.model, jacobian, nuisance_jacobian)
    gram = linearised.gram * np.outer(sd, sd) / len(problem.observations)
    biases = np.where(np.arange(nuisances) < fit.channels, fit.nuisances, 0.0)  # clocks may differ as they like
    energy, directions = np.linalg.eigh(gram)
    place = directions.T @ np.concatenate([fit.normalised / sd[: len(fit.parameters)], biases])
    every = np.flatnonzero([*(x.in_every_set for x in fit.parameters), *[True] * nuisances])
    shared = np.linalg.eigvalsh(gram[np.ix_(every, every)])
    return Curvature(*(tuple(map(float, v)) for v in (np.maximum(energy, 0.0), place, np.maximum(shared, 0.0))))


def prior(problem: Problem, h: Hypothesis) -> float:
    """Prior probability of a hypothesis."""
    settings = problem.settings.evidence
    ids = len({c.id for c in problem.candidates})
    if not h.candidates:
        return settings.prior_none
    weight = float(np.prod([c.weight * (1.0 if c.form is None else settings.prior_of_form) for c in h.candidates]))
    size, size_priors = len(h.candidates), settings.prior_of_size
    return size_priors[min(size, len(size_priors)) - 1] * weight / max(1, comb(ids, size))


def rank_hypotheses(
    problem: Problem, hypotheses: Sequence[Hypothesis], nuisance_jacobian: np.ndarray
) -> list[RankedHypothesis]:
    """All hypotheses with their evidence, the best first."""
    calibration, ranked = ProbabilityCalibration.load(), []
    for h in hypotheses:
        residual, energy = cross_validate(problem, h.fit, nuisance_jacobian)
        fit_curvature = curvature(problem, h.fit, nuisance_jacobian)
        evidence_terms = calibration.evidence_terms(energy, fit_curvature, 0.0, len(problem.observations))
        terms = {**evidence_terms._asdict(), "prior": -2.0 * float(np.log(prior(problem, h)))}
        ranked.append(RankedHypothesis(h, residual, energy, fit_curvature, sum(terms.values()), terms))
    return sorted(ranked, key=lambda r: r.neg2_log_posterior)
