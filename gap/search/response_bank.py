"""The bank of responses: what the model does when an effect of some size is switched on at a point, or taken away.

Runs take the longest step: its error is nearly the same at neighbouring points and cancels in their differences.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np

from ..problem.noise import rms
from ..problem.parameters import EffectCandidate, EstimatedParameter, Point
from ..problem.problem import Problem
from ..settings import SearchSettings
from .sizes import grid, resized, second_size, starts_of_shapes, usual_sizes, variants

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
    def is_removal(self) -> bool:
        """Whether the effect is taken away."""
        return not self.values

    @property
    def size(self) -> float:
        """Normalised value of the main parameter."""
        return 0.0 if self.is_removal else self.values[self.candidate.main.name]

    @property
    def shape(self) -> tuple[float, ...]:
        """Values of the other ones."""
        return tuple(self.values[x.name] for x in self.candidate.parameters if x.shape and not self.is_removal)


@dataclass(frozen=True, eq=False)
class ResponseBank:
    """Responses around a point, and derivatives by the parameters that it moves: base parameters and its effects'."""

    point: Point
    model: np.ndarray
    """The model's prediction at the point (n,)."""
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

    @cached_property
    def _by_values(self) -> dict[tuple[str, frozenset[tuple[str, float]]], Response]:
        return {(x.candidate.name, frozenset(x.values.items())): x for x in self.responses}

    def response_to(self, candidate: EffectCandidate, values: Mapping[str, float]) -> Response | None:
        """That of an effect with these values; None where it has not run, or has changed nothing."""
        return self._by_values.get((candidate.name, frozenset(values.items())))

    def rms_of(self, candidate: EffectCandidate, values: Mapping[str, float]) -> float:
        """Normalised RMS of it; 0 where there is none."""
        response = self.response_to(candidate, values)
        return 0.0 if response is None else rms(response.change)


