"""The stages of the greedy search: large effects, pairs, and what is tried in place of a winner's effects.

Inputs are a problem and hypotheses, outputs hypotheses; a later search replaces this file, `greedy.py` and the other
`greedy_*.py`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ..problem.parameters import EffectCandidate
from ..problem.problem import Problem
from . import greedy, greedy_large
from .baseline import fitted_base
from .evidence import RankedHypothesis, rank_hypotheses
from .greedy_screening import MUCH, SINGLES, ResponseCurve, estimate_savings, other_starts, screen_effects
from .greedy_steps import freeze_fit, shorten_fit_step
from .hypothesis import Hypothesis, best_of_each, is_adequate

FINALISTS = 3
"""Hypotheses whose fits are carried to the end, beside those that have plainly stopped on their way."""

PROMISING = 0.6
"""RMS of the best pair, as a share of the best single effect's, below which one of its two effects may be right."""

ALIKE, SCREENED = 2, 6
"""Effects of the same group, and of others, that are tried in place of one of the best hypothesis'; and of the others
those that are screened for it."""

NEAR = 20.0
"""How far behind the best a hypothesis may be to be finished, in -2 log posterior."""

PAIRS_FROM = 3
"""Single candidates that are tried with a second one."""

PAIRS = 4
"""Second candidates that are fitted with each of them."""

SCREENED_ANEW = 16
"""Candidates that are screened anew beside a single effect, the best by their former response curves."""

WORTH = 10.0
"""Saving that a second effect has to promise."""


class Singles(NamedTuple):
    """A problem, whose fit step may be shorter now, with its baseline, screening and fits of single effects."""

    problem: Problem
    baseline: Hypothesis
    curves: list[ResponseCurve]
    singles: list[Hypothesis]


