"""Where fits of sets of effects begin: at the bank's proposals, beside another fit, or at a point as it is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ..estimation.fit import Fit
from ..problem.parameters import EffectCandidate, Point
from ..problem.problem import Problem
from ..selection.hypothesis import Hypothesis
from .quasi_newton import QuickFit, as_hypothesis, begin_fit, differentiate, iterate
from .response_bank import ResponseBank, evaluate_in_batches, response_rows, wide_step
from .sets import Proposal


class FitStart(NamedTuple):
    """A set of effects at a point, the correction of the long step there (n,), and a fit near it whose derivatives may
    serve there."""

    candidates: tuple[EffectCandidate, ...]
    point: Point
    correction: np.ndarray
    near: Fit | None = None


def fit_proposals(
    problem: Problem, bank: ResponseBank, proposals: Sequence[Proposal], nuisance_jacobian: np.ndarray, steps: int
) -> list[Hypothesis]:
    """A fit of every proposal whose model runs, in their order."""
    quick_fits = _start_proposals(problem, bank, proposals, nuisance_jacobian)
    iterate(problem, quick_fits, bank.rows, nuisance_jacobian, steps)
    return [as_hypothesis(problem, f, quick=True) for f in quick_fits]


def fit_disappointing(
    problem: Problem, bank: ResponseBank, proposals: Sequence[Proposal], fits: Sequence[Hypothesis],
    nuisance_jacobian: np.ndarray,
) -> list[Hypothesis]:  # fmt: skip
    """Fits anew of sets that would be the best by far if their fits had come near what the bank foretold: with
    derivatives of their own, from the best place between the sizes that were run and the proposal. Friction that stops
    a joint, or a valve that holds the load, changes what every base parameter does."""
    settings, left = problem.settings.search, {h.candidates: h.fit.rms for h in fits}
    least = min(left.values(), default=np.inf)
    broken = [
        p for p in proposals
        if p.candidates and p.left < settings.promise * least
        and left.get(p.candidates, np.inf) > settings.broken_promise * p.left
    ]  # fmt: skip
    broken = _by_turns(sorted(broken, key=lambda p: p.cost))[: settings.fits_anew]
    mixed = [FitStart(p.candidates, q, bank.correction) for p in broken for q in _between(p.as_run, p.point)]
    best: dict[tuple[EffectCandidate, ...], Hypothesis] = {}
    for h in (h for h in hypotheses_at(problem, mixed, nuisance_jacobian) if h is not None):
        if h.candidates not in best or h.penalised_deviance < best[h.candidates].penalised_deviance:
            best[h.candidates] = h
    starts = [FitStart(h.candidates, h.fit.point, bank.correction) for h in best.values()]
    return [h for h in fit_from(problem, starts, nuisance_jacobian) if h is not None]


def _by_turns(proposals: Sequence[Proposal]) -> list[Proposal]:
    """The first of each size, then the second, and so on."""
    places: dict[int, int] = {}
    turns = []
    for p in proposals:
        turns.append(places.setdefault(len(p.candidates), 0))
        places[len(p.candidates)] += 1
    return [p for _, p in sorted(zip(turns, proposals, strict=True), key=lambda pair: pair[0])]


def _between(a: Point, b: Point) -> list[Point]:
    """A point, one half way to another one, and that."""
    return [a, {name: 0.5 * (a.get(name, 0.0) + u) for name, u in b.items()}, b]


def fit_from(
    problem: Problem, starts: Sequence[FitStart], nuisance_jacobian: np.ndarray
) -> list[Hypothesis | None]:
    """Quick fits from these places, side by side; None where the model does not run."""
    settings, quick_fits = problem.settings.search, dict[int, QuickFit]()
    for k, coarse in enumerate(evaluate_in_batches(problem, [start.point for start in starts])):
        if coarse is not None:
            quick_fits[k] = start_at(problem, starts[k], coarse, nuisance_jacobian)
    differentiate(problem, list(quick_fits.values()), settings.derivative_step)
    iterate(problem, list(quick_fits.values()), response_rows(problem), nuisance_jacobian, settings.quick_fit_steps)
    fits = {k: as_hypothesis(problem, f, quick=True) for k, f in quick_fits.items()}
    return [fits.get(k) for k in range(len(starts))]


def hypotheses_at(
    problem: Problem, starts: Sequence[FitStart], nuisance_jacobian: np.ndarray
) -> list[Hypothesis | None]:
    """Hypotheses as they stand at these places, without derivatives yet; None where the model does not run."""
    hypotheses: list[Hypothesis | None] = []
    for start, coarse in zip(starts, evaluate_in_batches(problem, [start.point for start in starts]), strict=True):
        quick_fit = None if coarse is None else start_at(problem, start, coarse, nuisance_jacobian)
        hypotheses.append(None if quick_fit is None else as_hypothesis(problem, quick_fit, quick=True))
    return hypotheses


def exact_hypotheses_at(
    problem: Problem, sets: Sequence[tuple[tuple[EffectCandidate, ...], Point]], nuisance_jacobian: np.ndarray
) -> list[Hypothesis]:
    """Sets of effects as they stand at points, each corrected by its own exact run; those that run."""
    points, hypotheses = [point for _, point in sets], []
    for (candidates, point), coarse, exact in zip(sets, *problem.evaluate_both(points, points), strict=True):
        if coarse is not None and exact is not None:
            quick_fit = start_at(problem, FitStart(candidates, point, exact - coarse), coarse, nuisance_jacobian)
            hypotheses.append(as_hypothesis(problem, quick_fit, quick=True))
    return hypotheses


def corrected_for_step(
    problem: Problem, hypotheses: Sequence[Hypothesis], corrected: Sequence[Hypothesis]
) -> list[Hypothesis]:
    """Hypotheses whose fits took runs of different steps, each with the correction of a run of the problem's fit step;
    corrected: those that have it. One that does not run with this step keeps its own."""
    others = [h for h in hypotheses if not any(h is x for x in corrected)]
    renewed = {}
    for h, coarse in zip(others, evaluate_in_batches(problem, [h.fit.point for h in others]), strict=True):
        if coarse is not None:
            renewed[id(h)] = replace(h, fit=replace(h.fit, correction=h.fit.model - coarse))
    return [renewed.get(id(h), h) for h in hypotheses]


def start_at(problem: Problem, start: FitStart, coarse: np.ndarray, nuisance_jacobian: np.ndarray) -> QuickFit:
    """A fit that begins at a place, derivatives that are not known 0; coarse: the prediction there (n,) at the fit's
    step."""
    parameters = (*problem.base, *(x for c in start.candidates for x in c.parameters))
    u = np.array([start.point.get(x.name, 0.0) for x in parameters])
    model, jacobian = coarse + start.correction, np.zeros((len(coarse), len(parameters)))
    if start.near is not None:
        nearby_columns = {x.name: k for k, x in enumerate(start.near.parameters)}
        for k, x in enumerate(parameters):
            if x.name in nearby_columns:
                jacobian[:, k] = start.near.jacobian[:, nearby_columns[x.name]]
    return begin_fit(
        problem, start.candidates, parameters, u, model, start.correction, jacobian, nuisance_jacobian
    )


def _start_proposals(
    problem: Problem, bank: ResponseBank, proposals: Sequence[Proposal], nuisance_jacobian: np.ndarray
) -> list[QuickFit]:
    """Fits that begin where the bank expects them: derivatives by base parameters are the bank's, those by an effect's
    own parameters one simulation each."""
    settings, points, owners = problem.settings.search, [], []
    quick_fits: list[QuickFit] = []
    models = problem.evaluate([p.point for p in proposals])
    bank_columns = {x.name: k for k, x in enumerate(bank.parameters)}
    for p, coarse in zip(proposals, models, strict=True):
        if coarse is None:
            continue
        quick_fit = start_at(problem, FitStart(p.candidates, p.point, bank.correction), coarse, nuisance_jacobian)
        for k, x in enumerate(quick_fit.parameters):
            if x.in_every_set or x.name in bank_columns:
                quick_fit.jacobian[:, k] = bank.jacobian[:, bank_columns[x.name]]
                if x.in_every_set:
                    continue
            h = wide_step(x, float(quick_fit.u[k]), settings)
            points.append({**p.point, x.name: float(quick_fit.u[k] + h)})
            owners.append((len(quick_fits), k, h))
        quick_fits.append(quick_fit)
    for (f, k, h), model in zip(owners, problem.evaluate(points), strict=True):
        if model is not None:
            quick_fits[f].jacobian[:, k] = (model + bank.correction - quick_fits[f].model) / h
    return quick_fits
