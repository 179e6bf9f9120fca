"""Which effects could be the cause: screening by secants, fits of the plausible ones, then of pairs.

Screening takes the model's change when one effect is switched on at a few sizes, and asks how much of the null fit's
residual it explains once base parameters and nuisances may follow. Only what screening leaves is fitted.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from itertools import product
from typing import Protocol, TypeVar

import numpy as np

from ..estimation.cross_validation import held_out
from ..estimation.gauss_newton import Ask, Fit, Linear, drive, fit, penalty, went, wide
from ..problem.problem import Candidate, Problem
from .calibration import chance

SINGLES = 10
"""Candidates that are fitted after screening."""

READINGS = 150.0
"""Readings that count in the merit of a fit."""

KEPT, CLOSE = 3, 8.0
"""Of these, so many are fitted to the end, and as many again if their merit is not further from the best."""

PAIRS_FROM = 3
"""Single candidates that are tried with a second one."""

PAIRS = 4
"""Second candidates that are fitted with each of them."""

SCREENED_ANEW = 16
"""Candidates that are screened anew beside a single effect, the best by their former secants."""

STARTS, STARTS_KEPT = 6, 2
"""Candidates that are also fitted from the model as delivered, and those of them that are finished in any case."""

HARDLY, AROUND, MORE = 0.1, 0.3, 4
"""Size, in usual ones, up to which an effect is hardly there; how far around, in u, the fit without it then starts too,
and how often."""

LOOKED = (1.0, 0.1)
"""Sizes of an effect at which screening looks first: the usual one and a smaller one, for a machine that swings at the
usual size is far from the data whatever the right size is."""

STRAINED = 0.8
"""Mean square of the base parameters, in prior standard deviations, beyond which a null's fit is not to be trusted."""

MUCH = 3.0
"""RMS of a null's fit beyond which large effects are looked for as such."""

SETTLED = 0.02
"""Energy beyond chance that a residual's readings share (`Observations.shared`) with nothing left to explain."""

RIVAL, BEHIND = 1.3, 4.0
"""RMS of a fit from which, after a few iterations, another may still get where one has settled; and how many times the
best one's another may have to be carried on where nothing is settled."""

QUICK, TASTE, MOST = 3, 2, 8
"""Steps of a fit: of a first look, after which hopeless ones are left, and at most."""

SCREENED = 12_000
"""Readings that screening looks at."""

WORTH = 10.0
"""Saving that a second effect has to promise."""


@dataclass
class Secant:
    """The model's change per unit of u when a candidate goes from a fit to u = size (shapes at `shape`)."""

    candidate: Candidate
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
        return {**self.at.point, **_point(self.candidate, self.size, self.shape)}


def merit(left: float, penalty: float) -> float:
    """What fits are ranked by until they are judged, the less the better: the RMS that is left and what it costs."""
    return READINGS * 2.0 * float(np.log(max(left, 1e-9))) + penalty


@dataclass
class Hypothesis:
    """A set of candidates with its fit; no candidates: the null."""

    candidates: tuple[Candidate, ...]
    fit: Fit
    quick: bool = False
    """The fit is a first look, with another fit's derivatives."""
    finished: bool = False
    """The fit has been carried to its end, and its derivatives serve for larger moves."""

    @property
    def label(self) -> str:
        """For people."""
        return " + ".join(c.label for c in self.candidates) or "refit of the base parameters"

    @property
    def merit(self) -> float:
        """That of its fit."""
        return merit(self.fit.rms, self.fit.penalty())

    @property
    def ids(self) -> tuple[str, ...]:
        """Sorted effect ids."""
        return tuple(sorted(c.id for c in self.candidates))


