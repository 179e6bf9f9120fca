"""Going on from an earlier diagnosis: its sets of effects, fitted anew from where they stood.

Only points are carried over, and every one is simulated again, so nothing that has changed since (an accepted effect, a
further run, another catalogue) makes an old number pass for a new one.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..problem.parameters import EffectCandidate, Point
from ..problem.problem import Problem
from ..selection.hypothesis import Hypothesis
from .rounds import best_of_each_set, polish_near, search_cost
from .starts import FitStart, fit_from


@dataclass(frozen=True)
class EarlierSet:
    """A set of effects by their labels, each with its form (None: the plain one), and where its fit stood."""

    effects: Mapping[str, str | None]
    point: Point


@dataclass(frozen=True)
class EarlierDiagnosis:
    """What an earlier diagnosis had fitted, the best first."""

    sets: tuple[EarlierSet, ...]
    finished: bool
    """Its search had come to its end."""


def transferable_sets(problem: Problem, earlier: EarlierDiagnosis) -> list[EarlierSet]:
    """The sets that the problem can have, without what it takes as known, and of their points what such a set has: what
    was accepted before and is not now is no part of it. A set that occurs twice is the one that had most of what is
    known."""
    accepted = {c.label for c in problem.accepted}
    by_key: dict[frozenset[tuple[str, str | None]], EarlierSet] = {}
    for s in sorted(earlier.sets, key=lambda s: len(accepted - s.effects.keys())):
        remaining = {label: form for label, form in s.effects.items() if label not in accepted}
        candidates = [_candidate(problem, label, form) for label, form in remaining.items()]
        names = {x.name for x in (*problem.base, *(x for c in candidates if c is not None for x in c.parameters))}
        if None not in candidates:
            point = {name: u for name, u in s.point.items() if name in names}
            by_key.setdefault(frozenset(remaining.items()), EarlierSet(remaining, point))
    return list(by_key.values())


def baseline_point(problem: Problem, sets: Sequence[EarlierSet]) -> Point:
    """Where a refit of what every set has may begin: where it stood without effects, else beside the best of them."""
    start = next((s for s in sets if not s.effects), None) or next(iter(sets), None)
    return {x.name: start.point.get(x.name, 0.0) for x in problem.base} if start else {}


def refit_sets(
    problem: Problem, sets: Sequence[EarlierSet], baseline: Hypothesis, nuisance_jacobian: np.ndarray
) -> list[Hypothesis]:
    """The best sets fitted from where they stood, those near the best of them to the end, the best first."""
    fit, starts = baseline.fit, []
    for s in [s for s in sets if s.effects][: problem.settings.search.sets_per_round]:
        chosen = [_candidate(problem, label, form) for label, form in s.effects.items()]
        candidates = tuple(c for c in chosen if c is not None)
        starts.append(FitStart(candidates, s.point, fit.correction, fit))
    fits = [] if problem.stop_requested else fit_from(problem, starts, nuisance_jacobian)
    fitted = [h for h in fits if h is not None]
    least = min((search_cost(h) for h in fitted), default=0.0)
    return best_of_each_set(polish_near(problem, fitted, least, nuisance_jacobian))


def _candidate(problem: Problem, label: str, form: str | None) -> EffectCandidate | None:
    """The effect in that form; None where there is none such."""
    c = next((c for c in problem.candidates if c.label == label), None)
    if c is None or form is None:
        return c
    its_form = next((f for f in c.forms if f.id == form), None)
    return c.in_form(its_form) if its_form is not None else None
