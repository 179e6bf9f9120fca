"""A round of the search: a bank at the best point so far, the sets that it proposes, their fits."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..problem.parameters import EffectCandidate
from ..problem.problem import Problem
from ..selection.hypothesis import Hypothesis, is_adequate
from ..settings import SCORING
from .form_responses import add_forms
from .frequencies import add_frequencies
from .polish import polish
from .removal import drop_effects, falls_behind, predict_without
from .response_bank import ResponseBank, bank_of_usual_sizes, complete_bank
from .sets import Projection, Proposal, propose_sets, shares_alone
from .starts import fit_disappointing, fit_proposals


@dataclass(frozen=True, eq=False)
class Round:
    """What one round has found: fits, and the share of the residual's squares that each effect alone could explain."""

    hypotheses: tuple[Hypothesis, ...]
    shares_alone: dict[str, float]
    """By label."""


class FirstLook(NamedTuple):
    """A bank of usual sizes, to be completed, and fits of the sets that look best in it."""

    bank: ResponseBank
    hypotheses: list[Hypothesis]
    shares_alone: dict[str, float]
    """As of a round."""


def search_round(problem: Problem, nuisance_jacobian: np.ndarray, incumbent: Hypothesis) -> Round:
    """A bank at a hypothesis, and fits of the sets that it proposes, the best of them fitted to the end."""
    return polish_round(problem, nuisance_jacobian, run_quick_round(problem, nuisance_jacobian, incumbent))


def look_first(problem: Problem, nuisance_jacobian: np.ndarray, incumbent: Hypothesis) -> FirstLook:
    """Half of a bank at a hypothesis, and a few steps of the best sets: what is likely, said soon."""
    settings = problem.settings.search
    bank = _bank_at(problem, incumbent)
    proposals = [p for p in propose_sets(problem, bank, nuisance_jacobian, rounds=1)[1] if p.candidates]
    chosen = choose_proposals(proposals, incumbent, settings.first_sets)
    fits = fit_proposals(problem, bank, chosen, nuisance_jacobian, settings.first_fit_steps)
    return FirstLook(bank, _without_idle(problem, fits), shares_alone(problem, bank, nuisance_jacobian))


def run_quick_round(
    problem: Problem, nuisance_jacobian: np.ndarray, incumbent: Hypothesis, bank: ResponseBank | None = None
) -> Round:
    """A bank at a hypothesis, and quick fits of the sets that it proposes, the best first; bank: that of a first look
    there."""
    settings = problem.settings.search
    bank = complete_bank(problem, bank or _bank_at(problem, incumbent))
    projection = Projection.of_all(problem, bank, nuisance_jacobian)
    bank = add_forms(problem, add_frequencies(problem, bank, projection), projection)
    bank, proposals = propose_sets(problem, bank, nuisance_jacobian)
    chosen = choose_proposals(proposals, incumbent, settings.sets_per_round)
    hypotheses = fit_proposals(problem, bank, chosen, nuisance_jacobian, settings.quick_fit_steps)
    hypotheses += fit_disappointing(problem, bank, chosen, hypotheses, nuisance_jacobian)
    hypotheses = sorted(_without_idle(problem, hypotheses), key=search_cost)
    return Round(tuple(hypotheses), shares_alone(problem, bank, nuisance_jacobian))


def _bank_at(problem: Problem, h: Hypothesis) -> ResponseBank:
    fit = h.fit
    return bank_of_usual_sizes(problem, fit.point, fit.model - fit.correction, fit.correction, h.candidates)


def _without_idle(problem: Problem, hypotheses: Sequence[Hypothesis]) -> list[Hypothesis]:
    return [h for h in hypotheses if not idle_effects(h, problem.settings.search.negligible)]