def screened(problem: Problem) -> slice:
    """Every few readings, so that screening looks at `SCREENED` at most."""
    return slice(None, None, max(1, len(problem.obs) // SCREENED))


class Labelled(Protocol):
    """A hypothesis, or a start of one."""

    @property
    def label(self) -> str:
        """For people."""


L = TypeVar("L", bound=Labelled)


def best_of_each(found: Iterable[L], cost: Callable[[L], float]) -> list[L]:
    """The one of each label that costs least, the cheapest first."""
    unique: dict[str, L] = {}
    for item in sorted(found, key=cost):
        unique.setdefault(item.label, item)
    return list(unique.values())


def as_delivered(problem: Problem, N: np.ndarray) -> Fit:
    """The model as delivered, with derivatives that serve for larger moves."""
    unmoved = fit(problem, problem.base, np.zeros(len(problem.base)), N, 0)
    return went(problem, wide(problem, went(problem, unmoved), N))


def settled(problem: Problem, at: Fit) -> bool:
    """Whether a fit leaves nothing to explain."""
    return problem.obs.shared(at.residual) < SETTLED + chance(len(problem.obs))


def _point(candidate: Candidate, size: float, shape: Sequence[float]) -> dict[str, float]:
    free = [u for u in candidate.unknowns if not u.shape]
    bent = [u for u in candidate.unknowns if u.shape]
    return {**{u.name: size for u in free}, **{u.name: s for u, s in zip(bent, shape, strict=True)}}


def sizes(candidate: Candidate, size: float) -> list[float]:
    """The size and its negative, as far as the bounds allow."""
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
    made = [Secant(c, at, size, shape, np.zeros(0)) for c, size, shape in items]
    for s, y in zip(made, problem.evaluate([s.point for s in made]), strict=True):
        if y is not None:
            s.slope = (y + at.correction - at.model) / s.size
    return [s for s in made if len(s.slope)]


def weigh(problem: Problem, reference: Fit, N: np.ndarray, found: Sequence[Secant]) -> None:
    """Fill in what each secant could save of a reference fit's cost, in the linear approximation around its own fit.

    The readings' weight follows the energy of what is left.
    """
    rows = screened(problem)
    floor = problem.obs.floor[rows]
    reference_left = max(float(reference.residual[rows] @ reference.residual[rows]), 1e-300)
    lines: dict[int, Linear] = {}
    for s in found:
        at = s.at
        if id(at) not in lines:
            lines[id(at)] = Linear(problem, at.u, at.model, at.jacobian, N, rows)
        k = len(at.unknowns)
        radius = np.array([1.5 if x.kind == "base" else 3.0 for x in at.unknowns] + [np.inf])
        main = s.candidate.unknowns[0]
        low, high = max(main.low, -2.0 * abs(s.size)), min(main.high, 2.0 * abs(s.size))
        line = lines[id(at)].with_column(k, s.slope[rows] / floor)
        x = (*at.unknowns, replace(main, low=low, high=high))
        before = max(float(at.residual[rows] @ at.residual[rows]), 1e-300)
        weight = at.phi
        for _ in range(3):
            d, q = line.step(x, weight, radius)
            left = line.left(d, q)
            energy = float(left @ left)
            fresh = max(1.0, at.phi * min(1.0, energy / before))
            if fresh > 0.7 * weight:
                break
            weight = fresh
        s.amount, s.base = float(d[k]), at.u + d[:k]
        s.gain, s.own = 1.0 - energy / reference_left, 1.0 - energy / before
        s.saving = READINGS * float(np.log(reference_left / max(energy, 1e-300)))
        s.saving += reference.penalty() - penalty(at.unknowns, s.base, q[: at.channels])


def screen(problem: Problem, at: Fit, N: np.ndarray, candidates: Sequence[Candidate] | None = None) -> list[Secant]:
    """The best secant of each candidate (of all, or of those) from a fit, those that save most first."""
    candidates = problem.candidates if candidates is None else candidates
    machine = [c for c in candidates if c.unknowns[0].kind == "effect"]
    sensors = [c for c in candidates if c.unknowns[0].kind == "sensor"]
    wanted = [(c, s) for c in machine for size in LOOKED for s in sizes(c, size)[:1]]
    wanted += [(c, s) for c in sensors for s in sizes(c, 1.0)]
    found = secants(problem, at, wanted)
    weigh(problem, at, N, found)
    best = best_of_each(found, lambda s: -s.saving)
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
    return best_of_each([*found, *more], lambda s: -s.saving)


def other_starts(problem: Problem, at: Fit, N: np.ndarray) -> list[Secant]:
    """Secants from the model as delivered, those that explain most of its gap first.

    Where the null's fit has strained the base parameters it may have gone far from the truth, and an effect is found
    more surely from where the base parameters are what is stated. (`large` is for fits that leave much.)
    """
    if at.strain() < STRAINED * len(at.u) or at.rms > MUCH:
        return []
    delivered = as_delivered(problem, N)
    plain = [c for c in problem.candidates if not any(u.shape or u.kind == "sensor" for u in c.unknowns)]
    found = secants(problem, delivered, [(c, s) for c in plain for s in sizes(c, 1.0)])
    weigh(problem, at, N, found)
    return best_of_each(found, lambda s: -s.own)[:STARTS]


def _ask(problem: Problem, s: Secant, N: np.ndarray, iterations: int) -> Ask:
    """A quick fit that starts from that of a secant, with its candidate added."""
    at, new = s.at, s.candidate.unknowns
    amount = s.amount if abs(s.amount) > 1e-3 else float(np.clip(0.1 * np.sign(s.size), new[0].low, new[0].high))
    at_start = _point(s.candidate, amount, s.shape)
    u = np.concatenate([s.base if len(s.base) else at.u, [at_start[x.name] for x in new]])
    return fit(problem, (*at.unknowns, *new), u, N, iterations, like=at)


def finish(problem: Problem, h: Hypothesis, N: np.ndarray) -> None:
    """Fit to the end, in place, with the derivatives that judging rests on.

    Those for larger moves serve, unless the fit's own foretell better what is left out: where a machine sticks and
    slips, larger moves are another motion.
    """
    carry_on(problem, [h], N, MOST)
    if not h.finished:
        if (found := drive(problem, [wide(problem, h.fit, N)])[0]) is not None:
            own = replace(found, jacobian=h.fit.jacobian)
            h.fit = min(found, own, key=lambda f: held_out(problem, f, N)[1])
        h.finished = True


def without(problem: Problem, h: Hypothesis, gone: Candidate, N: np.ndarray, iterations: int) -> Hypothesis | None:
    """The hypothesis without one of its effects, fitted from where it stands; None where the model does not run.

    Where the effect is hardly there, the fit also starts from points around: what so little does the base parameters
    may do as well, but a machine that drifts through its valve's closed centre shows the way to it from few points.
    """
    kept = np.array([x not in gone.unknowns for x in h.fit.unknowns])
    unknowns = tuple(x for x, keep in zip(h.fit.unknowns, kept, strict=True) if keep)
    starts = [h.fit.u[kept]]
    if all(abs(u) < HARDLY for x, u in zip(h.fit.unknowns, h.fit.u, strict=True) if x in gone.unknowns and not x.shape):
        moved = np.array([AROUND * (x.kind == "base") for x in unknowns])
        low, high = np.array([x.low for x in unknowns]), np.array([x.high for x in unknowns])
        random = np.random.default_rng(0)
        starts += [np.clip(starts[0] + moved * random.normal(size=len(moved)), low, high) for _ in range(MORE)]
    ends = drive(problem, [fit(problem, unknowns, u, N, iterations) for u in starts])
    left = tuple(c for c in h.candidates if c is not gone)
    return min((Hypothesis(left, end) for end in ends if end is not None), key=lambda h: h.merit, default=None)


def extend(
    problem: Problem, at: Hypothesis, found: Sequence[Secant], N: np.ndarray, most: int, kept: int,
    others: Sequence[Secant] = (),
) -> list[Hypothesis]:
    """Fits of a hypothesis with one candidate more: `most` are begun, about `kept` carried to the end. Best first.

    Near the data, what was found to promise most goes on in any case: a first look may stop on its way.
    """
    have = {c.label for c in at.candidates}
    chosen = [*[s for s in found if s.candidate.label not in have][:most], *others]
    begun = drive(problem, [_ask(problem, s, N, QUICK) for s in chosen])
    made = [
        Hypothesis((*at.candidates, s.candidate), f, quick=True)
        for s, f in zip(chosen, begun, strict=True) if f is not None
    ]  # fmt: skip
    promised = made[: (kept + 1) // 2] if at.fit.rms < MUCH else []
    elsewhere = sorted(made[len(chosen) - len(others) :] if others else [], key=lambda h: h.merit)[:STARTS_KEPT]
    made.sort(key=lambda h: h.merit)
    going = made[:kept] + [h for h in made[kept : 2 * kept] if h.merit < made[0].merit + CLOSE]
    going += [h for h in (*elsewhere, *promised) if not any(h is g for g in going)]
    going = [h for h in going if h.fit.rms < BEHIND * max(made[0].fit.rms, 1.0)]
    carry_on(problem, going, N, TASTE)
    best = min((h.fit.rms for h in going), default=0.0)
    far = RIVAL if any(settled(problem, h.fit) for h in going) else BEHIND * best
    going = sorted((h for h in going if h.fit.rms < far), key=lambda h: h.merit)
    carry_on(problem, going[:kept], N, MOST)
    return best_of_each(made, lambda h: h.merit)


def carry_on(problem: Problem, hypotheses: Sequence[Hypothesis], N: np.ndarray, iterations: int) -> None:
    """Go on with fits that have not arrived, in place, where that does not make them worse."""
    going = [h for h in hypotheses if h.quick or not h.fit.converged]
    asks = [fit(problem, h.fit.unknowns, h.fit.u, N, iterations, at=None if h.quick else h.fit) for h in going]
    for h, f in zip(going, drive(problem, asks), strict=True):
        if f is not None and (h.quick or replace(h, fit=f).merit < h.merit + 1.0):
            h.fit, h.quick, h.finished = f, False, False
