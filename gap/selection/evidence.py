"""From fits to evidence: which hypothesis the data prefer.

Evidence of a hypothesis h whose left-out residual, in units of its spread, has the shared energy E_h (a Laplace
approximation; noise has no part in E, see `Observations.shared`):

    S_h = n ln(E_h + e + 1.5 / sqrt(N)) + penalty_h + occam_h - 2 ln prior_h

n is the number of independent pieces that a wrong model's residual counts for, e the energy in which two models differ
that are both right for what they are about (`calibration`); N readings share 1 / sqrt(N) by chance.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from ..estimation.cross_validation import held_out
from ..estimation.gauss_newton import Fit
from ..problem.noise import rms
from ..problem.problem import Problem
from .calibration import Calibration
from .greedy import Hypothesis

PRIOR_NULL, PRIOR_SINGLE, PRIOR_PAIR = 0.3, 0.5, 0.2


@dataclass
class Judged:
    """A hypothesis with its evidence, held-out residual and the energy that this shares, in units of its spread."""

    hypothesis: Hypothesis
    fit: Fit
    """The hypothesis's fit at the time."""
    held_out: np.ndarray
    shared: float
    score: float = 0.0
    terms: dict[str, float] = field(default_factory=dict)
    """What the score is made of."""

    @property
    def gap(self) -> float:
        """Held-out whitened RMS."""
        return rms(self.held_out)


def occam(problem: Problem, fit: Fit, phi: float) -> float:
    """How much of the prior's volume of the effects' parameters the data rule out, twice the log.

    ln det(1 + sd J^T W J sd / phi) of all unknowns less that of the base parameters, which every hypothesis has.
    """
    sd = np.array([x.sd for x in fit.unknowns])
    A = fit.jacobian * (sd / problem.obs.floor[:, None])
    whole = np.eye(len(sd)) + A.T @ A / phi
    base = np.flatnonzero([x.kind == "base" for x in fit.unknowns])
    return float(np.linalg.slogdet(whole)[1] - np.linalg.slogdet(whole[np.ix_(base, base)])[1])


def prior(problem: Problem, h: Hypothesis) -> float:
    """Prior probability of a hypothesis."""
    ids = len({c.id for c in problem.candidates})
    if not h.candidates:
        return PRIOR_NULL
    weight = float(np.prod([c.weight for c in h.candidates]))
    if len(h.candidates) == 1:
        return PRIOR_SINGLE * weight / ids
    return PRIOR_PAIR * weight / max(1.0, ids * (ids - 1) / 2)


def judge(
    problem: Problem, hypotheses: Sequence[Hypothesis], N: np.ndarray, before: Sequence[Judged] = ()
) -> list[Judged]:
    """All hypotheses with their scores, the best first.

    before: what has been judged; a fit found there is not asked about left-out data again.
    """
    known = {id(j.fit): j for j in before}
    made = []
    for h in hypotheses:
        if (j := known.get(id(h.fit))) is not None:
            made.append(Judged(h, h.fit, j.held_out, j.shared))
            continue
        made.append(Judged(h, h.fit, *held_out(problem, h.fit, N)))
    phi = max(1.0, min(made, key=lambda j: j.gap).fit.phi)
    calibration = Calibration.load()
    for j in made:
        j.terms = {
            "fit": calibration.weight(j.shared, len(problem.obs)),
            "penalty": j.fit.penalty(),
            "occam": occam(problem, j.fit, phi),
            "prior": -2.0 * float(np.log(prior(problem, j.hypothesis))),
        }
        j.score = sum(j.terms.values())
    return sorted(made, key=lambda j: j.score)
