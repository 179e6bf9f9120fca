"""Fits of many sets side by side from where the bank expects them, with one simulation a step each.

Derivatives by base parameters are the bank's, those by the effects' own parameters one simulation each; every step
mends them by what it has found (Broyden 1965). So a set costs some ten simulations, and the leaders alone are fitted to
the end afterwards.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from ..estimation.dispersion import estimate_dispersion
from ..estimation.fit import Fit
from ..estimation.linear import LinearisedModel, profile_nuisances
from ..problem.noise import rms
from ..problem.parameters import EffectCandidate, EstimatedParameter, Point, penalty, point_of
from ..problem.problem import Problem
from ..selection.hypothesis import Hypothesis, penalised_deviance
from .response_bank import ResponseBank, evaluate_in_batches, point_with, response_rows, wide_step
from .sets import Proposal


class FitStart(NamedTuple):
    """A set of effects at a point, the correction of the long step there (n,), and a fit near it whose derivatives may
    serve there."""

    candidates: tuple[EffectCandidate, ...]
    point: Point
    correction: np.ndarray
    near: Fit | None = None


@dataclass(eq=False)
class _QuickFit:
    """One set on its way: working state of `fit_proposals`."""

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
    finished: bool = False


def fit_proposals(
    problem: Problem, bank: ResponseBank, proposals: Sequence[Proposal], nuisance_jacobian: np.ndarray, steps: int
) -> list[Hypothesis]:
    """A fit of every proposal whose model runs, in their order."""
    quick_fits = _start_proposals(problem, bank, proposals, nuisance_jacobian)
    _iterate(problem, quick_fits, bank.rows, nuisance_jacobian, steps)
    return [Hypothesis(f.candidates, _fit(problem, f), quick=True) for f in quick_fits]


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
    settings, polished, active = problem.settings.search, list(hypotheses), list(range(len(hypotheses)))
    confirmed: dict[int, Hypothesis] = {}
    gained = dict.fromkeys(active, np.inf)
    for look in range(looks + 1):
        if not active or problem.stop_requested:
            break
        quick_fits: dict[int, _QuickFit] = {}
        for k, exact in zip(active, problem.exact([polished[k].fit.point for k in active]), strict=True):
            if exact is not None:
                quick_fits[k] = _start_from(problem, polished[k], exact, nuisance_jacobian)
        if look:  # a step that the exact run does not bear out is taken back
            quick_fits = {k: f for k, f in quick_fits.items() if f.cost < confirmed[k].penalised_deviance}
            polished = [confirmed[k] if k in active and k not in quick_fits else h for k, h in enumerate(polished)]
        if look < looks:
            to_differentiate = [f for k, f in quick_fits.items() if gained[k] > settings.jacobian_refresh_gain]
            _differentiate(problem, to_differentiate, missing_only=derivatives_known and look == 0)
        confirmed = {k: Hypothesis(f.candidates, _fit(problem, f, converged=True)) for k, f in quick_fits.items()}
        if look < looks:
            under_way = list(quick_fits.values())
            _iterate(problem, under_way, response_rows(problem), nuisance_jacobian, settings.polish_steps)
        gained = {k: confirmed[k].penalised_deviance - f.cost for k, f in quick_fits.items()}
        active = [k for k, gain in gained.items() if gain > settings.least_gain]
        for k, f in quick_fits.items():
            polished[k] = Hypothesis(f.candidates, _fit(problem, f)) if k in active else confirmed[k]
    return polished


def drop_effects(
    problem: Problem, pairs: Sequence[tuple[Hypothesis, EffectCandidate]], nuisance_jacobian: np.ndarray
) -> list[Hypothesis | None]:
    """Hypotheses without one of their effects each, fitted side by side, to the end where that may come near them; None
    where the model does not run."""
    settings = problem.settings.search
    fitted = fit_from(problem, _starts_without(problem, pairs, nuisance_jacobian), nuisance_jacobian)
    for near, looks in ((True, settings.polish_rounds), (False, 0)):
        chosen = [
            (k, h) for k, h in enumerate(fitted)
            if h is not None and (h.fit.rms < settings.max_drop_ratio * pairs[k][0].fit.rms) is near
        ]  # fmt: skip
        polished = polish(problem, [h for _, h in chosen], nuisance_jacobian, looks)
        for (k, _), h in zip(chosen, polished, strict=True):
            fitted[k] = h
    return fitted


def _starts_without(
    problem: Problem, pairs: Sequence[tuple[Hypothesis, EffectCandidate]], nuisance_jacobian: np.ndarray
) -> list[FitStart]:
    """Where hypotheses stand without an effect each: with all else as it is, or where the derivatives say that all else
    goes, whichever leaves less.

    A valve that gives 4 % less is as good as a flow rated 4 % less; without it and with all else as it is, the right
    effect alone left 14 times the noise, from where no quick fit came back.
    """
    starts = []
    for h, dropped in pairs:
        candidates, point = tuple(c for c in h.candidates if c is not dropped), point_with(h.fit.point, dropped, {})
        predicted = predict_without(problem, h.fit, dropped.parameters, nuisance_jacobian)
        moved = {**point, **point_of(predicted.parameters, predicted.normalised)}
        starts += [FitStart(candidates, at, h.fit.correction, h.fit) for at in (point, moved)]
    standing = hypotheses_at(problem, starts, nuisance_jacobian)
    costs = np.array([np.inf if s is None else s.penalised_deviance for s in standing]).reshape(-1, 2)
    return [starts[2 * k + int(best)] for k, best in enumerate(costs.argmin(axis=1))]


def predict_without(problem: Problem, fit: Fit, dropped: Sequence[object], nuisance_jacobian: np.ndarray) -> Fit:
    """The fit without some parameters as the derivatives foretell it: these go back to nothing, the others follow."""
    is_kept = np.array([x not in dropped for x in fit.parameters])
    model = fit.model - fit.jacobian[:, ~is_kept] @ fit.normalised[~is_kept]
    parameters = tuple(x for x, keep in zip(fit.parameters, is_kept, strict=True) if keep)
    u, jacobian = fit.normalised[is_kept], fit.jacobian[:, is_kept]
    linearised = LinearisedModel.around(problem, u, model, jacobian, nuisance_jacobian)
    step = linearised.step(parameters, fit.dispersion, np.full(len(u), np.inf))
    return replace(
        fit, parameters=parameters, normalised=u + step.d, model=model + jacobian @ step.d, jacobian=jacobian,
        nuisances=step.q, residual=linearised.predicted_residual(step), unfinished=True,
    )  # fmt: skip


def fit_from(
    problem: Problem, starts: Sequence[FitStart], nuisance_jacobian: np.ndarray
) -> list[Hypothesis | None]:
    """Quick fits from these places, side by side; None where the model does not run."""
    settings, quick_fits = problem.settings.search, dict[int, _QuickFit]()
    for k, coarse in enumerate(evaluate_in_batches(problem, [start.point for start in starts])):
        if coarse is not None:
            quick_fits[k] = _start_at(problem, starts[k], coarse, nuisance_jacobian)
    _differentiate(problem, list(quick_fits.values()), settings.derivative_step)
    _iterate(problem, list(quick_fits.values()), response_rows(problem), nuisance_jacobian, settings.quick_fit_steps)
    fits = {k: Hypothesis(f.candidates, _fit(problem, f), quick=True) for k, f in quick_fits.items()}
    return [fits.get(k) for k in range(len(starts))]


def hypotheses_at(
    problem: Problem, starts: Sequence[FitStart], nuisance_jacobian: np.ndarray
) -> list[Hypothesis | None]:
    """Hypotheses as they stand at these places, without derivatives yet; None where the model does not run."""
    hypotheses: list[Hypothesis | None] = []
    for start, coarse in zip(starts, evaluate_in_batches(problem, [start.point for start in starts]), strict=True):
        quick_fit = None if coarse is None else _start_at(problem, start, coarse, nuisance_jacobian)
        hypotheses.append(
            None if quick_fit is None else Hypothesis(start.candidates, _fit(problem, quick_fit), quick=True)
        )
    return hypotheses


def exact_hypotheses_at(
    problem: Problem, sets: Sequence[tuple[tuple[EffectCandidate, ...], Point]], nuisance_jacobian: np.ndarray
) -> list[Hypothesis]:
    """Sets of effects as they stand at points, each corrected by its own exact run; those that run."""
    points, hypotheses = [point for _, point in sets], []
    for (candidates, point), coarse, exact in zip(sets, *problem.evaluate_both(points, points), strict=True):
        if coarse is not None and exact is not None:
            quick_fit = _start_at(problem, FitStart(candidates, point, exact - coarse), coarse, nuisance_jacobian)
            hypotheses.append(Hypothesis(candidates, _fit(problem, quick_fit), quick=True))
    return hypotheses


def _start_at(problem: Problem, start: FitStart, coarse: np.ndarray, nuisance_jacobian: np.ndarray) -> _QuickFit:
    """A fit that begins at a place, derivatives that are not known 0; coarse: the long vector there (n,) at the fit's
    step."""
    parameters = (*problem.base, *(x for c in start.candidates for x in c.parameters))
    u = np.array([start.point.get(x.name, 0.0) for x in parameters])
    model, jacobian = coarse + start.correction, np.zeros((len(coarse), len(parameters)))
    if start.near is not None:
        nearby_columns = {x.name: k for k, x in enumerate(start.near.parameters)}
        for k, x in enumerate(parameters):
            if x.name in nearby_columns:
                jacobian[:, k] = start.near.jacobian[:, nearby_columns[x.name]]
    return _new_quick_fit(
        problem, start.candidates, parameters, u, model, start.correction, jacobian, nuisance_jacobian
    )


def _start_from(problem: Problem, h: Hypothesis, exact: np.ndarray, nuisance_jacobian: np.ndarray) -> _QuickFit:
    fit = h.fit
    correction = exact - (fit.model - fit.correction)
    return _new_quick_fit(
        problem, h.candidates, fit.parameters, fit.normalised, exact, correction, fit.jacobian, nuisance_jacobian
    )  # fmt: skip


def _new_quick_fit(
    problem: Problem, candidates: tuple[EffectCandidate, ...], parameters: tuple[EstimatedParameter, ...],
    u: np.ndarray, model: np.ndarray, correction: np.ndarray, jacobian: np.ndarray, nuisance_jacobian: np.ndarray,
) -> _QuickFit:  # fmt: skip
    """A fit where it begins."""
    q, residual = profile_nuisances(problem, model, nuisance_jacobian, 1.0)
    cost, radius = _cost(problem, parameters, u, q, residual), problem.settings.search.initial_trust_radius
    return _QuickFit(candidates, parameters, u, model, correction, jacobian, q, residual, cost, radius)


def _differentiate(
    problem: Problem, quick_fits: Sequence[_QuickFit], h: float = 0.0, missing_only: bool = False
) -> None:
    """Derivatives at the fits' points from small steps, or from steps of h, where these change anything; where they do
    not, the former ones stay."""
    h = h or max(problem.settings.search.polish_difference_step, problem.discretisation.difference_step)
    points, owners = [], []
    for f in quick_fits:
        f.jacobian = f.jacobian.copy()
        for k, x in enumerate(f.parameters):
            if missing_only and np.any(f.jacobian[:, k]):
                continue
            size = min(h, x.longest_difference(float(f.u[k]), problem.settings.search.period_difference))
            step = size if f.u[k] + size <= x.high else -size
            shifted = f.u.copy()
            shifted[k] += step
            points.append(point_of(f.parameters, shifted))
            owners.append((f, k, step))
    for (f, k, step), model in zip(owners, evaluate_in_batches(problem, points), strict=True):
        if model is None:
            continue
        change = model + f.correction - f.model
        if np.any(change):
            f.jacobian[:, k] = change / step


def _iterate(
    problem: Problem, quick_fits: Sequence[_QuickFit], rows: slice, nuisance_jacobian: np.ndarray, steps: int
) -> None:
    for _ in range(steps):
        active = [f for f in quick_fits if not f.finished]
        if not active or problem.stop_requested:
            break
        for f in active:
            _propose_step(problem, rows, f, nuisance_jacobian)
        active = [f for f in active if not f.finished]
        models = problem.evaluate([point_of(f.parameters, f.u + f.step) for f in active])
        for f, model in zip(active, models, strict=True):
            _take_step(problem, f, None if model is None else model + f.correction, nuisance_jacobian)


def _start_proposals(
    problem: Problem, bank: ResponseBank, proposals: Sequence[Proposal], nuisance_jacobian: np.ndarray
) -> list[_QuickFit]:
    settings, points, owners = problem.settings.search, [], []
    quick_fits: list[_QuickFit] = []
    models = problem.evaluate([p.point for p in proposals])
    bank_columns = {x.name: k for k, x in enumerate(bank.parameters)}
    for p, coarse in zip(proposals, models, strict=True):
        if coarse is None:
            continue
        quick_fit = _start_at(problem, FitStart(p.candidates, p.point, bank.correction), coarse, nuisance_jacobian)
        for k, x in enumerate(quick_fit.parameters):
            if x.in_every_set or x.name in bank_columns:
                quick_fit.jacobian[:, k] = bank.jacobian[:, bank_columns[x.name]]
                if x.in_every_set:
                    continue
            h = wide_step(x, float(quick_fit.u[k]), settings.derivative_step, settings.period_difference)
            points.append({**p.point, x.name: float(quick_fit.u[k] + h)})
            owners.append((len(quick_fits), k, h))
        quick_fits.append(quick_fit)
    for (f, k, h), model in zip(owners, problem.evaluate(points), strict=True):
        if model is not None:
            quick_fits[f].jacobian[:, k] = (model + bank.correction - quick_fits[f].model) / h
    return quick_fits


def _cost(
    problem: Problem, parameters: Sequence[EstimatedParameter], u: np.ndarray, q: np.ndarray, residual: np.ndarray
) -> float:
    channels = len(problem.observations.span)
    return penalised_deviance(rms(residual), penalty(parameters, u, q[:channels]))


def _propose_step(problem: Problem, rows: slice, f: _QuickFit, nuisance_jacobian: np.ndarray) -> None:
    """The next step; none where little is to be gained."""
    dispersion = estimate_dispersion(problem, f.residual)
    linearised = LinearisedModel.around(problem, f.u, f.model, f.jacobian, nuisance_jacobian, rows)
    reach = f.radius * np.maximum(problem.settings.search.min_trust_scale, np.abs(f.u))
    weight = dispersion * linearised.r.size / len(problem.observations)
    step = linearised.step(f.parameters, weight, reach)
    expected = _cost(problem, f.parameters, f.u + step.d, step.q, linearised.predicted_residual(step))
    f.step = step.d
    f.finished = f.cost - expected < problem.settings.search.least_gain


def _take_step(problem: Problem, f: _QuickFit, model: np.ndarray | None, nuisance_jacobian: np.ndarray) -> None:
    """Go there if it is better; what was found mends the derivatives either way."""
    settings = problem.settings.search
    if model is None:
        f.radius *= settings.trust_shrinkage
        return
    length = float(f.step @ f.step)
    if length > 1e-12:
        f.jacobian = f.jacobian + np.outer(model - f.model - f.jacobian @ f.step, f.step) / length
    q, residual = profile_nuisances(problem, model, nuisance_jacobian, 1.0)
    cost = _cost(problem, f.parameters, f.u + f.step, q, residual)
    if cost < f.cost:
        f.u, f.model, f.nuisances, f.residual, f.cost = f.u + f.step, model, q, residual, cost
        f.radius = min(1.0, settings.trust_growth * f.radius)
        f.failures = 0
    else:
        f.radius *= settings.trust_shrinkage
        f.failures += 1
        f.finished = f.failures >= settings.max_rejected_steps


def _fit(problem: Problem, f: _QuickFit, converged: bool = False) -> Fit:
    return Fit(
        f.parameters, f.u, f.model, f.jacobian, f.nuisances, len(problem.observations.span), f.residual,
        f.correction, estimate_dispersion(problem, f.residual), converged,
    )  # fmt: skip
