"""From a campaign to judged hypotheses: numerical gap, refit, screening, single effects, pairs."""

from __future__ import annotations

import time
from dataclasses import dataclass, field, replace

import numpy as np

from ..core.errors import SimulationError
from . import search
from .campaign import Campaign, CampaignError
from .catalogue import Catalogue
from .fit import DIFFERENCE, FINE_DIFFERENCE, Fit, drive, nuisances, recorrect, settle
from .judge import Judged, judge
from .noise import rms
from .pool import Pool, Say
from .problem import COARSE_ERROR, FACTORS, Problem, check_units, pose
from .search import SETTLED, Hypothesis, Secant
from .unexplained import Structure, structure

NEARLY = 1.5
"""How much more than the best a hypothesis without one of its effects may leave to be fitted once more from there."""

ROUNDS, STAYED, GAINED = 5, 0.1, 0.005
"""Rounds in which a fit is finished at most; it is when its model moves less than this, in floors, or when its residual
has become smaller by less than this share."""

FINALISTS = 4
"""Hypotheses whose fits are finished with runs at the package's step."""

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

    def after(self, fit: Fit, channels: int) -> np.ndarray:
        """Whitened residual at a fit's point, with its sensor biases and a clock of each run's own."""
        model = self.problem.exact([fit.point])[0]
        if model is None:
            raise SimulationError("the held-out runs cannot be simulated at the point found")
        N = nuisances(self.problem, model)
        model = model + N[:, :channels] @ fit.q[:channels]
        return settle(self.problem, model, N[:, channels:], fit.phi)[1]


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
            self._after[label] = self.held.after(judged.hypothesis.fit, len(self.problem.obs.span))
        return self._after[label]

    def gap(self, judged: Judged) -> float:
        """Held-out gap of a hypothesis, in floors."""
        return rms(self.after(judged))


