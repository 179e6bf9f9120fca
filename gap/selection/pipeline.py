"""From a campaign to judged hypotheses: numerical gap, refit, screening, single effects, pairs."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from ...core.errors import SimulationError
from ...master.pool import Pool
from ..analysis.residual_structure import Structure, structure
from ..campaign.catalogue import Catalogue
from ..campaign.read import Campaign, CampaignError
from ..checks import campaign_sanity as plausible
from ..estimation.gauss_newton import Fit, bias, fit, lead, nuisances, penalty, point_of, settle, went
from ..problem import step_size as steps
from ..problem.noise import rms
from ..problem.problem import Candidate, Problem, pose
from . import greedy as search
from . import greedy_large as large
from .evidence import Judged, judge
from .greedy import Hypothesis, Secant, settled

REFIT = 12
"""Steps of the refit of the base parameters."""

ROOM = 2.0
"""How far, in its range, a base parameter may go on the way of that refit."""

LEAST = -0.9
"""Change of a base parameter, as a share of it, beyond which it goes only within its own range: none changes sign."""

ALONE, STARTS = (-1.0, -0.75, -0.5, -0.25, 0.25, 0.5, 0.75, 1.0), 2
"""Shares of its range at which a base parameter is tried alone, and fits that start there."""

FINALISTS = 3
"""Hypotheses whose fits are carried to the end, beside those that have plainly stopped on their way."""

PROMISING = 0.6
"""RMS of the best pair, as a share of the best single effect's, below which one of its two effects may be right."""

ALIKE, SCREENED = 2, 6
"""Effects of the same group, and of others, that are tried in place of one of the best hypothesis'; and of the others
those that are screened for it."""

NEAR = 20.0
"""How far behind the best a hypothesis may be to be finished, in score."""


@dataclass
class Held:
    """Runs that the campaign holds out: posed apart, simulated only with what the others have taught."""

    problem: Problem
    delivered: np.ndarray

    @property
    def before(self) -> np.ndarray:
        """Whitened residual of the model as delivered."""
        return self.problem.obs.whiten(self.delivered)

    def after(self, fit: Fit, learned: Problem) -> np.ndarray:
        """Whitened residual at a fit's point, with its sensor biases and a clock of each run's own."""
        model = self.problem.exact([fit.point])[0]
        if model is None:
            raise SimulationError(f"the held-out runs cannot be simulated at the point found: {self.problem.failure}")
        channels = len(self.problem.obs.span)
        clocks = nuisances(self.problem, model)[:, channels:]
        biases = {label: q * bias(learned, j) for j, (label, q) in enumerate(zip(learned.labels, fit.q, strict=False))}
        offsets = np.array([biases.get(label, 0.0) for label in self.problem.labels[:channels]])
        return settle(self.problem, model + offsets[self.problem.obs.channel], clocks, fit.phi)[1]


@dataclass
class Study:
    """Everything that was found out about which effects could be the cause."""

    problem: Problem
    held: Held | None
    delivered: np.ndarray
    numerical: np.ndarray
    nuisance: np.ndarray
    null: Hypothesis
    judged: list[Judged]
    screened: list[Secant]
    structure: Structure
    stages: dict[str, float] = field(default_factory=dict)
    _after: dict[str, np.ndarray] = field(default_factory=dict)

    @property
    def null_judged(self) -> Judged:
        """The refit of the base parameters."""
        return next(j for j in self.judged if not j.hypothesis.candidates)

    @property
    def scoring(self) -> Problem:
        """The problem on whose data gaps are stated: the held-out runs, or all data with folds left out in turn."""
        return self.held.problem if self.held else self.problem

    @property
    def held_out_how(self) -> str:
        """What held-out means here."""
        if self.held:
            return "runs that the campaign holds out"
        return "stretches of time predicted from the rest"

    @property
    def before(self) -> np.ndarray:
        """Whitened residual of the model as delivered, on the scoring data."""
        if self.held:
            return self.held.before
        return self.problem.obs.whiten(self.delivered)

    def after(self, judged: Judged) -> np.ndarray:
        """Whitened residual of a hypothesis on the scoring data."""
        if not self.held:
            return judged.held_out
        label = judged.hypothesis.label
        if label not in self._after:
            self._after[label] = self.held.after(judged.hypothesis.fit, self.problem)
        return self._after[label]

    def gap(self, judged: Judged) -> float:
        """Held-out gap of a hypothesis, in floors."""
        return rms(self.after(judged))


