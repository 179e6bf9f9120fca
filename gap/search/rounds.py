"""A round of the search: a bank at the best point so far, the sets that it proposes, their fits."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from ..problem.parameters import EffectCandidate
from ..problem.problem import Problem
from ..selection.hypothesis import Hypothesis, is_adequate
from ..settings import SearchSettings
from .bank import build_bank
from .refinement import polish, refine, without
from .sets import Proposal, gains, propose


@dataclass(frozen=True, eq=False)
class Round:
    """What one round has found: fits, and the share of the residual's squares that each effect alone could explain."""

    hypotheses: tuple[Hypothesis, ...]
    gains: dict[str, float]
    """By label."""


def search_round(problem: Problem, nuisance_jacobian: np.ndarray, at: Hypothesis) -> Round:
    """A bank at a hypothesis, and fits of the sets that it proposes, the best of them fitted to the end."""
    return fit_to_the_end(problem, nuisance_jacobian, first_look(problem, nuisance_jacobian, at))


def first_look(problem: Problem, nuisance_jacobian: np.ndarray, at: Hypothesis) -> Round:
    """A bank at a hypothesis, and quick fits of the sets that it proposes, the best first."""
    settings, fit = problem.settings.search, at.fit
    bank = build_bank(problem, fit.point, fit.model - fit.correction, fit.correction, at.candidates)
    bank, proposals = propose(problem, bank, nuisance_jacobian)
    chosen = choose(proposals, at, settings.fitted)
    found = refine(problem, bank, chosen, nuisance_jacobian, settings.steps)
    found = sorted((h for h in found if not idle_effects(h, settings.negligible)), key=score)
    return Round(tuple(found), gains(problem, bank, nuisance_jacobian))


def fit_to_the_end(problem: Problem, nuisance_jacobian: np.ndarray, looked: Round) -> Round:
    """The same with the best of its fits gone on with."""
    leaders = _polish_leaders(problem, looked.hypotheses, nuisance_jacobian)
    done = {h.parts for h in leaders}
    rest = [h for h in looked.hypotheses if h.parts not in done]
    return Round((*leaders, *rest), looked.gains)


def _polish_leaders(
    problem: Problem, found: Sequence[Hypothesis], nuisance_jacobian: np.ndarray
) -> list[Hypothesis]:
    """The best fitted to the end, and those that may still reach it if they gain as much by that as it has."""
    settings = problem.settings.search
    leaders = [h for h in found[: settings.corrected] if score(h) < score(found[0]) + settings.near_leader]
    return polish(problem, leaders, nuisance_jacobian, settings.polish_looks)


def polish_near(
    problem: Problem, fitted: Sequence[Hypothesis], least: float, nuisance_jacobian: np.ndarray
) -> list[Hypothesis]:
    """Fits of which those near the least score, at most `most_leaders`, are gone on with to the end."""
    settings, ordered = problem.settings.search, sorted(fitted, key=score)
    near = [h for h in ordered if score(h) < least + settings.near_leader][: settings.most_leaders]
    done = polish(problem, near, nuisance_jacobian, settings.polish_looks)
    return [*done, *(h for h in ordered if h not in near)]