def study(campaign: Campaign, catalogue: Catalogue, pool: Pool, say: Say = lambda text: None) -> Study:
    """Run the whole diagnosis."""
    begin = time.perf_counter()
    stages: dict[str, float] = {}
    kept = tuple(r for r in campaign.runs if r.use == "holdout")
    if len(kept) == len(campaign.runs):
        raise CampaignError("every run has use = 'holdout'; there is nothing to fit")
    learn = replace(campaign, runs=tuple(r for r in campaign.runs if r.use != "holdout"))

    def stage(text: str) -> None:
        stages[text] = time.perf_counter() - begin
        say(text)

    stage("reading the model")
    problem = pose(learn, catalogue, pool)
    stage("numerical gap: the model at its step and at half of it")
    delivered, numerical = _numerical_gap(problem)
    check_units(problem, delivered)
    problem.obs.widen(delivered, numerical)
    held = _hold(replace(campaign, runs=kept, warnings=[]), catalogue, pool) if kept else None
    _choose_step(problem, delivered)
    stage("refitting the base parameters")
    N = nuisances(problem, delivered)
    start = problem.anchor({})
    null, as_delivered = search.null(problem, start, N)
    null = _finish(problem, null, N, ROUNDS if null.fit.rms < search.MUCH else 1)
    stage("screening the effects")
    found = search.screen(problem, null.fit, N)
    hypotheses = [null]
    stage("fitting single effects")
    if null.fit.rms < SETTLED:  # nothing is left to explain: only to show that no effect does better
        singles = search.extend(problem, null, found, N, search.SINGLES // 2, 1)
    else:
        others = search.other_starts(problem, null.fit, as_delivered, N)
        singles = search.extend(problem, null, found, N, search.SINGLES, search.KEPT, others)
    if singles and singles[0].fit.rms > SETTLED:  # what is left may be the long steps' error, away from the anchor
        singles[0] = _finish(problem, singles[0], N)
    hypotheses += singles
    if singles and singles[0].fit.rms > SETTLED:
        stage("fitting pairs of effects")
        hypotheses += _pairs(problem, singles, found, N)
    stage("finishing the best")
    judged = judge(problem, hypotheses, N)
    for place, j in enumerate(judged[:FINALISTS]):
        if j.hypothesis.candidates and j.score < judged[0].score + NEAR:
            j.hypothesis = _finish(problem, j.hypothesis, N, 2 if place else ROUNDS)
    hypotheses = [j.hypothesis for j in judged]
    best = judge(problem, hypotheses, N)[0].hypothesis
    judged = judge(problem, _backward(problem, hypotheses, best, N), N)
    stage("looking at what is left")
    rows = problem.rows([judged[0].hypothesis.fit.point], problem.coarse)[0]
    assert rows is not None
    left = structure(problem, judged[0].held_out, rows, problem.coarse)
    return Study(problem, held, delivered, numerical, N, null, judged, found, left, stages)


def _hold(campaign: Campaign, catalogue: Catalogue, pool: Pool) -> Held:
    problem = pose(campaign, catalogue, pool)
    delivered, numerical = _numerical_gap(problem)
    problem.obs.widen(delivered, numerical)
    return Held(problem, delivered)


def _numerical_gap(problem: Problem) -> tuple[np.ndarray, np.ndarray]:
    """The model as delivered, and how far halving its step moves each entry."""
    at_step = problem.exact([{}])[0]
    if at_step is None:
        raise SimulationError(f"{problem.campaign.system.name}: the model as delivered does not run the campaign")
    half = problem.exact([{}], problem.fine / 2.0)[0]
    if half is None:
        raise SimulationError(f"{problem.campaign.system.name}: the model does not run at half its step")
    return at_step, at_step - half


def _choose_step(problem: Problem, delivered: np.ndarray) -> None:
    """The longest macro step whose runs are near enough to be corrected."""
    for factor in FACTORS:
        problem.factor, problem.correction = factor, None
        if factor == 1:
            return
        y = problem.evaluate([{}])[0]
        if y is not None and rms((y - delivered) / problem.obs.floor) < COARSE_ERROR:
            return


def _finish(problem: Problem, h: Hypothesis, N: np.ndarray, rounds: int = ROUNDS) -> Hypothesis:
    """The hypothesis fitted with runs that are exact at its point and derivatives found there.

    Intervals and refits without a fold rest on these derivatives, so rounds go on until the fit stays where it is.
    """
    if h.finished:
        return h
    for k in range(rounds):
        try:
            exact = problem.anchor(h.fit.point)
        except SimulationError:
            return h
        start = recorrect(h.fit, problem, exact, N)
        ask = search.carry_on(problem, start, N, 10, fresh=k < 2, difference=FINE_DIFFERENCE if k else DIFFERENCE)
        found = drive(problem, [ask])[0]
        if found is None:
            return Hypothesis(h.candidates, start)
        h = Hypothesis(h.candidates, found, finished=True)
        if rms((found.model - exact) / problem.obs.floor) < STAYED or found.rms > (1.0 - GAINED) * start.rms:
            break
    if k:  # a derivative that has to serve for larger moves
        found = drive(problem, [search.carry_on(problem, h.fit, N, 0, fresh=True)])[0]
    return Hypothesis(h.candidates, found, finished=True) if found is not None else h


def _backward(problem: Problem, hypotheses: list[Hypothesis], best: Hypothesis, N: np.ndarray) -> list[Hypothesis]:
    """The hypotheses, those that lack one of the best one's effects refitted from where it stands if that is better.

    An effect must not win because the fit without it has stopped on its way.
    """
    made = {h.candidates: h for h in hypotheses}
    for gone in best.candidates:
        left = tuple(c for c in best.candidates if c is not gone)
        known = made.get(left)
        if known is None or known.fit.rms > NEARLY * best.fit.rms:
            continue
        start = search.without(problem, best, gone)
        if start is None:
            continue
        found = drive(problem, [search.carry_on(problem, start, N, 10, fresh=True, refreshes=1)])[0]
        if found is not None:
            made[left] = min(known, _finish(problem, Hypothesis(left, found), N), key=lambda h: h.merit)
    return list(made.values())


def _pairs(problem: Problem, singles: list[Hypothesis], found: list[Secant], N: np.ndarray) -> list[Hypothesis]:
    made: dict[tuple[str, ...], Hypothesis] = {}
    for h in singles[: search.PAIRS_FROM]:
        if any(pair.fit.rms < SETTLED for pair in made.values()):
            break
        again = [replace(s, at=h.fit) for s in found]
        search.weigh(problem, h.fit, N, again)
        again = sorted((s for s in again if s.saving > search.WORTH), key=lambda s: -s.saving)
        for pair in search.extend(problem, h, again, N, search.PAIRS, 2):
            key = tuple(sorted(c.label for c in pair.candidates))
            if key not in made or pair.merit < made[key].merit:
                made[key] = pair
    return list(made.values())