def study(
    campaign: Campaign, catalogue: Catalogue, pool: Pool, say: Callable[[str], None] = lambda text: None,
    hurry: Callable[[], bool] = lambda: False,
) -> Study:  # fmt: skip
    """Run the whole diagnosis; as soon as `hurry` says so, judge what has been found."""
    begin = time.perf_counter()
    stages: dict[str, float] = {}
    kept = tuple(r for r in campaign.runs if r.use == "holdout")
    if len(kept) == len(campaign.runs):
        told = "every run has use = 'holdout', so there is nothing to fit; take that out of one run at least"
        raise CampaignError(f"{campaign.file}: {told}")
    learn = replace(campaign, runs=tuple(r for r in campaign.runs if r.use != "holdout"))

    cut = ""

    def stage(text: str) -> None:
        stages[text] = time.perf_counter() - begin
        say(text)

    def late() -> bool:
        nonlocal cut
        if not cut and hurry():
            cut = list(stages)[-1]
        return bool(cut)

    stage("reading the model")
    problem = pose(learn, catalogue, pool)
    problem.hurry, package_step = late, problem.fine
    stage("numerical gap: the model at its step and at half of it")
    delivered, numerical = steps.numerical_gap(problem)
    plausible.check(problem, delivered)
    chosen_step = problem.fine
    steps.lengthen(problem, delivered, package_step)
    held = _hold(problem, replace(campaign, runs=kept, warnings=[])) if kept else None
    stage("refitting the base parameters")
    N = nuisances(problem, delivered)
    steps.choose_difference(problem)
    null = _refit(problem, N)
    stage("screening the effects")
    found = search.screen(problem, null.fit, N)
    stage("fitting single effects")
    if settled(problem, null.fit):  # only to show that no effect does better
        singles = search.extend(problem, null, found, N, search.SINGLES // 2, 1)
    else:
        others = search.other_starts(problem, null.fit, N)
        singles = search.extend(problem, null, found, N, search.SINGLES, search.KEPT, others)
    if not late() and singles and not settled(problem, singles[0].fit) and null.fit.rms > search.MUCH:
        stage("looking for large effects")
        null, found, singles = _large(problem, null, found, singles, N)
    hypotheses = [null, *singles]
    steps.resolve(problem, hypotheses, N)
    singles.sort(key=lambda h: h.merit)
    if not late() and singles and not settled(problem, singles[0].fit):
        stage("fitting pairs of effects")
        pairs = _pairs(problem, null, singles, found, N)
        hypotheses += [*pairs, *_swapped(problem, singles, pairs, N)]
        steps.resolve(problem, hypotheses, N)
    if problem.fine < chosen_step:
        told = "the gap's model depends on its macro step more than the delivered one: fits rest on steps of"
        problem.warnings.append(f"{told} {1e3 * problem.fine:g} ms, the package's is {1e3 * package_step:g} ms")
    if held:
        held.problem.fine, held.problem.order = problem.fine, problem.order
    late()  # what is cut short is the stage before
    stage("finishing the best")
    search.finish(problem, null, N)
    judged = judge(problem, hypotheses, N)
    for place, j in enumerate(judged):
        wanted = place < FINALISTS or _stopped(j, judged)
        if place == 0 or (wanted and j.score < judged[0].score + NEAR and not late()):
            search.finish(problem, j.hypothesis, N)
    judged = judge(problem, hypotheses, N, judged)
    if not late():
        stage("trying what is alike")
        judged = _alike(problem, judged, found, N)
    if not late():
        stage("trying the best without its effects")
        judged = _backward(problem, judged, N)
    if late():
        problem.warnings.append(f"ended before everything was tried, while {cut}: probabilities are too sure")
    stage("looking at what is left")
    rows = problem.rows([judged[0].hypothesis.fit.point], problem.coarse)[0]
    assert rows is not None
    left = structure(problem, judged[0].held_out, rows, problem.coarse)
    return Study(problem, held, delivered, numerical, N, null, judged, found, left, stages)


def _refit(problem: Problem, N: np.ndarray) -> Hypothesis:
    """The null: the base parameters fitted from what is stated, on a way that may leave their tolerance in between.

    Where that stops away from the data, each parameter alone is tried over its range, and fits start at what is nearer:
    a machine that begins to swing stands like a wall between two points.
    """
    start = np.zeros(len(problem.base))
    roomy = tuple(
        replace(x, low=max(ROOM * x.low, min(x.low, LEAST / x.scale)), high=ROOM * x.high) for x in problem.base
    )
    far = went(problem, lead(problem, roomy, start, N, REFIT)).u
    within = np.clip(far, [x.low for x in problem.base], [x.high for x in problem.base])
    null = Hypothesis((), went(problem, fit(problem, problem.base, within, N, REFIT)))
    if settled(problem, null.fit) or problem.hurry():
        return null
    for u in _nearer(problem, null, N):
        other = Hypothesis((), went(problem, fit(problem, problem.base, u, N, REFIT)))
        null = min(null, other, key=lambda h: h.merit)
        if settled(problem, null.fit) or problem.hurry():
            break
    return null


def _nearer(problem: Problem, null: Hypothesis, N: np.ndarray) -> list[np.ndarray]:
    """Points that differ from what is stated in one parameter only, nearer to the data than a fit; the best first."""
    points = [
        np.where(np.arange(len(problem.base)) == k, size, 0.0)
        for k, x in enumerate(problem.base)
        for share in ALONE
        if (size := share * (x.high if share > 0 else -x.low))
    ]
    models = problem.evaluate([point_of(problem.base, u) for u in points])
    made = []
    for u, model in zip(points, models, strict=True):
        if model is not None:
            q, residual = settle(problem, model, N, 1.0)
            made.append((search.merit(rms(residual), penalty(problem.base, u, q[: null.fit.channels])), u))
    made.sort(key=lambda entry: entry[0])
    return [u for merit, u in made if merit < null.merit][:STARTS]


def _hold(learned: Problem, campaign: Campaign) -> Held:
    """The campaign's held-out runs, simulated as those that are learned from."""
    problem = pose(campaign, learned.catalogue, learned.pool)
    problem.base, problem.candidates = learned.base, learned.candidates
    delivered = steps.as_chosen(problem, learned)
    plausible.check(problem, delivered)
    return Held(problem, delivered)


def _large(
    problem: Problem, null: Hypothesis, found: list[Secant], singles: list[Hypothesis], N: np.ndarray
) -> tuple[Hypothesis, list[Secant], list[Hypothesis]]:
    """Null, screening and single effects, with fits from the model as delivered where these promise more.

    They may need shorter macro steps; null and screening are then made anew, and the former fits stay as they are.
    """
    before, best = problem.factor, min(h.merit for h in singles)
    most = best + large.NEARLY * max(null.merit - best, 0.0)  # a start is not yet fitted
    starts = [s for s in large.scan(problem, N) if s.merit < most][: large.BEGUN]
    problem.factor = before
    if not starts:
        return null, found, singles
    steps.shorten(problem, [s.point for s in starts], null.fit.rms)
    if problem.factor != before:
        null = Hypothesis((), went(problem, fit(problem, problem.base, null.fit.u, N, REFIT)))
        found = search.screen(problem, null.fit, N)
        for h in singles:
            steps.lay_aside(h)
    return null, found, search.best_of_each([*large.fits(problem, starts, N), *singles], lambda h: h.merit)


def _stopped(j: Judged, judged: list[Judged]) -> bool:
    """Whether a fit leaves more than one without some of its effects: it has not arrived."""
    mine = set(j.hypothesis.candidates)
    return any(set(k.hypothesis.candidates) < mine and k.shared < j.shared for k in judged)


def _alike(problem: Problem, judged: list[Judged], found: list[Secant], N: np.ndarray) -> list[Judged]:
    """The hypotheses, and those with another effect in place of one of the best one's: one that acts in nearly the same
    way, which it may have hidden, or one that screening passed over beside what is now gone."""
    made = [j.hypothesis for j in judged]
    tried = {frozenset(c.label for c in h.candidates) for h in made}
    best = judged[0].hypothesis
    for gone in best.candidates:
        kept = {c.label for c in best.candidates if c is not gone}
        new = [s.candidate for s in found if kept | {s.candidate.label} not in tried]
        others = [c for c in new if c.group == gone.group]
        if kept:
            others += [c for c in new if c.group != gone.group][:SCREENED]
        if not others or problem.hurry():
            continue
        left = search.without(problem, best, gone, N, search.QUICK)
        if left is None:
            continue
        again = [s for s in search.screen(problem, left.fit, N, others) if s.saving > search.WORTH]
        alike = [s for s in again if s.candidate.group == gone.group][:ALIKE]
        chosen = alike + [s for s in again if s.candidate.group != gone.group][:ALIKE]
        for h in search.extend(problem, left, chosen, N, len(chosen), 1)[:1]:
            search.finish(problem, h, N)
            made.append(h)
    return judge(problem, made, N, judged)


def _backward(problem: Problem, judged: list[Judged], N: np.ndarray) -> list[Judged]:
    """The hypotheses, those that lack one of the best one's effects refitted from where it stands if that is better.

    An effect must not win because the fit without it has stopped on its way, however far away. A pair may so give way
    to one effect, and that to none.
    """
    made = {j.hypothesis.candidates: j.hypothesis for j in judged}
    tried: set[tuple[Candidate, ...]] = set()
    for _ in range(2):
        best = judged[0].hypothesis
        for gone in best.candidates:
            left = tuple(c for c in best.candidates if c is not gone)
            if left in tried:
                continue
            tried.add(left)
            found = search.without(problem, best, gone, N, search.QUICK)
            if found is not None and (left not in made or found.merit < made[left].merit):
                search.finish(problem, found, N)
                made[left] = found
        judged = judge(problem, list(made.values()), N, judged)
    return judged


def _swapped(problem: Problem, singles: list[Hypothesis], pairs: list[Hypothesis], N: np.ndarray) -> list[Hypothesis]:
    """Pairs with one effect of the best pair and another than its second, where that explains much but not enough.

    What the refit of the base parameters had hidden shows beside the effect that is right.
    """
    best = min(pairs, key=lambda h: h.merit, default=None)
    if best is None or settled(problem, best.fit) or problem.hurry():
        return []
    if best.fit.rms > PROMISING * min(h.fit.rms for h in singles):
        return []
    tried = {frozenset(c.label for c in h.candidates) for h in pairs}
    made: list[Hypothesis] = []
    for gone in best.candidates:
        left = search.without(problem, best, gone, N, search.QUICK)
        if left is None:
            continue
        kept = {c.label for c in left.candidates}
        found = [s for s in search.screen(problem, left.fit, N) if kept | {s.candidate.label} not in tried]
        made += search.extend(problem, left, found, N, search.PAIRS, search.PAIRS)
        if any(settled(problem, h.fit) for h in made) or problem.hurry():
            break
    return made


def _pairs(
    problem: Problem, null: Hypothesis, singles: list[Hypothesis], found: list[Secant], N: np.ndarray
) -> list[Hypothesis]:
    """The best single effects, each with a second one.

    Which one is seen from the screening; where that was done far from the data, it is done anew beside each effect.
    """
    made: dict[tuple[str, ...], Hypothesis] = {}
    for h in [h for h in singles if not h.finished][: search.PAIRS_FROM]:
        if any(settled(problem, pair.fit) for pair in made.values()) or problem.hurry():
            break
        again = [replace(s, at=h.fit) for s in found]
        search.weigh(problem, h.fit, N, again)
        again = sorted(again, key=lambda s: -s.saving)
        if null.fit.rms > search.MUCH:
            again = search.screen(problem, h.fit, N, [s.candidate for s in again[: search.SCREENED_ANEW]])
        again = [s for s in again if s.saving > search.WORTH]
        for pair in search.extend(problem, h, again, N, search.PAIRS, 1):
            key = tuple(sorted(c.label for c in pair.candidates))
            if key not in made or pair.merit < made[key].merit:
                made[key] = pair
    return list(made.values())