def choose(proposals: Sequence[Proposal], at: Hypothesis, most: int) -> list[Proposal]:
    """The sets to be fitted, `most` or a few more.

    The cheapest of each size; those with one effect more than the hypothesis has, for it may lack just that; those with
    a near relative of one of its effects in its place, for what acts alike is told apart by a fit only; then the
    cheapest of all.
    """
    kept: dict[Proposal, None] = {}
    for size in sorted({len(p.candidates) for p in proposals}):
        own = [p for p in proposals if len(p.candidates) == size]
        kept |= dict.fromkeys(own[: most // 4 if size else 1])
    more = [p for p in proposals if p.labels > at.labels and len(p.labels) == len(at.labels) + 1]
    relatives = [p for p in proposals if _swaps_relative(p, at)]
    kept |= dict.fromkeys([*more[: most // 2], *relatives[: most // 4]])
    rest = [p for p in proposals if p not in kept]
    return [*kept, *rest[: max(0, most - len(kept))]]


def _swaps_relative(p: Proposal, at: Hypothesis) -> bool:
    gone = [c for c in at.candidates if c not in p.candidates]
    new = [c for c in p.candidates if c not in at.candidates]
    return len(gone) == len(new) == 1 and gone[0].group == new[0].group


def idle_effects(h: Hypothesis, negligible: float) -> list[EffectCandidate]:
    """Effects of a hypothesis that have come to nothing."""
    point = h.fit.point
    return [c for c in h.candidates if any(abs(point[x.name]) < negligible for x in c.parameters if not x.shape)]


def score(h: Hypothesis) -> float:
    """What hypotheses are compared by until they are judged: the fit, its parameters, a price for every effect and for
    every form that is not the plain one."""
    forms = sum(c.form is not None for c in h.candidates)
    return h.penalised_deviance + SearchSettings.price * len(h.candidates) + SearchSettings.form_price * forms


def best_of_each_set(hypotheses: Iterable[Hypothesis]) -> list[Hypothesis]:
    """Of every set of effects the best fit, the best first; what a first look claims counts only where nothing else is
    known of a set, for it rests on the long step's error at another point."""
    best: dict[frozenset[str], Hypothesis] = {}
    for h in sorted(hypotheses, key=lambda h: (h.quick, h.penalised_deviance)):
        best.setdefault(h.parts, h)
    return sorted(best.values(), key=score)


def next_start(
    found: Sequence[Hypothesis], banked: Sequence[frozenset[str]], better: bool, elsewhere: Hypothesis | None
) -> Hypothesis | None:
    """Where the next bank is made: once at the best set if that is better than what was known before, then elsewhere,
    then at the best set or part of it at which there has been none.

    Base parameters that were fitted without the right effects are bent, and around them these may not show; around the
    model as delivered they do. Nor may the right effect beside a wrong one: at the set without that, it does.
    """
    best = found[0]
    new = best.parts not in banked
    if elsewhere is not None and not (new and better and len(banked) < 2):
        return elsewhere
    if new:
        return best
    parts = (h for h in found if h.candidates and h.parts < best.parts and h.parts not in banked)
    return next(parts, None)


def without_needless(problem: Problem, found: Sequence[Hypothesis]) -> list[Hypothesis]:
    """Without sets to which a part of them leaves nothing to add; single effects stay beside a baseline that leaves
    nothing, to show that none does better."""
    enough = [h for h in found if is_adequate(problem, h.fit)]
    return [
        h for h in found if not any(g.parts < h.parts and (g.candidates or len(h.candidates) > 1) for g in enough)
    ]  # fmt: skip


def fit_leaders(problem: Problem, found: Sequence[Hypothesis], nuisance_jacobian: np.ndarray) -> list[Hypothesis]:
    """With those near the best fitted to the end, too, and those to which others have nothing to add: these are judged
    in the others' place, however much the others score within the noise."""
    settings = problem.settings.search
    near = [h for h in found if score(h) < score(found[0]) + settings.near_leader][: settings.most_leaders]
    enough = [h for h in without_needless(problem, found) if h.candidates and is_adequate(problem, h.fit)]
    wanted = {h.parts: h for h in (*near, *enough[: settings.most_leaders])}
    quick = [h for h in wanted.values() if h.quick]
    return best_of_each_set([*found, *polish(problem, quick, nuisance_jacobian, settings.polish_looks)])


def drop_each(problem: Problem, found: Sequence[Hypothesis], nuisance_jacobian: np.ndarray) -> list[Hypothesis]:
    """With the best one fitted without each of its effects, from where it stands.

    An effect must not win because the fit without it has stopped on its way. A set may so give way to a smaller one,
    and that to another.
    """
    made, tried = list(found), set()
    for _ in range(problem.settings.search.most_effects):
        best = made[0]
        wanted = [c for c in best.candidates if best.parts - c.parts not in tried]
        if problem.stop_requested:
            break
        tried |= {best.parts - c.parts for c in wanted}
        made += [h for h in without(problem, [(best, c) for c in wanted], nuisance_jacobian) if h is not None]
        made = best_of_each_set(made)
        if made[0] is best:
            break
    return made
