"""Effects that act alike, tried in each other's place.

A bank at a point where one of them is in foretells badly what another would do instead: a delay and a slow valve both
make a machine swing, and the difference of two swings is no sum of responses. So each is simulated in the other's
place.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Set
from typing import NamedTuple

import numpy as np

from ..estimation.linear import profile_nuisances
from ..problem.noise import rms
from ..problem.parameters import EffectCandidate, Point
from ..problem.problem import Problem
from ..selection.hypothesis import Hypothesis, is_adequate
from .periods import find_period
from .polish import polish
from .response_bank import evaluate_in_batches, point_with
from .rounds import best_of_each_set, idle_effects, polish_near, search_cost
from .sizes import between, grid, variants
from .starts import FitStart, exact_hypotheses_at, fit_from

_Trial = tuple[EffectCandidate, Mapping[str, float]]
"""A relative, and the values of its parameters."""


class _Swap(NamedTuple):
    """A hypothesis with an effect in another one's place, at a size."""

    candidates: tuple[EffectCandidate, ...]
    relative: EffectCandidate
    point: Point
    rms_left: float
    """Normalised RMS of the residual."""
    has_period: bool = False
    """Its size is a period that was looked for: it may be far better than a fit of this set that is known."""


def swap_relatives(
    problem: Problem, hypotheses: Sequence[Hypothesis], nuisance_jacobian: np.ndarray
) -> list[Hypothesis]:
    """With the best hypothesis' effects replaced one at a time by others of their group, those that come near fitted to
    the end."""
    best = hypotheses[0]
    known_labels = {h.labels for h in hypotheses if not h.quick}
    nearest = _nearest(problem, best, known_labels, nuisance_jacobian)
    if problem.stop_requested:
        return list(hypotheses)
    known_labels -= {frozenset(c.label for c in s.candidates) for s in nearest if s.has_period}
    fitted = [h for h in _fitted(problem, nearest, best, nuisance_jacobian) if h.labels not in known_labels]
    return best_of_each_set([*hypotheses, *polish_near(problem, fitted, search_cost(best), nuisance_jacobian)])


def fit_relatives_at_best(
    problem: Problem, hypotheses: Sequence[Hypothesis], nuisance_jacobian: np.ndarray
) -> list[Hypothesis]:
    """With each effect of the best hypothesis replaced by the relatives that serve nearly as well where it stands,
    fitted from there to the end, also where such a set is known: it may stand in another local minimum.

    What acts alike should lose or win by the data, not by its way there.
    """
    best, settings = hypotheses[0], problem.settings.search
    nearest = _nearest(problem, best, set(), nuisance_jacobian)
    if problem.stop_requested or not nearest:
        return list(hypotheses)
    started = exact_hypotheses_at(problem, [(s.candidates, s.point) for s in nearest], nuisance_jacobian)
    near = [h for h in started if search_cost(h) < search_cost(best) + settings.relatives_within]
    return best_of_each_set([*hypotheses, *polish(problem, near, nuisance_jacobian, settings.polish_rounds)])


def _nearest(
    problem: Problem, best: Hypothesis, known_labels: Set[frozenset[str]], nuisance_jacobian: np.ndarray
) -> list[_Swap]:
    """The swaps of the best hypothesis' effects that leave least, without sets that are known, by their labels."""
    swaps = [s for replaced in best.candidates for s in _swaps(problem, best, replaced, nuisance_jacobian)]
    new = [s for s in swaps if s.has_period or frozenset(c.label for c in s.candidates) not in known_labels]
    return sorted(new, key=lambda s: s.rms_left)[: problem.settings.search.relatives]


def _fitted(
    problem: Problem, swaps: Sequence[_Swap], best: Hypothesis, nuisance_jacobian: np.ndarray
) -> list[Hypothesis]:
    """Fits from there, anew without what has come to nothing: it stood by the effect that was replaced."""
    negligible, fit = problem.settings.search.negligible, best.fit
    starts = [FitStart(s.candidates, s.point, fit.correction, fit) for s in swaps]
    fitted, fewer = [], []
    for h in (h for h in fit_from(problem, starts, nuisance_jacobian) if h is not None):
        idle = idle_effects(h, negligible)
        fitted += [h] if not idle else []
        remaining = tuple(c for c in h.candidates if c not in idle)
        if idle and remaining:
            point: Point = h.fit.point
            for c in idle:
                point = point_with(point, c, {})
            fewer.append(FitStart(remaining, point, fit.correction, fit))
    return [*fitted, *(h for h in fit_from(problem, fewer, nuisance_jacobian) if h is not None)]


def _swaps(
    problem: Problem, best: Hypothesis, replaced: EffectCandidate, nuisance_jacobian: np.ndarray
) -> list[_Swap]:
    """Each relative of an effect in its place, at the size of the grid, and then between, that serves best; one that is
    in already may have stood beside it at a wrong size, and do alone."""
    settings = problem.settings.search
    relatives = [c for c in problem.candidates if c.group == replaced.group and c.label != replaced.label]
    swaps: dict[str, dict[float, _Swap]] = {c.label: {} for c in relatives}
    nearest: dict[str, _Swap] = {}
    trials: list[_Trial] = [(c, v) for c in relatives for v in variants(c, grid(c.main, settings), settings)]
    for _ in range(1 + settings.size_halvings):
        for swap in _simulated(problem, best, replaced, trials, nuisance_jacobian):
            size = swap.point[swap.relative.main.name]
            of_relative = swaps[swap.relative.label]
            if size not in of_relative or swap.rms_left < of_relative[size].rms_left:
                of_relative[size] = swap
        nearest = {label: min(s.values(), key=lambda s: s.rms_left) for label, s in swaps.items() if s}
        trials = [
            _trial(s, size) for label, s in nearest.items()
            for size in between(swaps[label], s.point[s.relative.main.name])
        ]  # fmt: skip
    if not problem.stop_requested:
        reach = settings.period_within * best.fit.rms if is_adequate(problem, best.fit) else np.inf
        periodic = [s for s in nearest.values() if s.relative.main.longest_run and s.rms_left < reach]
        trials = [_trial(s, find_period(problem, s.relative.main, s.point)) for s in periodic]
        for swap in _simulated(problem, best, replaced, trials, nuisance_jacobian):
            label = swap.relative.label
            nearest[label] = min(nearest[label], swap._replace(has_period=True), key=lambda s: s.rms_left)
    return list(nearest.values())


def _trial(swap: _Swap, size: float) -> _Trial:
    """The relative at another size, its shapes as they are."""
    values = {x.name: swap.point[x.name] for x in swap.relative.parameters}
    return swap.relative, {**values, swap.relative.main.name: size}


def _simulated(
    problem: Problem, best: Hypothesis, replaced: EffectCandidate,
    trials: Sequence[_Trial], nuisance_jacobian: np.ndarray,
) -> list[_Swap]:  # fmt: skip
    """The best hypothesis with each of these in the place of an effect; those that run."""
    others = tuple(c for c in best.candidates if c is not replaced)
    points = [{**point_with(best.fit.point, replaced, {}), **values} for _, values in trials]
    swaps = []
    for (c, _), point, coarse in zip(trials, points, evaluate_in_batches(problem, points), strict=True):
        if coarse is not None:
            rms_left = rms(profile_nuisances(problem, coarse + best.fit.correction, nuisance_jacobian, 1.0).residual)
            swaps.append(_Swap((*(o for o in others if o.label != c.label), c), c, point, rms_left))
    return swaps
