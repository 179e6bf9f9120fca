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
from ..selection.hypothesis import Hypothesis
from .bank import in_batches
from .refinement import Place, fit_from, polish, stand_exactly
from .rounds import best_of_each_set, idle_effects, polish_near, score
from .sizes import grid, variants


class _Swap(NamedTuple):
    """A hypothesis with an effect in another one's place, at a size."""

    candidates: tuple[EffectCandidate, ...]
    relative: EffectCandidate
    point: Point
    left: float
    """Normalised RMS of the residual."""


def swap_relatives(problem: Problem, found: Sequence[Hypothesis], nuisance_jacobian: np.ndarray) -> list[Hypothesis]:
    """With the best hypothesis' effects replaced one at a time by others of their group, those that come near fitted to
    the end."""
    best = found[0]
    known = {h.labels for h in found if not h.quick}
    nearest = _nearest(problem, best, known, nuisance_jacobian)
    if problem.stop_requested:
        return list(found)
    fitted = [h for h in _fitted(problem, nearest, best, nuisance_jacobian) if h.labels not in known]
    return best_of_each_set([*found, *polish_near(problem, fitted, score(best), nuisance_jacobian)])


def fit_relatives_at_best(
    problem: Problem, found: Sequence[Hypothesis], nuisance_jacobian: np.ndarray
) -> list[Hypothesis]:
    """With each effect of the best hypothesis replaced by the relatives that serve nearly as well where it stands,
    fitted from there to the end, also where such a set is known: it may have been fitted into another pit.

    What acts alike should lose or win by the data, not by its way there (four lands with a late sensor: 1.18 times the
    noise with the delay that was there, 1.04 with a lag in its place, 0.98 with the delay from where the lag stood).
    """
    best, settings = found[0], problem.settings.search
    nearest = _nearest(problem, best, set(), nuisance_jacobian)
    if problem.stop_requested or not nearest:
        return list(found)
    begun = stand_exactly(problem, [(s.candidates, s.point) for s in nearest], nuisance_jacobian)
    near = [h for h in begun if score(h) < score(best) + settings.relatives_near]
    return best_of_each_set([*found, *polish(problem, near, nuisance_jacobian, settings.polish_looks)])


def _nearest(
    problem: Problem, best: Hypothesis, known: Set[frozenset[str]], nuisance_jacobian: np.ndarray
) -> list[_Swap]:
    """The swaps of the best hypothesis' effects that leave least, without sets that are known, by their labels."""
    swaps = [s for gone in best.candidates for s in _swaps(problem, best, gone, nuisance_jacobian)]
    new = [s for s in swaps if frozenset(c.label for c in s.candidates) not in known]
    return sorted(new, key=lambda s: s.left)[: problem.settings.search.relatives]


def _fitted(
    problem: Problem, swaps: Sequence[_Swap], best: Hypothesis, nuisance_jacobian: np.ndarray
) -> list[Hypothesis]:
    """Fits from there, anew without what has come to nothing: it stood by the effect that was replaced."""
    negligible, fit = problem.settings.search.negligible, best.fit
    places = [Place(s.candidates, s.point, fit.correction, fit) for s in swaps]
    made, fewer = [], []
    for h in (h for h in fit_from(problem, places, nuisance_jacobian) if h is not None):
        idle = idle_effects(h, negligible)
        made += [h] if not idle else []
        kept = tuple(c for c in h.candidates if c not in idle)
        if idle and kept:
            gone = {x.name for c in idle for x in c.parameters}
            point = {name: u for name, u in h.fit.point.items() if name not in gone}
            fewer.append(Place(kept, point, fit.correction, fit))
    return [*made, *(h for h in fit_from(problem, fewer, nuisance_jacobian) if h is not None)]


def _swaps(
    problem: Problem, best: Hypothesis, gone: EffectCandidate, nuisance_jacobian: np.ndarray
) -> list[_Swap]:
    """Each relative of an effect in its place, at the size of the grid, and then between, that serves best."""
    settings = problem.settings.search
    relatives = [c for c in problem.candidates if c.group == gone.group and c.label not in best.labels]
    tried: dict[str, dict[float, _Swap]] = {c.label: {} for c in relatives}
    wanted = [(c, v) for c in relatives for v in variants(c, grid(c.main, settings), settings)]
    for _ in range(1 + settings.size_looks):
        for swap in _simulated(problem, best, gone, wanted, nuisance_jacobian):
            size = swap.point[swap.relative.main.name]
            own = tried[swap.relative.label]
            if size not in own or swap.left < own[size].left:
                own[size] = swap
        wanted = [entry for own in tried.values() if own for entry in _between(own)]
    return [min(own.values(), key=lambda s: s.left) for own in tried.values() if own]


def _between(tried: Mapping[float, _Swap]) -> list[tuple[EffectCandidate, dict[str, float]]]:
    """Sizes half way, by their ratio, from the best to its neighbours."""
    best = min(tried.values(), key=lambda s: s.left)
    main = best.relative.main.name
    size = best.point[main]
    same = sorted(s for s in tried if s * size > 0.0)
    k = same.index(size)
    values = {x.name: best.point[x.name] for x in best.relative.parameters}
    return [(best.relative, {**values, main: float(np.sign(size) * np.sqrt(size * s))}) for s in
            (*same[max(0, k - 1) : k], *same[k + 1 : k + 2])]  # fmt: skip


def _simulated(
    problem: Problem, best: Hypothesis, gone: EffectCandidate,
    wanted: Sequence[tuple[EffectCandidate, Mapping[str, float]]], nuisance_jacobian: np.ndarray,
) -> list[_Swap]:  # fmt: skip
    """The best hypothesis with each of these in the place of an effect; those that run."""
    kept = tuple(c for c in best.candidates if c is not gone)
    own = {x.name for x in gone.parameters}
    rest = {name: u for name, u in best.fit.point.items() if name not in own}
    points = [{**rest, **values} for _, values in wanted]
    made = []
    for (c, _), point, coarse in zip(wanted, points, in_batches(problem, points), strict=True):
        if coarse is not None:
            left = rms(profile_nuisances(problem, coarse + best.fit.correction, nuisance_jacobian, 1.0).residual)
            made.append(_Swap((*kept, c), c, point, left))
    return made