def response_rows(problem: Problem) -> slice:
    """Every few readings, so that a bank keeps so many at most."""
    return slice(None, None, -(-len(problem.observations) // problem.settings.search.rows))


def evaluate_in_batches(problem: Problem, points: Sequence[Point]) -> Iterable[np.ndarray | None]:
    """The models at the points, some of them simulated at a time: a bank of many runs would not fit into memory."""
    step = max(1, problem.settings.search.batch // len(problem.runs))
    for k in range(0, len(points), step):
        yield from problem.evaluate(points[k : k + step])


def bank_of_usual_sizes(
    problem: Problem, point: Point, coarse: np.ndarray, correction: np.ndarray,
    candidates: Sequence[EffectCandidate] = (),
) -> ResponseBank:  # fmt: skip
    """The bank at a point that has some effects, each other one at its usual size only, a sensor's at all.

    coarse: the prediction there (n,) at the long step; correction: exact runs less that.
    """
    bank = begin_bank(problem, point, coarse, correction, candidates)
    return add_responses(problem, bank, _first_variants(problem, bank))


def complete_bank(problem: Problem, bank: ResponseBank) -> ResponseBank:
    """A bank of usual sizes with the second ones, all sizes of what has shown nothing, and those where effects set
    in."""
    run_variants = _first_variants(problem, bank)
    second = _second_variants(problem, bank, run_variants)
    bank, run_variants = add_responses(problem, bank, second), [*run_variants, *second]
    further = _further_variants(problem, bank, run_variants)
    bank, run_variants = add_responses(problem, bank, further), [*run_variants, *further]
    for _ in range(problem.settings.search.threshold_rounds):
        between_sizes = _threshold_variants(problem, bank, run_variants)
        bank, run_variants = add_responses(problem, bank, between_sizes), [*run_variants, *between_sizes]
    return bank


def rms_left(problem: Problem, bank: ResponseBank) -> float:
    """Normalised RMS of what is left at the bank's point, beyond the noise."""
    return float(np.sqrt(max(rms(problem.observations.whiten(bank.model)) ** 2 - 1.0, 0.0)))


def _threshold_variants(problem: Problem, bank: ResponseBank, run_variants: Sequence[Variant]) -> list[Variant]:
    """Between two sizes of which one does less and one more than what is left, by far more than in proportion: the size
    at which the effect is expected to do as much. A valve that holds the load does nothing up to a pressure and stops
    the machine at twice of it; neither, scaled, looks like what it does between."""
    settings, left, between_sizes = problem.settings.search, rms_left(problem, bank), list[Variant]()
    nothing = np.zeros(1)
    run = [bank.response_to(c, values) or Response(c, values, nothing) for c, values in run_variants]
    for places in families(run):
        for small, large in pairwise(run[k] for k in places):
            below, above = rms(small.change), rms(large.change)
            ratio = large.size / small.size
            if not below < left < above or ratio < settings.threshold_width:
                continue
            steepness = np.log(above / max(below, settings.min_response_rms)) / np.log(ratio)
            if steepness > settings.threshold_steepness:
                way = np.clip(np.log(above / left) / steepness / np.log(ratio), *settings.threshold_way)
                size = large.size * float(ratio**-way)
                between_sizes.append((large.candidate, resized(large.candidate, large.values, size)))
    return between_sizes


def _first_variants(problem: Problem, bank: ResponseBank) -> list[Variant]:
    """Each of the point's own effects taken away, each other one at its usual size, a sensor's at all."""
    first: list[Variant] = [(c, {}) for c in bank.candidates]
    settings, labels = problem.settings.search, {c.label for c in bank.candidates}
    for c in problem.candidates:
        if c.label not in labels:
            sizes = (grid if c.main.kind == "sensor" else usual_sizes)(c.main, settings)
            first += [(c, values) for values in variants(c, sizes, settings)]
    return first


def _second_variants(problem: Problem, bank: ResponseBank, run_variants: Sequence[Variant]) -> list[Variant]:
    """Each of these effects at a second size; a sensor's have been run at all, those that show next to nothing will be,
    and those with many starts of their shapes, such as frequencies, are run at the usual size alone."""
    settings = problem.settings.search
    gap = rms_left(problem, bank)
    second: list[Variant] = []
    for c, values in run_variants:
        if c.main.kind == "sensor" or not values or len(starts_of_shapes(c)) > settings.shapes:
            continue
        done = bank.rms_of(c, values)
        if done < settings.min_response_rms:
            continue
        size = second_size(c.main, values[c.main.name], done, gap, settings)
        second += [] if size is None else [(c, resized(c, values, size))]
    return second


def families(responses: Sequence[Response]) -> list[list[int]]:
    """Places of the responses of each effect in the same form and shape to the same side, small sizes first."""
    by_family: dict[tuple[object, ...], list[int]] = {}
    for k, x in enumerate(responses):
        if not x.is_removal:
            by_family.setdefault((x.candidate.name, x.shape, x.size > 0.0), []).append(k)
    return [sorted(places, key=lambda k: abs(responses[k].size)) for places in by_family.values()]


def _further_variants(problem: Problem, bank: ResponseBank, run_variants: Sequence[Variant]) -> list[Variant]:
    """The other sizes of effects that have shown next to nothing at those that were run, or the same at each: what
    makes a machine swing does so from a threshold on, a valve that holds a load is only there until it does, and no set
    would ask for it."""
    settings = problem.settings.search
    responding = {c.label for c in bank.candidates}
    for places in families(bank.responses):
        family = [bank.responses[k] for k in places]
        responding |= {family[0].candidate.label} if _shows(family, settings) else set()
    further: list[Variant] = []
    for c in dict.fromkeys(c for c, values in run_variants if c.label not in responding):
        tried = {values[c.main.name] for other, values in run_variants if other is c and values}
        further += [
            (c, values) for values in variants(c, [s for s in grid(c.main, settings) if s not in tried], settings)
        ]
    return further


def _shows(responses: Sequence[Response], settings: SearchSettings) -> bool:
    """Whether an effect changes something at these sizes, the small ones first, and more or less of it from one to the
    next."""
    least, most = responses[0], responses[-1]
    whole = rms(most.change)
    differs = least is most or rms(most.change - least.change) >= settings.min_response_difference * whole
    return whole >= settings.min_response_rms and differs


def begin_bank(
    problem: Problem, point: Point, coarse: np.ndarray, correction: np.ndarray,
    candidates: Sequence[EffectCandidate] = (),
) -> ResponseBank:  # fmt: skip
    """A bank without responses yet: the derivatives by base parameters and the point's own effects."""
    parameters = (*problem.base, *(x for c in candidates for x in c.parameters))
    steps = [wide_step(x, point.get(x.name, 0.0), problem.settings.search) for x in parameters]
    shifted = zip(parameters, steps, strict=True)
    points = [{**point, x.name: point.get(x.name, 0.0) + h} for x, h in shifted]
    jacobian = np.zeros((len(coarse), len(parameters)))
    for k, model_there in enumerate(evaluate_in_batches(problem, points)):
        if model_there is not None:
            jacobian[:, k] = (model_there - coarse) / steps[k]
    model, rows = coarse + correction, response_rows(problem)
    return ResponseBank(dict(point), model, correction, tuple(candidates), parameters, jacobian, rows, ())


def add_responses(problem: Problem, bank: ResponseBank, variants_to_run: Sequence[Variant]) -> ResponseBank:
    """The bank with further responses; one that does not run, or changes nothing, is left out."""
    coarse, noise = bank.model - bank.correction, problem.observations.noise_std
    points = [point_with(bank.point, c, values) for c, values in variants_to_run]
    responses = []
    for (c, values), model in zip(variants_to_run, evaluate_in_batches(problem, points), strict=True):
        if model is not None:
            change = ((model - coarse) / noise)[bank.rows]
            if np.any(change):
                responses.append(Response(c, values, change))
    return replace(bank, responses=(*bank.responses, *responses))


def point_with(point: Point, candidate: EffectCandidate, values: Mapping[str, float]) -> dict[str, float]:
    """The point with an effect as its values say, or without it."""
    names = {x.name for x in candidate.parameters}
    return {**{name: u for name, u in point.items() if name not in names}, **values}


def wide_step(x: EstimatedParameter, u: float, settings: SearchSettings) -> float:
    """A step for a derivative at u that stays in the range: a share of a base parameter's scale or an effect's size; of
    a frequency a small one, for a run has many cycles; of a period, what shifts a run's end by some part of a turn."""
    share = settings.frequency_difference if x.frequency else settings.derivative_step
    h = share * (1.0 if x.kind == "base" else max(abs(u), 1.0 if x.shape else 0.1))
    return x.step_inside(u, min(h, x.longest_difference(u, settings.period_difference)))
