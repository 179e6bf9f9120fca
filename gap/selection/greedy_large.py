"""Large effects, looked for from the model as delivered where a refit of the base parameters leaves much.

Such a refit bends the base parameters to what they cannot explain, and the way from there to a large effect may be
closed; an effect that makes the machine swing shows nothing at half its size. So every effect is run at some sizes of
its own, the base parameters follow as far as the delivered model's derivatives tell, and fits start at the best.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..estimation.gauss_newton import Fit, Linear, drive, fit, penalty, point_of
from ..problem.noise import rms
from ..problem.problem import Candidate, Problem, Unknown
from .greedy import MOST, TASTE, Hypothesis, as_delivered, best_of_each, carry_on, merit, screened, secants, sizes

SIZES = (1.0, 2.0, 4.0, 8.0)
"""Sizes, in usual ones, at which an effect is run."""

SCAN = 4
"""Most steps of exact runs in a macro step of these runs, for a machine that swings needs it."""

BEGUN, KEPT = 6, 3
"""Starts that are fitted, and those that are carried to the end."""

NEARLY = 0.25
"""How far behind the best fit a start may be, as a share of what that has gained over the null."""


@dataclass
class Start:
    """Where a fit of one effect begins: its size and the base parameters that go with it."""

    candidate: Candidate
    unknowns: tuple[Unknown, ...]
    u: np.ndarray
    merit: float
    """What `Hypothesis.merit` would be there if the base parameters acted linearly."""

    @property
    def label(self) -> str:
        """That of its candidate."""
        return self.candidate.label

    @property
    def point(self) -> dict[str, float]:
        """In the problem's terms."""
        return point_of(self.unknowns, self.u)


def scan(problem: Problem, N: np.ndarray) -> list[Start]:
    """The best start of each effect, the most promising first; a long macro step is shortened to `SCAN`."""
    problem.factor = min(problem.factor, SCAN)
    delivered = as_delivered(problem, N)
    plain = [c for c in problem.candidates if len(c.unknowns) == 1 and c.unknowns[0].kind == "effect"]
    wanted = dict.fromkeys((c, s) for c in plain for size in SIZES for s in sizes(c, size))
    made = [
        _start(problem, delivered, s.candidate, s.size, delivered.model + s.slope * s.size, N)
        for s in secants(problem, delivered, list(wanted))
    ]
    return best_of_each(made, lambda s: s.merit)


def _start(
    problem: Problem, delivered: Fit, candidate: Candidate, size: float, model: np.ndarray, N: np.ndarray
) -> Start:
    line = Linear(problem, delivered.u, model, delivered.jacobian, N, screened(problem))
    phi = max(1.0, delivered.phi * (rms(line.r) / max(delivered.rms, 1e-150)) ** 2)
    d, q = line.step(delivered.unknowns, phi, np.ones(len(delivered.u)))
    unknowns, u = (*delivered.unknowns, *candidate.unknowns), np.append(d, size)
    cost = penalty(unknowns, u, q[: delivered.channels])
    return Start(candidate, unknowns, u, merit(rms(line.left(d, q)), cost))


def fits(problem: Problem, starts: Sequence[Start], N: np.ndarray) -> list[Hypothesis]:
    """Fits from the starts, the best first; the better ones are carried to the end."""
    begun = drive(problem, [fit(problem, s.unknowns, s.u, N, 1) for s in starts])
    made = [Hypothesis((s.candidate,), f) for s, f in zip(starts, begun, strict=True) if f is not None]
    for kept, steps in ((KEPT, TASTE), (KEPT - 1, MOST)):
        made.sort(key=lambda h: h.merit)
        carry_on(problem, made[:kept], N, steps)
    return sorted(made, key=lambda h: h.merit)
