"""The bank of responses: what the model does when an effect of some size is switched on at a point, or taken away.

Runs take the longest step: its error is nearly the same at neighbouring points and cancels in their differences.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..problem.noise import rms
from ..problem.parameters import EffectCandidate, EstimatedParameter, Point
from ..problem.problem import Problem
from ..settings import SearchSettings
from .sizes import first_sizes, grid, variants

Variant = tuple[EffectCandidate, Mapping[str, float]]
"""An effect with values of its parameters, by name."""


@dataclass(frozen=True, eq=False)
class Response:
    """An effect at a size: the parameters that say so, and how it changes the model at the bank's rows."""

    candidate: EffectCandidate
    values: Mapping[str, float]
    """Empty: the effect, which the bank's point has, is taken away."""
    change: np.ndarray
    """Normalised (rows,)."""

    @property
    def removes(self) -> bool:
        """Whether the effect is taken away."""
        return not self.values

    @property
    def size(self) -> float:
        """Normalised value of the main parameter."""
        return 0.0 if self.removes else self.values[self.candidate.main.name]

    @property
    def shape(self) -> tuple[float, ...]:
        """Values of the other ones."""
        return tuple(self.values[x.name] for x in self.candidate.parameters if x.shape and not self.removes)


@dataclass(frozen=True, eq=False)
class Bank:
    """Responses around a point, and derivatives by the parameters that it moves: base parameters and its effects'."""

    point: Point
    model: np.ndarray
    """The model's long vector at the point (n,)."""
    correction: np.ndarray
    """Exact runs less those at the long step, at the point (n,)."""
    candidates: tuple[EffectCandidate, ...]
    """Effects that the point has."""
    parameters: tuple[EstimatedParameter, ...]
    jacobian: np.ndarray
    """(n, k)."""
    rows: slice
    """Readings that responses are kept at."""
    responses: tuple[Response, ...]


def rows_of(problem: Problem) -> slice:
    """Every few readings, so that a bank keeps so many at most."""
    return slice(None, None, -(-len(problem.observations) // problem.settings.search.rows))


def in_batches(problem: Problem, points: Sequence[Point]) -> Iterable[np.ndarray | None]:
    """The models at the points, some of them simulated at a time: a bank of many runs would not fit into memory."""
    step = max(1, problem.settings.search.batch // len(problem.runs))
    for k in range(0, len(points), step):
        yield from problem.evaluate(points[k : k + step])


def build_bank(
    problem: Problem, point: Point, coarse: np.ndarray, correction: np.ndarray,
    candidates: Sequence[EffectCandidate] = (),
) -> Bank:  # fmt: skip
    """The bank at a point that has some effects, each other one at its first sizes.

    coarse: the long vector there (n,) at the long step; correction: exact runs less that.
    """
    bank = without_responses(problem, point, coarse, correction, candidates)
    wanted: list[Variant] = [(c, {}) for c in candidates]
    have = {c.label for c in candidates}
    settings = problem.settings.search
    for c in problem.candidates:
        if c.label not in have:
            sizes = (grid if c.main.kind == "sensor" else first_sizes)(c.main, settings)
            wanted += [(c, values) for values in variants(c, sizes, settings)]
    bank = extend(problem, bank, wanted)
    return extend(problem, bank, _unseen(problem, bank, wanted))


def families(responses: Sequence[Response]) -> list[list[int]]:
    """Places of the responses of each effect with the same shape to the same side, small sizes first."""
    made: dict[tuple[object, ...], list[int]] = {}
    for k, x in enumerate(responses):
        if not x.removes:
            made.setdefault((x.candidate.label, x.shape, x.size > 0.0), []).append(k)
    return [sorted(places, key=lambda k: abs(responses[k].size)) for places in made.values()]


def _unseen(problem: Problem, bank: Bank, run: Sequence[Variant]) -> list[Variant]:
    """The other sizes of effects that have shown next to nothing at those that were run, or the same at each: what
    makes a machine swing does so from a threshold on, a valve that holds a load is only there until it does, and no set
    would ask for it."""
    settings = problem.settings.search
    seen = {c.label for c in bank.candidates}
    for places in families(bank.responses):
        own = [bank.responses[k] for k in places]
        seen |= {own[0].candidate.label} if _acts(own, settings) else set()
    made: list[Variant] = []
    for c in dict.fromkeys(c for c, values in run if c.label not in seen):
        tried = {values[c.main.name] for other, values in run if other is c and values}
        made += [(c, values) for values in variants(c, [s for s in grid(c.main, settings) if s not in tried], settings)]
    return made


def _acts(responses: Sequence[Response], settings: SearchSettings) -> bool:
    """Whether an effect changes something at these sizes, the small ones first, and more or less of it from one to the
    next."""
    least, most = responses[0], responses[-1]
    whole = rms(most.change)
    return whole >= settings.unseen and (least is most or rms(most.change - least.change) >= settings.same * whole)


def without_responses(
    problem: Problem, point: Point, coarse: np.ndarray, correction: np.ndarray,
    candidates: Sequence[EffectCandidate] = (),
) -> Bank:  # fmt: skip
    """Only the derivatives by base parameters and the point's own effects."""
    parameters = (*problem.base, *(x for c in candidates for x in c.parameters))
    share = problem.settings.search.derivative_step
    steps = [wide_step(x, point.get(x.name, 0.0), share) for x in parameters]
    moved = zip(parameters, steps, strict=True)
    points = [{**point, x.name: point.get(x.name, 0.0) + h} for x, h in moved]
    jacobian = np.zeros((len(coarse), len(parameters)))
    for k, found in enumerate(in_batches(problem, points)):
        if found is not None:
            jacobian[:, k] = (found - coarse) / steps[k]
    model, rows = coarse + correction, rows_of(problem)
    return Bank(dict(point), model, correction, tuple(candidates), parameters, jacobian, rows, ())


def extend(problem: Problem, bank: Bank, wanted: Sequence[Variant]) -> Bank:
    """The bank with further responses; one that does not run, or changes nothing, is left out."""
    coarse, noise = bank.model - bank.correction, problem.observations.noise_std
    points = [with_effect(bank.point, c, values) for c, values in wanted]
    made = []
    for (c, values), found in zip(wanted, in_batches(problem, points), strict=True):
        if found is not None:
            change = ((found - coarse) / noise)[bank.rows]
            if np.any(change):
                made.append(Response(c, values, change))
    return replace(bank, responses=(*bank.responses, *made))


def with_effect(point: Point, candidate: EffectCandidate, values: Mapping[str, float]) -> dict[str, float]:
    """The point with an effect as its values say, or without it."""
    gone = {x.name for x in candidate.parameters}
    return {**{name: u for name, u in point.items() if name not in gone}, **values}


def wide_step(x: EstimatedParameter, u: float, share: float) -> float:
    """A step for a derivative at u that stays in the range: a share of a base parameter's scale or an effect's size."""
    h = share * (1.0 if x.kind == "base" else max(abs(u), 1.0 if x.shape else 0.1))
    return h if u + h <= x.high else -h

