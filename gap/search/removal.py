"""Hypotheses without one of their effects, fitted anew: base parameters and the other effects take over what they can.

Taken away at once, an effect may leave the machine where nothing leads back: a valve that passes 15 % less made a
stroke late by 16 noises, and there the derivatives that could make up for it were a tenth of those at the data. So a
fit that ends behind what the derivatives foretell is repeated with the effect squeezed out: it may keep a share of its
size at first, then less, and the rest follows each time.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..estimation.fit import Fit
from ..estimation.linear import LinearisedModel
from ..problem.parameters import EffectCandidate, EstimatedParameter, Point, point_of
from ..problem.problem import Problem
from ..selection.hypothesis import Hypothesis
from .polish import polish
from .response_bank import point_with
from .starts import FitStart, fit_from, hypotheses_at

Removal = tuple[Hypothesis, EffectCandidate]
"""A hypothesis, and the effect of it that is taken away."""


def drop_effects(
    problem: Problem, removals: Sequence[Removal], nuisance_jacobian: np.ndarray
) -> list[Hypothesis | None]:
    """Hypotheses without one of their effects each, fitted side by side, to the end where that may come near them; None
    where the model does not run."""
    levels = [h.fit.rms for h, _ in removals]
    predicted = _predicted(problem, removals, nuisance_jacobian)
    fitted = _fit_without(problem, removals, predicted, levels, nuisance_jacobian)
    behind = [
        k for k, (f, expected) in enumerate(zip(fitted, predicted, strict=True))
        if f is not None and falls_behind(problem, f, expected)
    ]  # fmt: skip
    if not behind or problem.stop_requested:
        return fitted
    squeezed = _squeeze_out(problem, [removals[k] for k in behind], nuisance_jacobian)
    predicted = _predicted(problem, squeezed, nuisance_jacobian)
    refits = _fit_without(problem, squeezed, predicted, [levels[k] for k in behind], nuisance_jacobian)
    for k, again in zip(behind, refits, strict=True):
        before = fitted[k]
        if again is not None and before is not None and again.penalised_deviance < before.penalised_deviance:
            fitted[k] = again
    return fitted


def _predicted(problem: Problem, removals: Sequence[Removal], nuisance_jacobian: np.ndarray) -> list[Fit]:
    return [predict_without(problem, h.fit, dropped.parameters, nuisance_jacobian) for h, dropped in removals]


def predict_without(
    problem: Problem, fit: Fit, dropped: Sequence[EstimatedParameter], nuisance_jacobian: np.ndarray
) -> Fit:
    """The fit without some parameters as the derivatives foretell it: these go back to nothing, the others follow."""
    is_kept = np.array([x not in dropped for x in fit.parameters])
    model = fit.model - fit.jacobian[:, ~is_kept] @ fit.normalised[~is_kept]
    parameters = tuple(x for x, keep in zip(fit.parameters, is_kept, strict=True) if keep)
    return _follow(
        problem, fit, parameters, fit.normalised[is_kept], model, fit.jacobian[:, is_kept], nuisance_jacobian
    )


def _follow(
    problem: Problem, fit: Fit, parameters: tuple[EstimatedParameter, ...], u: np.ndarray, model: np.ndarray,
    jacobian: np.ndarray, nuisance_jacobian: np.ndarray,
) -> Fit:  # fmt: skip
    """A fit after some of it was changed, everything else where its derivatives say that it goes."""
    linearised = LinearisedModel.around(problem, u, model, jacobian, nuisance_jacobian)
    step = linearised.step(parameters, fit.dispersion, np.full(len(u), np.inf))
    return replace(
        fit, parameters=parameters, normalised=u + step.d, model=model + jacobian @ step.d, jacobian=jacobian,
        nuisances=step.q, residual=linearised.predicted_residual(step), unfinished=True,
    )  # fmt: skip


def falls_behind(problem: Problem, fitted: Hypothesis, predicted: Fit) -> bool:
    """Whether a fit without an effect has come less far than the derivatives where the effect was in foretell."""
    expected = replace(fitted, fit=predicted).penalised_deviance
    return fitted.penalised_deviance > expected + problem.settings.search.min_round_gain


def _fit_without(
    problem: Problem, removals: Sequence[Removal], predicted: Sequence[Fit], levels: Sequence[float],
    nuisance_jacobian: np.ndarray,
) -> list[Hypothesis | None]:  # fmt: skip
    """The effects taken away at once; levels: the normalised RMS with them, near which a fit goes on to the end."""
    settings = problem.settings.search
    fitted = fit_from(problem, _starts_without(problem, removals, predicted, nuisance_jacobian), nuisance_jacobian)
    for near, rounds in ((True, settings.polish_rounds), (False, 0)):
        chosen = [
            (k, h) for k, h in enumerate(fitted)
            if h is not None and (h.fit.rms < settings.max_drop_ratio * levels[k]) is near
        ]  # fmt: skip
        polished = polish(problem, [h for _, h in chosen], nuisance_jacobian, rounds)
        for (k, _), h in zip(chosen, polished, strict=True):
            fitted[k] = h
    return fitted


def _starts_without(
    problem: Problem, removals: Sequence[Removal], predicted: Sequence[Fit], nuisance_jacobian: np.ndarray
) -> list[FitStart]:
    """Where hypotheses stand without an effect each: with all else as it is, or where the derivatives say that all else
    goes, whichever leaves less: from the former alone no quick fit may come back."""
    choices = []
    for (h, dropped), moved in zip(removals, predicted, strict=True):
        candidates, point = tuple(c for c in h.candidates if c is not dropped), point_with(h.fit.point, dropped, {})
        choices.append([FitStart(candidates, at, h.fit.correction, h.fit) for at in (point, {**point, **moved.point})])
    return _nearest_starts(problem, choices, nuisance_jacobian)


def _nearest_starts(
    problem: Problem, choices: Sequence[Sequence[FitStart]], nuisance_jacobian: np.ndarray
) -> list[FitStart]:
    """Of each choice the place that leaves less."""
    standing = iter(hypotheses_at(problem, [start for choice in choices for start in choice], nuisance_jacobian))
    nearest = []
    for choice in choices:
        costs = [np.inf if (s := next(standing)) is None else s.penalised_deviance for _ in choice]
        nearest.append(choice[int(np.argmin(costs))])
    return nearest


def _squeeze_out(problem: Problem, removals: Sequence[Removal], nuisance_jacobian: np.ndarray) -> list[Removal]:
    """Hypotheses fitted with an effect each that may keep ever less of its size, and what it has become of the effect:
    all else follows step by step."""
    squeezed = list(removals)
    for share in problem.settings.search.squeeze:
        choices = [
            _starts_within(problem, h, effect, original.fit.point, share, nuisance_jacobian)
            for (h, effect), (original, _) in zip(squeezed, removals, strict=True)
        ]
        fits = fit_from(problem, _nearest_starts(problem, choices, nuisance_jacobian), nuisance_jacobian)
        for k, h in enumerate(fits):
            if h is not None:
                squeezed[k] = (h, next(c for c in h.candidates if c.label == removals[k][1].label))
    return squeezed


def _starts_within(
    problem: Problem, h: Hypothesis, effect: EffectCandidate, original: Point, share: float,
    nuisance_jacobian: np.ndarray,
) -> list[FitStart]:  # fmt: skip
    """A hypothesis with an effect within a share of its original size: with all else as it is, and where the
    derivatives say that all else goes."""
    limited = replace(effect, parameters=tuple(_within(x, share * original[x.name]) for x in effect.parameters))
    candidates = tuple(limited if c is effect else c for c in h.candidates)
    parameters = (*problem.base, *(x for c in candidates for x in c.parameters))
    u = np.clip(h.fit.normalised, [x.low for x in parameters], [x.high for x in parameters])
    model = h.fit.model + h.fit.jacobian @ (u - h.fit.normalised)
    moved = _follow(problem, h.fit, parameters, u, model, h.fit.jacobian, nuisance_jacobian)
    return [FitStart(candidates, at, h.fit.correction, h.fit) for at in (point_of(parameters, u), moved.point)]


def _within(x: EstimatedParameter, size: float) -> EstimatedParameter:
    """A parameter between nothing and a size; a shape as it is."""
    return x if x.shape else replace(x, low=min(0.0, size), high=max(0.0, size))
