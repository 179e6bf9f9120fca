"""Which effects could be the cause: screening by secants, fits of the plausible ones, then of pairs.

Screening takes the model's change when one effect is switched on at a few sizes, and asks how much of the null fit's
residual it explains once base parameters and nuisances may follow. Only what screening leaves is fitted.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from itertools import product

import numpy as np

from .fit import Fit, Linear, drive, fit
from .problem import Candidate, Problem

SINGLES = 10
"""Candidates that are fitted after screening."""

READINGS = 150.0
"""Readings that count in the merit of a fit."""

KEPT, CLOSE = 3, 30.0
"""Of these, so many are fitted to the end, and as many again if their merit is not further from the best."""

PAIRS_FROM = 3
"""Single candidates that are tried with a second one."""

PAIRS = 4
"""Second candidates that are fitted with each of them."""

SCREENED = 12_000
"""Readings that screening looks at."""

WORTH = 0.06
"""Share of what a single effect leaves that a second one has to promise."""


@dataclass
class Secant:
    """The model's change when a candidate goes to u = size (shapes at `shape`): long vector per unit of u."""

    candidate: Candidate
    size: float
    shape: tuple[float, ...]
    slope: np.ndarray
    gain: float = 0.0
    """Share of a fit's cost that it can save: residual, and base parameters that may come back to what is stated."""
    amount: float = 0.0
    """The u it would need."""
    base: np.ndarray = field(default_factory=lambda: np.zeros(0))
    """Where the base parameters would go."""


@dataclass
class Hypothesis:
    """A set of candidates with its fit; no candidates: the null."""

    candidates: tuple[Candidate, ...]
    fit: Fit

    @property
    def label(self) -> str:
        """For people."""
        return " + ".join(c.label for c in self.candidates) or "refit of the base parameters"

    @property
    def merit(self) -> float:
        """What fits are ranked by until they are judged, the less the better: residual and what its parameters cost."""
        return READINGS * 2.0 * float(np.log(max(self.fit.rms, 1e-9))) + self.fit.penalty()

    @property
    def ids(self) -> tuple[str, ...]:
        """Sorted effect ids."""
        return tuple(sorted(c.id for c in self.candidates))


Say = Callable[[str], None]


def null(problem: Problem, start: np.ndarray, N: np.ndarray) -> Hypothesis:
    """The fit of the base parameters alone; `start` is the long vector of the model as delivered."""
    k = len(problem.base)
    J, known = np.zeros((len(start), k)), np.zeros(k, bool)
    # first gently, as if the misfit were all structure; then as if enough readings were independent
    gentle = fit(problem, problem.base, np.zeros(k), N, J, known, 8, model=start, refreshes=2, least=0.0)
    found = drive(problem, [gentle])[0]
    assert found is not None
    found = drive(problem, [carry_on(problem, found, N, 16, fresh=True, refreshes=3)])[0]
    assert found is not None
    return Hypothesis((), found)


def _point(candidate: Candidate, size: float, shape: Sequence[float]) -> dict[str, float]:
    free = [u for u in candidate.unknowns if not u.shape]
    bent = [u for u in candidate.unknowns if u.shape]
    return {**{u.name: size for u in free}, **{u.name: s for u, s in zip(bent, shape, strict=True)}}


def _sizes(candidate: Candidate, size: float) -> list[float]:
    main = candidate.unknowns[0]
    made = []
    for sign in (1.0, -1.0):
        reach = main.high if sign > 0 else -main.low
        if reach > 1e-9:
            made.append(sign * min(size, reach))
    return made


def secants(problem: Problem, at: Fit, wanted: Sequence[tuple[Candidate, float]]) -> list[Secant]:
    """The secants from the point of a fit."""
    items = []
    for candidate, size in wanted:
        shapes = [u.starts or (0.0,) for u in candidate.unknowns if u.shape]
        items += [(candidate, size, shape) for shape in product(*shapes)]
    points = [{**at.point, **_point(c, size, shape)} for c, size, shape in items]
    made = []
    for (c, size, shape), y in zip(items, problem.evaluate(points), strict=True):
        if y is not None:
            made.append(Secant(c, size, shape, (y - at.model) / size))
    return made


