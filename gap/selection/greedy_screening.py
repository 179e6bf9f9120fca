"""Screening of effects: the model's change when one is switched on at a few sizes, against what a fit leaves.

How much of that is explained once base parameters and nuisances may follow. Only what screening leaves is fitted.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import product

import numpy as np

from ..estimation.fit import Fit
from ..estimation.gauss_newton import fit, with_wide_differences
from ..estimation.linear import Linear
from ..estimation.scheduler import run_fit
from ..problem.parameters import EffectCandidate, penalty
from ..problem.problem import Problem
from .hypothesis import READINGS, best_of_each

SINGLES = 10
"""Candidates that are fitted after screening."""

STARTS, STARTS_KEPT = 6, 2
"""Candidates that are also fitted from the model as delivered, and those of them that are finished in any case."""

LOOKED = (1.0, 0.1)
"""Sizes of an effect at which screening looks first: the usual one and a smaller one, for a machine that swings at the
usual size is far from the data whatever the right size is."""

STRAINED = 0.8
"""Mean square of the base parameters, in prior standard deviations, beyond which a null's fit is not to be trusted."""

MUCH = 3.0
"""RMS of a null's fit beyond which large effects are looked for as such."""

SCREENED = 12_000
"""Readings that screening looks at."""


@dataclass(frozen=True, eq=False)
class ResponseCurve:
    """The model's change per unit of u when a candidate goes from a fit to u = size (shapes at `shape`)."""

    candidate: EffectCandidate
    at: Fit
    size: float
    shape: tuple[float, ...]
    slope: np.ndarray
    gain: float = 0.0
    """Share of a reference fit's sum of squares that it could explain."""
    saving: float = 0.0
    """What it could take off the reference fit's merit: residual, and base parameters back to what is stated."""
    own: float = 0.0
    """Share that it could explain of its own fit's sum of squares."""
    amount: float = 0.0
    """The u it would need."""
    base: np.ndarray = field(default_factory=lambda: np.zeros(0))
    """Where the base parameters would go."""

    @property
    def label(self) -> str:
        """That of its candidate."""
        return self.candidate.label

    @property
    def point(self) -> dict[str, float]:
        """Where the candidate was run."""
        return {**self.at.point, **point_at(self.candidate, self.size, self.shape)}


