"""What a hypothesis leaves without some of its effects: every subset of them, each with a refit of its own."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations

import numpy as np

from ..problem.problem import Problem
from ..selection.evidence import RankedHypothesis, rank_hypotheses
from ..selection.hypothesis import Hypothesis
from .removal import drop_effects, predict_without

Labels = frozenset[str]


def complete_subsets(
    problem: Problem, ranked: Sequence[RankedHypothesis], best: RankedHypothesis, nuisance_jacobian: np.ndarray
) -> dict[Labels, RankedHypothesis]:
    """The best fit of every subset of a hypothesis' effects in their forms, itself among them.

    Those that were not fitted, or only quickly, are now, from where a larger set stands; where there is no time for
    that, the fit without an effect is foretold by the derivatives.
    """
    best_fits: dict[Labels, RankedHypothesis] = {}
    forms = {c.label: c.form for c in best.hypothesis.candidates}
    for r in sorted(ranked, key=lambda r: r.neg2_log_posterior):
        is_part = all(c.form == forms.get(c.label, c.form) for c in r.hypothesis.candidates)
        if is_part and not (r.hypothesis.quick and r.hypothesis.candidates):
            best_fits.setdefault(r.hypothesis.labels, r)
    whole = best.hypothesis.labels
    completed = {whole: best, frozenset(): best_fits[frozenset()]}
    for size in range(len(whole) - 1, 0, -1):
        subsets = [frozenset(names) for names in combinations(sorted(whole), size)]
        above = {
            s: next(r for t, r in completed.items() if len(t) == size + 1 and s < t)
            for s in subsets
            if s not in best_fits
        }
        completed |= {s: best_fits[s] for s in subsets if s in best_fits}
        completed |= _fit_subsets(problem, above, nuisance_jacobian)
    return completed


def _fit_subsets(
    problem: Problem, above: Mapping[Labels, RankedHypothesis], nuisance_jacobian: np.ndarray
) -> dict[Labels, RankedHypothesis]:
    """Fits of subsets, each from where a set with one effect more stands."""
    pairs = [(r.hypothesis, next(c for c in r.hypothesis.candidates if c.label not in s)) for s, r in above.items()]
    fits: list[Hypothesis | None] = [None] * len(pairs)
    if not problem.stop_requested:
        fits = drop_effects(problem, pairs, nuisance_jacobian)
    completed = {}
    for subset, (h, dropped), fitted in zip(above, pairs, fits, strict=True):
        if fitted is None:
            remaining = tuple(c for c in h.candidates if c is not dropped)
            fitted = Hypothesis(remaining, predict_without(problem, h.fit, dropped.parameters, nuisance_jacobian))
        completed[subset] = rank_hypotheses(problem, [fitted], nuisance_jacobian)[0]
    return completed