def fit_singles(
    problem: Problem, baseline: Hypothesis, curves: Sequence[ResponseCurve], nuisance_jacobian: np.ndarray
) -> list[Hypothesis]:
    """Fits of single effects, the best first."""
    if is_adequate(problem, baseline.fit):  # only to show that no effect does better
        return greedy.forward_step(problem, baseline, curves, nuisance_jacobian, SINGLES // 2, 1)
    others = other_starts(problem, baseline.fit, nuisance_jacobian)
    return greedy.forward_step(problem, baseline, curves, nuisance_jacobian, SINGLES, greedy.KEPT, others)


def may_be_large(problem: Problem, baseline: Hypothesis, singles: Sequence[Hypothesis]) -> bool:
    """Whether large effects are to be looked for."""
    return bool(singles) and not is_adequate(problem, singles[0].fit) and baseline.fit.rms > MUCH


def fit_large(s: Singles, nuisance_jacobian: np.ndarray) -> Singles:
    """Baseline, screening and single effects, with fits from the model as delivered where these promise more.

    They may need shorter steps; baseline and screening are then made anew, and the former fits stay as they are.
    """
    problem, baseline, curves, singles = s
    best = min(h.penalised_deviance for h in singles)
    gained = max(baseline.penalised_deviance - best, 0.0)
    most = best + greedy_large.NEARLY * gained  # a start is not yet fitted
    starts = [x for x in greedy_large.scan(problem, nuisance_jacobian) if x.penalised_deviance < most]
    starts = starts[: greedy_large.BEGUN]
    if not starts:
        return s
    before = problem.discretisation.coarsening
    problem = shorten_fit_step(problem, [x.point for x in starts], baseline.fit.rms)
    if problem.discretisation.coarsening != before:
        baseline = fitted_base(problem, baseline.fit.normalised, nuisance_jacobian)
        curves = screen_effects(problem, baseline.fit, nuisance_jacobian)
        singles = [freeze_fit(h) for h in singles]
    found = [*greedy_large.fits(problem, starts, nuisance_jacobian), *singles]
    return Singles(problem, baseline, curves, best_of_each(found, lambda h: h.penalised_deviance))


def fit_pairs(
    problem: Problem, baseline: Hypothesis, singles: Sequence[Hypothesis], curves: Sequence[ResponseCurve],
    nuisance_jacobian: np.ndarray,
) -> list[Hypothesis]:  # fmt: skip
    """The best single effects, each with a second one.

    Which one is seen from the screening; where that was done far from the data, it is done anew beside each effect.
    """
    made: dict[tuple[str, ...], Hypothesis] = {}
    for h in [h for h in singles if not h.finished][:PAIRS_FROM]:
        if any(is_adequate(problem, pair.fit) for pair in made.values()) or problem.stop_requested:
            break
        beside = [replace(s, at=h.fit) for s in curves]
        again = sorted(estimate_savings(problem, h.fit, nuisance_jacobian, beside), key=lambda s: -s.saving)
        if baseline.fit.rms > MUCH:
            anew = [s.candidate for s in again[:SCREENED_ANEW]]
            again = screen_effects(problem, h.fit, nuisance_jacobian, anew)
        again = [s for s in again if s.saving > WORTH]
        for pair in greedy.forward_step(problem, h, again, nuisance_jacobian, PAIRS, 1):
            key = tuple(sorted(c.label for c in pair.candidates))
            if key not in made or pair.penalised_deviance < made[key].penalised_deviance:
                made[key] = pair
    return list(made.values())


def swap_effects(
    problem: Problem, singles: Sequence[Hypothesis], pairs: Sequence[Hypothesis], nuisance_jacobian: np.ndarray
) -> list[Hypothesis]:
    """Pairs with one effect of the best pair and another than its second, where that explains much but not enough.

    What the refit of the base parameters had hidden shows beside the effect that is right.
    """
    best = min(pairs, key=lambda h: h.penalised_deviance, default=None)
    if best is None or is_adequate(problem, best.fit) or problem.stop_requested:
        return []
    if best.fit.rms > PROMISING * min(h.fit.rms for h in singles):
        return []
    tried = {frozenset(c.label for c in h.candidates) for h in pairs}
    made: list[Hypothesis] = []
    for gone in best.candidates:
        left = greedy.drop_effect(problem, best, gone, nuisance_jacobian, greedy.QUICK)
        if left is None:
            continue
        kept = {c.label for c in left.candidates}
        curves = screen_effects(problem, left.fit, nuisance_jacobian)
        new = [s for s in curves if kept | {s.candidate.label} not in tried]
        made += greedy.forward_step(problem, left, new, nuisance_jacobian, PAIRS, PAIRS)
        if any(is_adequate(problem, h.fit) for h in made) or problem.stop_requested:
            break
    return made


def finish_best(
    problem: Problem, hypotheses: Sequence[Hypothesis], nuisance_jacobian: np.ndarray
) -> list[RankedHypothesis]:
    """All hypotheses ranked, those that may win fitted to their end."""
    ranked = rank_hypotheses(problem, hypotheses, nuisance_jacobian)
    made = list(hypotheses)
    for place, r in enumerate(ranked):
        wanted = place < FINALISTS or _stopped_on_its_way(r, ranked)
        near = wanted and r.neg2_log_posterior < ranked[0].neg2_log_posterior + NEAR
        if place == 0 or (near and not problem.stop_requested):
            k = next(k for k, h in enumerate(made) if h is r.hypothesis)
            made[k] = greedy.finish_fit(problem, r.hypothesis, nuisance_jacobian)
    return rank_hypotheses(problem, made, nuisance_jacobian, ranked)


def _stopped_on_its_way(r: RankedHypothesis, ranked: Sequence[RankedHypothesis]) -> bool:
    """Whether a fit leaves more than one without some of its effects: it has not arrived."""
    own = set(r.hypothesis.candidates)
    return any(set(k.hypothesis.candidates) < own and k.structured_energy < r.structured_energy for k in ranked)


def try_alike(
    problem: Problem, ranked: Sequence[RankedHypothesis], curves: Sequence[ResponseCurve],
    nuisance_jacobian: np.ndarray,
) -> list[RankedHypothesis]:  # fmt: skip
    """The hypotheses, and those with another effect in place of one of the best one's: one that acts in nearly the same
    way, which it may have hidden, or one that screening passed over beside what is now gone."""
    made = [r.hypothesis for r in ranked]
    tried = {frozenset(c.label for c in h.candidates) for h in made}
    best = ranked[0].hypothesis
    for gone in best.candidates:
        kept = {c.label for c in best.candidates if c is not gone}
        new = [s.candidate for s in curves if kept | {s.candidate.label} not in tried]
        others = [c for c in new if c.group == gone.group]
        if kept:
            others += [c for c in new if c.group != gone.group][:SCREENED]
        if not others or problem.stop_requested:
            continue
        left = greedy.drop_effect(problem, best, gone, nuisance_jacobian, greedy.QUICK)
        if left is None:
            continue
        again = [s for s in screen_effects(problem, left.fit, nuisance_jacobian, others) if s.saving > WORTH]
        alike = [s for s in again if s.candidate.group == gone.group][:ALIKE]
        chosen = alike + [s for s in again if s.candidate.group != gone.group][:ALIKE]
        for h in greedy.forward_step(problem, left, chosen, nuisance_jacobian, len(chosen), 1)[:1]:
            made.append(greedy.finish_fit(problem, h, nuisance_jacobian))
    return rank_hypotheses(problem, made, nuisance_jacobian, ranked)


def drop_each(
    problem: Problem, ranked: Sequence[RankedHypothesis], nuisance_jacobian: np.ndarray
) -> list[RankedHypothesis]:
    """The hypotheses, those that lack one of the best one's effects refitted from where it stands if that is better.

    An effect must not win because the fit without it has stopped on its way, however far away. A pair may so give way
    to one effect, and that to none.
    """
    made = {r.hypothesis.candidates: r.hypothesis for r in ranked}
    tried: set[tuple[EffectCandidate, ...]] = set()
    now = list(ranked)
    for _ in range(2):
        best = now[0].hypothesis
        for gone in best.candidates:
            left = tuple(c for c in best.candidates if c is not gone)
            if left in tried:
                continue
            tried.add(left)
            found = greedy.drop_effect(problem, best, gone, nuisance_jacobian, greedy.QUICK)
            if found is not None and (left not in made or found.penalised_deviance < made[left].penalised_deviance):
                made[left] = greedy.finish_fit(problem, found, nuisance_jacobian)
        now = rank_hypotheses(problem, list(made.values()), nuisance_jacobian, now)
    return now