def screened(problem: Problem) -> slice:
    """Every few readings, so that screening looks at `SCREENED` at most."""
    return slice(None, None, max(1, len(problem.observations) // SCREENED))


def nominal_fit(problem: Problem, nuisance_jacobian: np.ndarray) -> Fit:
    """The model as delivered, with derivatives that serve for larger moves."""
    unmoved = fit(problem, problem.base, np.zeros(len(problem.base)), nuisance_jacobian, 0)
    return run_fit(problem, with_wide_differences(problem, run_fit(problem, unmoved), nuisance_jacobian))


def point_at(candidate: EffectCandidate, size: float, shape: Sequence[float]) -> dict[str, float]:
    """The candidate's parameters at a normalised size, its shapes as given."""
    free = [u for u in candidate.parameters if not u.shape]
    bent = [u for u in candidate.parameters if u.shape]
    return {**{u.name: size for u in free}, **{u.name: s for u, s in zip(bent, shape, strict=True)}}


def sizes(candidate: EffectCandidate, size: float) -> list[float]:
    """The size and its negative, as far as the bounds allow."""
    main = candidate.parameters[0]
    made = []
    for sign in (1.0, -1.0):
        reach = main.high if sign > 0 else -main.low
        if reach > 1e-9:
            made.append(sign * min(size, reach))
    return made


def response_curves(problem: Problem, at: Fit, wanted: Sequence[tuple[EffectCandidate, float]]) -> list[ResponseCurve]:
    """The response curves from the point of a fit."""
    items = []
    for candidate, size in wanted:
        shapes = [u.starts or (0.0,) for u in candidate.parameters if u.shape]
        items += [(candidate, size, shape) for shape in product(*shapes)]
    made = [ResponseCurve(c, at, size, shape, np.zeros(0)) for c, size, shape in items]
    answers = zip(made, problem.evaluate([s.point for s in made]), strict=True)
    return [replace(s, slope=(y + at.correction - at.model) / s.size) for s, y in answers if y is not None]


def estimate_savings(
    problem: Problem, reference: Fit, nuisance_jacobian: np.ndarray, found: Sequence[ResponseCurve]
) -> list[ResponseCurve]:
    """The curves with what each could save of a reference fit's cost, in the linear approximation around its own fit.

    The readings' weight follows the energy of what is left.
    """
    lines: list[tuple[Fit, Linear]] = []
    made = []
    for s in found:
        line = next((line for at, line in lines if at is s.at), None)
        if line is None:
            at, rows = s.at, screened(problem)
            line = Linear.around(problem, at.normalised, at.model, at.jacobian, nuisance_jacobian, rows)
            lines.append((at, line))
        made.append(_with_saving(problem, reference, line, s))
    return made


def _with_saving(problem: Problem, reference: Fit, around: Linear, s: ResponseCurve) -> ResponseCurve:
    at, rows = s.at, screened(problem)
    reference_left = max(float(reference.residual[rows] @ reference.residual[rows]), 1e-300)
    k = len(at.parameters)
    radius = np.array([1.5 if x.kind == "base" else 3.0 for x in at.parameters] + [np.inf])
    main = s.candidate.parameters[0]
    low, high = max(main.low, -2.0 * abs(s.size)), min(main.high, 2.0 * abs(s.size))
    line = around.with_column(k, s.slope[rows] / problem.observations.noise_std[rows])
    x = (*at.parameters, replace(main, low=low, high=high))
    before = max(float(at.residual[rows] @ at.residual[rows]), 1e-300)
    weight = at.dispersion
    for _ in range(3):
        step = line.step(x, weight, radius)
        left = line.predicted_residual(step)
        energy = float(left @ left)
        fresh = max(1.0, at.dispersion * min(1.0, energy / before))
        if fresh > 0.7 * weight:
            break
        weight = fresh
    base = at.normalised + step.d[:k]
    saving = READINGS * float(np.log(reference_left / max(energy, 1e-300)))
    saving += reference.penalty() - penalty(at.parameters, base, step.q[: at.channels])
    return replace(
        s, amount=float(step.d[k]), base=base, gain=1.0 - energy / reference_left, own=1.0 - energy / before,
        saving=saving,
    )  # fmt: skip


def screen_effects(
    problem: Problem, at: Fit, nuisance_jacobian: np.ndarray, candidates: Sequence[EffectCandidate] | None = None
) -> list[ResponseCurve]:
    """The best curve of each candidate (of all, or of those) from a fit, those that save most first."""
    candidates = problem.candidates if candidates is None else candidates
    machine = [c for c in candidates if c.parameters[0].kind == "effect"]
    sensors = [c for c in candidates if c.parameters[0].kind == "sensor"]
    wanted = [(c, s) for c in machine for size in LOOKED for s in sizes(c, size)[:1]]
    wanted += [(c, s) for c in sensors for s in sizes(c, 1.0)]
    found = estimate_savings(problem, at, nuisance_jacobian, response_curves(problem, at, wanted))
    best = best_of_each(found, lambda s: -s.saving)
    again = _where_the_line_points(best, found)
    more = estimate_savings(problem, at, nuisance_jacobian, response_curves(problem, at, again))
    return best_of_each([*found, *more], lambda s: -s.saving)


def _where_the_line_points(
    best: Sequence[ResponseCurve], found: Sequence[ResponseCurve]
) -> list[tuple[EffectCandidate, float]]:
    """A large effect is not its derivative: look where the line says it should be, and beyond."""
    again: list[tuple[EffectCandidate, float]] = []
    for s in best[: SINGLES + 4]:
        if s.candidate.parameters[0].kind == "effect":
            main = s.candidate.parameters[0]
            signs = [1.0] if s.amount > 0 else [-1.0]
            if abs(s.amount) < 0.1 and main.low < -1e-9 and main.high > 1e-9:
                signs = [1.0, -1.0]
            for sign in signs:
                size = float(np.clip(sign * 3.0, main.low, main.high))
                if abs(size) > 1e-9 and not any(abs(size - o.size) < 0.2 for o in found if o.candidate is s.candidate):
                    again.append((s.candidate, size))
                if sign < 0 and main.low < -1.5 and abs(s.amount) < 1.5:
                    again.append((s.candidate, -1.0))
    return again


def other_starts(problem: Problem, at: Fit, nuisance_jacobian: np.ndarray) -> list[ResponseCurve]:
    """Secants from the model as delivered, those that explain most of its gap first.

    Where the null's fit has strained the base parameters it may have gone far from the truth, and an effect is found
    more surely from where the base parameters are what is stated. (`large` is for fits that leave much.)
    """
    if at.strain() < STRAINED * len(at.normalised) or at.rms > MUCH:
        return []
    nominal = nominal_fit(problem, nuisance_jacobian)
    plain = [c for c in problem.candidates if not any(u.shape or u.kind == "sensor" for u in c.parameters)]
    found = response_curves(problem, nominal, [(c, s) for c in plain for s in sizes(c, 1.0)])
    found = estimate_savings(problem, at, nuisance_jacobian, found)
    return best_of_each(found, lambda s: -s.own)[:STARTS]
