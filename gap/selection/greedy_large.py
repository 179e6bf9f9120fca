"""Large effects, looked for from the model as delivered where a refit of the base parameters leaves much.

Such a refit bends the base parameters to what they cannot explain, and the way from there to a large effect may be
closed; an effect that makes the machine swing shows nothing at half its size. So every effect is run at some sizes of
its own, the base parameters follow as far as the delivered model's derivatives tell, and fits start at the best.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..estimation.fit import Fit
from ..estimation.gauss_newton import fit
from ..estimation.linear import Linear
from ..estimation.scheduler import run_fits
from ..problem.noise import rms
from ..problem.parameters import EffectCandidate, EstimatedParameter, penalty, point_of
from ..problem.problem import Problem
from .greedy import MOST, TASTE, continue_fits
from .greedy_screening import nominal_fit, response_curves, screened, sizes
from .hypothesis import Hypothesis, best_of_each, penalised_deviance

SIZES = (1.0, 2.0, 4.0, 8.0)
"""Sizes, in usual ones, at which an effect is run."""

SCAN = 4
"""Most steps of exact runs in a macro step of these runs, for a machine that swings needs it."""

BEGUN, KEPT = 6, 3
"""Starts that are fitted, and those that are carried to the end."""

NEARLY = 0.25
"""How far behind the best fit a start may be, as a share of what that has gained over the baseline."""


@dataclass(frozen=True, eq=False)
class Start:
    """Where a fit of one effect begins: its size and the base parameters that go with it."""

    candidate: EffectCandidate
    parameters: tuple[EstimatedParameter, ...]
    normalised: np.ndarray
    penalised_deviance: float
    """That of the hypothesis there, if the base parameters acted linearly."""

    @property
    def label(self) -> str:
        """That of its candidate."""
        return self.candidate.label

    @property
    def point(self) -> dict[str, float]:
        """In the problem's terms."""
        return point_of(self.parameters, self.normalised)


def scan(problem: Problem, nuisance_jacobian: np.ndarray) -> list[Start]:
    """The best start of each effect, the most promising first; a long step of the fit is shortened to `SCAN`."""
    problem = problem.with_discretisation(coarsening=min(problem.discretisation.coarsening, SCAN))
    nominal = nominal_fit(problem, nuisance_jacobian)
    plain = [c for c in problem.candidates if len(c.parameters) == 1 and c.parameters[0].kind == "effect"]
    wanted = dict.fromkeys((c, s) for c in plain for size in SIZES for s in sizes(c, size))
    made = [
        _start(problem, nominal, s.candidate, s.size, nominal.model + s.slope * s.size, nuisance_jacobian)
        for s in response_curves(problem, nominal, list(wanted))
    ]
    return best_of_each(made, lambda s: s.penalised_deviance)


def _start(
    problem: Problem, nominal: Fit, candidate: EffectCandidate, size: float, model: np.ndarray,
    nuisance_jacobian: np.ndarray,
) -> Start:  # fmt: skip
    rows = screened(problem)
    line = Linear.around(problem, nominal.normalised, model, nominal.jacobian, nuisance_jacobian, rows)
    dispersion = max(1.0, nominal.dispersion * (rms(line.r) / max(nominal.rms, 1e-150)) ** 2)
    step = line.step(nominal.parameters, dispersion, np.ones(len(nominal.normalised)))
    parameters, u = (*nominal.parameters, *candidate.parameters), np.append(step.d, size)
    cost = penalty(parameters, u, step.q[: nominal.channels])
    return Start(candidate, parameters, u, penalised_deviance(rms(line.predicted_residual(step)), cost))


def fits(problem: Problem, starts: Sequence[Start], nuisance_jacobian: np.ndarray) -> list[Hypothesis]:
    """Fits from the starts, the best first; the better ones are carried to the end."""
    begun = run_fits(problem, [fit(problem, s.parameters, s.normalised, nuisance_jacobian, 1) for s in starts])
    made = [Hypothesis((s.candidate,), f) for s, f in zip(starts, begun, strict=True) if f is not None]
    for kept, steps in ((KEPT, TASTE), (KEPT - 1, MOST)):
        made.sort(key=lambda h: h.penalised_deviance)
        made[:kept] = continue_fits(problem, made[:kept], nuisance_jacobian, steps)
    return sorted(made, key=lambda h: h.penalised_deviance)