def weigh(problem: Problem, at: Fit, N: np.ndarray, found: Sequence[Secant]) -> None:
    """Fill in what each secant could explain of a fit's residual, in the linear approximation.

    Every few readings count, so that at most `SCREENED` do; phi follows the mean square of what is left.
    """
    rows = slice(None, None, max(1, len(problem.obs) // SCREENED))
    lin = Linear(problem, at.u, at.model, at.jacobian, N, rows)
    floor = problem.obs.floor[rows]
    k = len(at.unknowns)
    radius = np.array([1.5 if x.kind == "base" else 3.0 for x in at.unknowns] + [np.inf])
    before = float(at.residual[rows] @ at.residual[rows])
    thinned = len(problem.obs) / len(floor)
    sd = np.array([x.sd for x in at.unknowns])
    for s in found:
        main = s.candidate.unknowns[0]
        low, high = max(main.low, -2.0 * abs(s.size)), min(main.high, 2.0 * abs(s.size))
        wider = lin.with_column(k, s.slope[rows] / floor)
        x = (*at.unknowns, replace(main, low=low, high=high))
        phi = at.phi
        for _ in range(3):
            d, q = wider.step(x, phi, radius)
            left = wider.left(d, q)
            share = float(left @ left) / before
            fresh = max(1.0, at.phi * min(1.0, share))
            if fresh > 0.7 * phi:
                break
            phi = fresh
        s.amount, s.base = float(d[k]), at.u + d[:k]
        was = thinned * before / phi + at.penalty()
        becomes = thinned * before * share / phi + float(np.sum((s.base / sd) ** 2))
        s.gain = 1.0 - becomes / was


def screen(problem: Problem, at: Fit, N: np.ndarray, say: Say = lambda text: None) -> list[Secant]:
    """The best secant of each candidate, those that explain most first."""
    machine = [c for c in problem.candidates if c.unknowns[0].kind == "effect"]
    sensors = [c for c in problem.candidates if c.unknowns[0].kind == "sensor"]
    wanted = [(c, s) for c in machine for s in _sizes(c, 1.0)[:1]]
    wanted += [(c, s) for c in sensors for s in _sizes(c, 1.0)]
    found = secants(problem, at, wanted)
    weigh(problem, at, N, found)
    best = _best_of_each(found)
    # a large effect is not its derivative: look where the line says it should be, and beyond
    again = []
    for s in best[: SINGLES + 4]:
        if s.candidate.unknowns[0].kind == "effect":
            main = s.candidate.unknowns[0]
            signs = [1.0] if s.amount > 0 else [-1.0]
            if abs(s.amount) < 0.1 and main.low < -1e-9 and main.high > 1e-9:
                signs = [1.0, -1.0]
            for sign in signs:
                size = float(np.clip(sign * 3.0, main.low, main.high))
                if abs(size) > 1e-9 and not any(abs(size - o.size) < 0.2 for o in found if o.candidate is s.candidate):
                    again.append((s.candidate, size))
                if sign < 0 and main.low < -1.5 and abs(s.amount) < 1.5:
                    again.append((s.candidate, -1.0))
    more = secants(problem, at, again)
    weigh(problem, at, N, more)
    return _best_of_each([*found, *more])


def _best_of_each(found: Sequence[Secant]) -> list[Secant]:
    best: dict[str, Secant] = {}
    for s in found:
        label = s.candidate.label
        if label not in best or s.gain > best[label].gain:
            best[label] = s
    return sorted(best.values(), key=lambda s: -s.gain)


def _ask(problem: Problem, at: Fit, s: Secant, N: np.ndarray, iterations: int):
    """A fit that starts from another one with the candidate of a secant added."""
    new = s.candidate.unknowns
    amount = s.amount if abs(s.amount) > 1e-3 else float(np.clip(0.1 * np.sign(s.size), new[0].low, new[0].high))
    at_start = _point(s.candidate, amount, s.shape)
    unknowns = (*at.unknowns, *new)
    u = np.concatenate([s.base if len(s.base) else at.u, [at_start[x.name] for x in new]])
    n, k = len(at.model), len(at.unknowns)
    J = np.concatenate([at.jacobian, np.zeros((n, len(new)))], axis=1)
    known = np.arange(len(unknowns)) < k
    return fit(problem, unknowns, u, N, J, known, iterations, phi_most=at.phi)


def carry_on(problem: Problem, at: Fit, N: np.ndarray, iterations: int, fresh: bool = False, refreshes: int = 0):
    """Goes on with a fit; fresh: with all derivatives found anew."""
    known = np.full(len(at.unknowns), not fresh)
    return fit(problem, at.unknowns, at.u, N, at.jacobian, known, iterations, model=at.model, refreshes=refreshes)


def extend(
    problem: Problem, at: Hypothesis, found: Sequence[Secant], N: np.ndarray, most: int, kept: int
) -> list[Hypothesis]:
    """Fits of a hypothesis with one candidate more: `most` are begun, about `kept` finished. Best first."""
    have = {c.label for c in at.candidates}
    chosen = [s for s in found if s.candidate.label not in have][:most]
    begun = drive(problem, [_ask(problem, at.fit, s, N, 3) for s in chosen])
    made = [Hypothesis((*at.candidates, s.candidate), f) for s, f in zip(chosen, begun, strict=True) if f is not None]
    made.sort(key=lambda h: h.merit)
    going = made[:kept] + [h for h in made[kept : 2 * kept] if h.merit < made[0].merit + CLOSE]
    asks = [carry_on(problem, h.fit, N, 14, fresh=True, refreshes=2) for h in going]
    for h, f in zip(going, drive(problem, asks), strict=True):
        if f is not None and replace(h, fit=f).merit < h.merit + 1.0:
            h.fit = f
    return sorted(made, key=lambda h: h.merit)
