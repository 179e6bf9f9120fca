"""Fits of many sets side by side from where the bank expects them, with one simulation a step each.

Derivatives by base parameters are the bank's, those by the effects' own parameters one simulation each; every step
mends them by what it has found (Broyden 1965). So a set costs some ten simulations, and the leaders alone are fitted to
the end afterwards.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from ..estimation.dispersion import estimate_dispersion
from ..estimation.fit import Fit
from ..estimation.linear import LinearisedModel, profile_nuisances
from ..problem.noise import rms
from ..problem.parameters import EffectCandidate, EstimatedParameter, Point, penalty, point_of
from ..problem.problem import Problem
from ..selection.hypothesis import Hypothesis, penalised_deviance
from .bank import Bank, in_batches, rows_of, wide_step, with_effect
from .sets import Proposal


class Place(NamedTuple):
    """A set of effects at a point, the correction of the long step there (n,), and a fit near it whose derivatives may
    serve there."""

    candidates: tuple[EffectCandidate, ...]
    point: Point
    correction: np.ndarray
    near: Fit | None = None


@dataclass(eq=False)
class _Walk:
    """One set on its way: working state of `refine`."""

    candidates: tuple[EffectCandidate, ...]
    parameters: tuple[EstimatedParameter, ...]
    u: np.ndarray
    model: np.ndarray
    correction: np.ndarray
    jacobian: np.ndarray
    nuisances: np.ndarray
    residual: np.ndarray
    cost: float
    radius: float
    step: np.ndarray = field(default_factory=lambda: np.zeros(0))
    failures: int = 0
    settled: bool = False


def refine(
    problem: Problem, bank: Bank, proposals: Sequence[Proposal], nuisance_jacobian: np.ndarray, steps: int
) -> list[Hypothesis]:
    """A fit of every proposal whose model runs, in their order."""
    walks = _begin(problem, bank, proposals, nuisance_jacobian)
    _walk(problem, walks, bank.rows, nuisance_jacobian, steps)
    return [Hypothesis(w.candidates, _fit(problem, w), quick=True) for w in walks]


def polish(
    problem: Problem, hypotheses: Sequence[Hypothesis], nuisance_jacobian: np.ndarray, looks: int,
    derivatives_known: bool = False,
) -> list[Hypothesis]:  # fmt: skip
    """The hypotheses fitted on with exact runs where they stand and derivatives from small steps, side by side.

    A valve that saturates a millisecond later moves a pressure by hundreds of noise levels for that millisecond: near
    the data only the derivative at the point itself leads on; they are taken anew after a look that has gained much,
    and after others what its steps have found serves. Where they are known, the first look takes those that are not
    there yet only. A hypothesis that does not run stays as it is.
    """
    settings, made, going = problem.settings.search, list(hypotheses), list(range(len(hypotheses)))
    confirmed: dict[int, Hypothesis] = {}
    gained = dict.fromkeys(going, np.inf)
    for look in range(looks + 1):
        if not going or problem.stop_requested:
            break
        walks: dict[int, _Walk] = {}
        for k, exact in zip(going, problem.exact([made[k].fit.point for k in going]), strict=True):
            if exact is not None:
                walks[k] = _walk_from(problem, made[k], exact, nuisance_jacobian)
        if look:  # a step that the exact run does not bear out is taken back
            walks = {k: w for k, w in walks.items() if w.cost < confirmed[k].penalised_deviance}
            made = [confirmed[k] if k in going and k not in walks else h for k, h in enumerate(made)]
        if look < looks:
            wanted = [w for k, w in walks.items() if gained[k] > settings.much]
            _differentiate(problem, wanted, missing_only=derivatives_known and look == 0)
        confirmed = {k: Hypothesis(w.candidates, _fit(problem, w, converged=True)) for k, w in walks.items()}
        if look < looks:
            _walk(problem, list(walks.values()), rows_of(problem), nuisance_jacobian, settings.further)
        gained = {k: confirmed[k].penalised_deviance - w.cost for k, w in walks.items()}
        going = [k for k, gain in gained.items() if gain > settings.least_gain]
        for k, w in walks.items():
            made[k] = Hypothesis(w.candidates, _fit(problem, w)) if k in going else confirmed[k]
    return made


def without(
    problem: Problem, pairs: Sequence[tuple[Hypothesis, EffectCandidate]], nuisance_jacobian: np.ndarray
) -> list[Hypothesis | None]:
    """Hypotheses without one of their effects each, fitted side by side from where they stand, to the end where that
    may come near them; None where the model does not run."""
    settings, places = problem.settings.search, []
    for h, gone in pairs:
        candidates = tuple(c for c in h.candidates if c is not gone)
        places.append(Place(candidates, with_effect(h.fit.point, gone, {}), h.fit.correction, h.fit))
    made = fit_from(problem, places, nuisance_jacobian)
    for near, looks in ((True, settings.polish_looks), (False, 0)):
        chosen = [
            (k, h) for k, h in enumerate(made)
            if h is not None and (h.fit.rms < settings.far * pairs[k][0].fit.rms) is near
        ]  # fmt: skip
        done = polish(problem, [h for _, h in chosen], nuisance_jacobian, looks)
        for (k, _), h in zip(chosen, done, strict=True):
            made[k] = h
    return made


def fit_from(
    problem: Problem, places: Sequence[Place], nuisance_jacobian: np.ndarray
) -> list[Hypothesis | None]:
    """Quick fits from these places, side by side; None where the model does not run."""
    settings, walks = problem.settings.search, dict[int, _Walk]()
    for k, coarse in enumerate(in_batches(problem, [at.point for at in places])):
        if coarse is not None:
            walks[k] = _put(problem, places[k], coarse, nuisance_jacobian)
    _differentiate(problem, list(walks.values()), settings.derivative_step)
    _walk(problem, list(walks.values()), rows_of(problem), nuisance_jacobian, settings.steps)
    found = {k: Hypothesis(w.candidates, _fit(problem, w), quick=True) for k, w in walks.items()}
    return [found.get(k) for k in range(len(places))]


def stand_at(
    problem: Problem, places: Sequence[Place], nuisance_jacobian: np.ndarray
) -> list[Hypothesis | None]:
    """Hypotheses as they stand at these places, without derivatives yet; None where the model does not run."""
    made: list[Hypothesis | None] = []
    for at, coarse in zip(places, in_batches(problem, [at.point for at in places]), strict=True):
        walk = None if coarse is None else _put(problem, at, coarse, nuisance_jacobian)
        made.append(None if walk is None else Hypothesis(at.candidates, _fit(problem, walk), quick=True))
    return made


def stand_exactly(
    problem: Problem, wanted: Sequence[tuple[tuple[EffectCandidate, ...], Point]], nuisance_jacobian: np.ndarray
) -> list[Hypothesis]:
    """Sets of effects as they stand at points, each corrected by its own exact run; those that run."""
    points, made = [point for _, point in wanted], []
    for (candidates, point), coarse, exact in zip(wanted, *problem.evaluate_both(points, points), strict=True):
        if coarse is not None and exact is not None:
            walk = _put(problem, Place(candidates, point, exact - coarse), coarse, nuisance_jacobian)
            made.append(Hypothesis(candidates, _fit(problem, walk), quick=True))
    return made


def _put(problem: Problem, at: Place, coarse: np.ndarray, nuisance_jacobian: np.ndarray) -> _Walk:
    """A walk that begins at a place, derivatives that are not known 0; coarse: the long vector there (n,) at the fit's
    step."""
    parameters = (*problem.base, *(x for c in at.candidates for x in c.parameters))
    u = np.array([at.point.get(x.name, 0.0) for x in parameters])
    model, jacobian = coarse + at.correction, np.zeros((len(coarse), len(parameters)))
    if at.near is not None:
        known = {x.name: k for k, x in enumerate(at.near.parameters)}
        for k, x in enumerate(parameters):
            if x.name in known:
                jacobian[:, k] = at.near.jacobian[:, known[x.name]]
    return _stand(problem, at.candidates, parameters, u, model, at.correction, jacobian, nuisance_jacobian)


def _walk_from(problem: Problem, h: Hypothesis, exact: np.ndarray, nuisance_jacobian: np.ndarray) -> _Walk:
    fit = h.fit
    correction = exact - (fit.model - fit.correction)
    return _stand(
        problem, h.candidates, fit.parameters, fit.normalised, exact, correction, fit.jacobian, nuisance_jacobian
    )  # fmt: skip


def _stand(
    problem: Problem, candidates: tuple[EffectCandidate, ...], parameters: tuple[EstimatedParameter, ...],
    u: np.ndarray, model: np.ndarray, correction: np.ndarray, jacobian: np.ndarray, nuisance_jacobian: np.ndarray,
) -> _Walk:  # fmt: skip
    """A walk where it begins."""
    q, residual = profile_nuisances(problem, model, nuisance_jacobian, 1.0)
    cost, radius = _cost(problem, parameters, u, q, residual), problem.settings.search.radius
    return _Walk(candidates, parameters, u, model, correction, jacobian, q, residual, cost, radius)


def _differentiate(
    problem: Problem, walks: Sequence[_Walk], h: float = 0.0, missing_only: bool = False
) -> None:
    """Derivatives at the walks' points from small steps, or from steps of h, where these change anything; where they do
    not, the former ones stay."""
    h = h or max(problem.settings.search.fine_step, problem.discretisation.difference_step)
    points, whose = [], []
    for w in walks:
        w.jacobian = w.jacobian.copy()
        for k, x in enumerate(w.parameters):
            if missing_only and np.any(w.jacobian[:, k]):
                continue
            step = h if w.u[k] + h <= x.high else -h
            moved = w.u.copy()
            moved[k] += step
            points.append(point_of(w.parameters, moved))
            whose.append((w, k, step))
    for (w, k, step), model in zip(whose, in_batches(problem, points), strict=True):
        if model is None:
            continue
        change = model + w.correction - w.model
        if np.any(change):
            w.jacobian[:, k] = change / step


def _walk(
    problem: Problem, walks: Sequence[_Walk], rows: slice, nuisance_jacobian: np.ndarray, steps: int
) -> None:
    for _ in range(steps):
        going = [w for w in walks if not w.settled]
        if not going or problem.stop_requested:
            break
        for w in going:
            _aim(problem, rows, w, nuisance_jacobian)
        going = [w for w in going if not w.settled]
        models = problem.evaluate([point_of(w.parameters, w.u + w.step) for w in going])
        for w, model in zip(going, models, strict=True):
            _judge(problem, w, None if model is None else model + w.correction, nuisance_jacobian)


def _begin(
    problem: Problem, bank: Bank, proposals: Sequence[Proposal], nuisance_jacobian: np.ndarray
) -> list[_Walk]:
    settings, points, whose = problem.settings.search, [], []
    walks: list[_Walk] = []
    models = problem.evaluate([p.point for p in proposals])
    known = {x.name: k for k, x in enumerate(bank.parameters)}
    for p, coarse in zip(proposals, models, strict=True):
        if coarse is None:
            continue
        walk = _put(problem, Place(p.candidates, p.point, bank.correction), coarse, nuisance_jacobian)
        for k, x in enumerate(walk.parameters):
            if x.in_every_set or x.name in known:
                walk.jacobian[:, k] = bank.jacobian[:, known[x.name]]
                if x.in_every_set:
                    continue
            h = wide_step(x, float(walk.u[k]), settings.derivative_step)
            points.append({**p.point, x.name: float(walk.u[k] + h)})
            whose.append((len(walks), k, h))
        walks.append(walk)
    for (w, k, h), model in zip(whose, problem.evaluate(points), strict=True):
        if model is not None:
            walks[w].jacobian[:, k] = (model + bank.correction - walks[w].model) / h
    return walks


def _cost(
    problem: Problem, parameters: Sequence[EstimatedParameter], u: np.ndarray, q: np.ndarray, residual: np.ndarray
) -> float:
    channels = len(problem.observations.span)
    return penalised_deviance(rms(residual), penalty(parameters, u, q[:channels]))


def _aim(problem: Problem, rows: slice, w: _Walk, nuisance_jacobian: np.ndarray) -> None:
    """The next step; none where little is to be gained."""
    dispersion = estimate_dispersion(problem, w.residual)
    linearised = LinearisedModel.around(problem, w.u, w.model, w.jacobian, nuisance_jacobian, rows)
    reach = w.radius * np.maximum(problem.settings.search.least_reach, np.abs(w.u))
    weight = dispersion * linearised.r.size / len(problem.observations)
    step = linearised.step(w.parameters, weight, reach)
    expected = _cost(problem, w.parameters, w.u + step.d, step.q, linearised.predicted_residual(step))
    w.step = step.d
    w.settled = w.cost - expected < problem.settings.search.least_gain


def _judge(problem: Problem, w: _Walk, model: np.ndarray | None, nuisance_jacobian: np.ndarray) -> None:
    """Go there if it is better; what was found mends the derivatives either way."""
    settings = problem.settings.search
    if model is None:
        w.radius *= settings.shrink
        return
    length = float(w.step @ w.step)
    if length > 1e-12:
        w.jacobian = w.jacobian + np.outer(model - w.model - w.jacobian @ w.step, w.step) / length
    q, residual = profile_nuisances(problem, model, nuisance_jacobian, 1.0)
    cost = _cost(problem, w.parameters, w.u + w.step, q, residual)
    if cost < w.cost:
        w.u, w.model, w.nuisances, w.residual, w.cost = w.u + w.step, model, q, residual, cost
        w.radius = min(1.0, settings.grow * w.radius)
        w.failures = 0
    else:
        w.radius *= settings.shrink
        w.failures += 1
        w.settled = w.failures >= settings.failures


def _fit(problem: Problem, w: _Walk, converged: bool = False) -> Fit:
    return Fit(
        w.parameters, w.u, w.model, w.jacobian, w.nuisances, len(problem.observations.span), w.residual,
        w.correction, estimate_dispersion(problem, w.residual), converged,
    )  # fmt: skip
