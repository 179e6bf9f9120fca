"""From fits to evidence: which hypothesis the data prefer.

Evidence of a hypothesis h with mean square m_h of its held-out residual (a Laplace approximation):

    S_h = n_eff ln(m_h) + penalty_h + ln det(1 + J^T J sd^2 / phi) - 2 ln prior_h

n_eff is the number of readings that count (`calibration`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from .calibration import Calibration
from .fit import Fit
from .heldout import left_out
from .noise import rms
from .problem import Problem
from .search import Hypothesis

PRIOR_NULL, PRIOR_SINGLE, PRIOR_PAIR = 0.3, 0.5, 0.2


@dataclass
class Judged:
    """A hypothesis with its evidence and held-out residual."""

    hypothesis: Hypothesis
    held_out: np.ndarray
    score: float = 0.0
    terms: dict[str, float] = field(default_factory=dict)
    """What the score is made of."""

    @property
    def gap(self) -> float:
        """Held-out whitened RMS."""
        return rms(self.held_out)


def occam(problem: Problem, fit: Fit) -> float:
    """ln det(1 + sd J^T W J sd / phi): how much of the prior's volume the data rule out, twice the log."""
    if not fit.unknowns:
        return 0.0
    sd = np.array([x.sd for x in fit.unknowns])
    A = fit.jacobian * (sd / problem.obs.floor[:, None])
    return float(np.linalg.slogdet(np.eye(len(sd)) + A.T @ A / fit.phi)[1])


def prior(problem: Problem, h: Hypothesis) -> float:
    """Prior probability of a hypothesis."""
    ids = len({c.id for c in problem.candidates})
    if not h.candidates:
        return PRIOR_NULL
    weight = float(np.prod([c.weight for c in h.candidates]))
    if len(h.candidates) == 1:
        return PRIOR_SINGLE * weight / ids
    return PRIOR_PAIR * weight / (ids * (ids - 1) / 2)


def judge(problem: Problem, hypotheses: Sequence[Hypothesis], N: np.ndarray) -> list[Judged]:
    """All hypotheses with their scores, the best first."""
    made = [Judged(h, left_out(problem, h.fit, N)) for h in hypotheses]
    best = min(made, key=lambda j: j.gap)
    available = float(len(problem.obs))
    n_eff = min(Calibration.load().independent, available)
    shared = max(1.0, best.hypothesis.fit.phi)
    for j in made:
        fit = j.hypothesis.fit
        j.terms = {
            "available": available,
            "independent": n_eff,
            "fit": n_eff * float(np.log(max(j.gap**2, 1e-12))),
            "penalty": fit.penalty(),
            "occam": occam(problem, replace(fit, phi=shared)),
            "prior": -2.0 * float(np.log(prior(problem, j.hypothesis))),
        }
        j.score = sum(v for k, v in j.terms.items() if k not in ("available", "independent"))
    return sorted(made, key=lambda j: j.score)