def polish_round(problem: Problem, nuisance_jacobian: np.ndarray, first: Round) -> Round:
    """The same with the best of its fits gone on with."""
    leaders = _polish_leaders(problem, first.hypotheses, nuisance_jacobian)
    polished_keys = {h.key for h in leaders}
    rest = [h for h in first.hypotheses if h.key not in polished_keys]
    return Round((*leaders, *rest), first.shares_alone)


def _polish_leaders(
    problem: Problem, hypotheses: Sequence[Hypothesis], nuisance_jacobian: np.ndarray
) -> list[Hypothesis]:
    """The best fitted to the end, and those that may still reach it if they gain as much by that as it has."""
    settings = problem.settings.search
    leaders = [
        h
        for h in hypotheses[: settings.polished_per_round]
        if search_cost(h) < search_cost(hypotheses[0]) + settings.polish_within
    ]
    return polish(problem, leaders, nuisance_jacobian, settings.polish_rounds)


def polish_near(
    problem: Problem, fitted: Sequence[Hypothesis], least: float, nuisance_jacobian: np.ndarray
) -> list[Hypothesis]:
    """Fits of which those near the least score, at most `max_polished`, are gone on with to the end."""
    settings, ordered = problem.settings.search, sorted(fitted, key=search_cost)
    near = [h for h in ordered if search_cost(h) < least + settings.polish_within][: settings.max_polished]
    polished = polish(problem, near, nuisance_jacobian, settings.polish_rounds)
    return [*polished, *(h for h in ordered if h not in near)]


def choose_proposals(proposals: Sequence[Proposal], incumbent: Hypothesis, most: int) -> list[Proposal]:
    """The sets to be fitted, `most` or a few more.

    The cheapest of each size; those with one effect more than the hypothesis has, for it may lack just that; those with
    a near relative of one of its effects in its place, for what acts alike is told apart by a fit only; then the
    cheapest of all.
    """
    chosen: dict[Proposal, None] = {}
    for size in sorted({len(p.candidates) for p in proposals}):
        of_size = [p for p in proposals if len(p.candidates) == size]
        chosen |= dict.fromkeys(of_size[: most // 4 if size else 1])
    extended = [p for p in proposals if p.labels > incumbent.labels and len(p.labels) == len(incumbent.labels) + 1]
    relatives = [p for p in proposals if _swaps_relative(p, incumbent)]
    chosen |= dict.fromkeys([*extended[: most // 2], *relatives[: most // 4]])
    rest = [p for p in proposals if p not in chosen]
    return [*chosen, *rest[: max(0, most - len(chosen))]]


def _swaps_relative(p: Proposal, incumbent: Hypothesis) -> bool:
    removed = [c for c in incumbent.candidates if c not in p.candidates]
    added = [c for c in p.candidates if c not in incumbent.candidates]
    return len(removed) == len(added) == 1 and removed[0].group == added[0].group


def idle_effects(h: Hypothesis, negligible: float) -> list[EffectCandidate]:
    """Effects of a hypothesis that have come to nothing."""
    point = h.fit.point
    return [c for c in h.candidates if any(abs(point[x.name]) < negligible for x in c.parameters if not x.shape)]


def search_cost(h: Hypothesis) -> float:
    """What hypotheses are compared by until they are judged: the fit, its parameters, a price for every effect and for
    every form that is not the plain one."""
    forms = sum(c.form is not None for c in h.candidates)
    return h.penalised_deviance + SCORING.price * len(h.candidates) + SCORING.form_price * forms


def best_of_each_set(hypotheses: Iterable[Hypothesis]) -> list[Hypothesis]:
    """Of every set of effects the best fit, the best first; what a first look claims counts only where nothing else is
    known of a set, for it rests on the long step's error at another point."""
    best: dict[frozenset[str], Hypothesis] = {}
    for h in sorted(hypotheses, key=lambda h: (h.quick, h.penalised_deviance)):
        best.setdefault(h.key, h)
    return sorted(best.values(), key=search_cost)


def next_start(
    hypotheses: Sequence[Hypothesis], banked: Sequence[frozenset[str]], better: bool, elsewhere: Hypothesis | None
) -> Hypothesis | None:
    """Where the next bank is made: once at the best set if that is better than what was known before, then elsewhere,
    then at the best set or part of it at which there has been none.

    Base parameters that were fitted without the right effects are bent, and around them these may not show; around the
    model as delivered they do. Nor may the right effect beside a wrong one: at the set without that, it does.
    """
    best = hypotheses[0]
    new = best.key not in banked
    if elsewhere is not None and not (new and better and len(banked) < 2):
        return elsewhere
    if new:
        return best
    parts = (h for h in hypotheses if h.candidates and h.key < best.key and h.key not in banked)
    return next(parts, None)


def drop_needless_sets(problem: Problem, hypotheses: Sequence[Hypothesis]) -> list[Hypothesis]:
    """Without sets to which a part of them leaves nothing to add; single effects stay beside a baseline that leaves
    nothing, to show that none does better."""
    adequate = [h for h in hypotheses if is_adequate(problem, h.fit)]
    return [
        h for h in hypotheses
        if not any(g.key < h.key and (g.candidates or len(h.candidates) > 1) for g in adequate)
    ]  # fmt: skip


def fit_leaders(problem: Problem, hypotheses: Sequence[Hypothesis], nuisance_jacobian: np.ndarray) -> list[Hypothesis]:
    """With those near the best fitted to the end, too, and those to which others have nothing to add: these are judged
    in the others' place, however much the others score within the noise."""
    settings = problem.settings.search
    near = [
        h for h in hypotheses if search_cost(h) < search_cost(hypotheses[0]) + settings.polish_within
    ][: settings.max_polished]  # fmt: skip
    adequate = [h for h in drop_needless_sets(problem, hypotheses) if h.candidates and is_adequate(problem, h.fit)]
    leaders = {h.key: h for h in (*near, *adequate[: settings.max_polished])}
    quick = [h for h in leaders.values() if h.quick]
    return best_of_each_set([*hypotheses, *polish(problem, quick, nuisance_jacobian, settings.polish_rounds)])


def drop_each_effect(
    problem: Problem, hypotheses: Sequence[Hypothesis], nuisance_jacobian: np.ndarray
) -> list[Hypothesis]:
    """With the best one fitted without each of its effects, from where it stands, and the baseline from the best of
    these that has one effect.

    An effect must not win because the fit without it has stopped on its way. A set may so give way to a smaller one,
    and that to another.
    """
    current, tried_keys = list(hypotheses), set()
    for _ in range(problem.settings.search.most_effects):
        best = current[0]
        to_drop = [c for c in best.candidates if best.key - c.key not in tried_keys]
        if problem.stop_requested:
            break
        tried_keys |= {best.key - c.key for c in to_drop}
        current += [h for h in drop_effects(problem, [(best, c) for c in to_drop], nuisance_jacobian) if h is not None]
        current = best_of_each_set(current)
        if current[0] is best:
            break
    return best_of_each_set([*current, *_refit_baseline(problem, current, nuisance_jacobian)])


def _refit_baseline(
    problem: Problem, hypotheses: Sequence[Hypothesis], nuisance_jacobian: np.ndarray
) -> list[Hypothesis]:
    """The baseline from the best fit of one of the best set's effects, if derivatives there foretell a better one."""
    best, baseline = hypotheses[0], next(h for h in hypotheses if not h.candidates)
    single = next((h for h in hypotheses if len(h.candidates) == 1 and h.key < best.key and not h.quick), None)
    if single is None or problem.stop_requested:
        return []
    (effect,) = single.candidates
    predicted = predict_without(problem, single.fit, effect.parameters, nuisance_jacobian)
    if not falls_behind(problem, baseline, predicted):
        return []
    return [h for h in drop_effects(problem, [(single, effect)], nuisance_jacobian) if h is not None]
