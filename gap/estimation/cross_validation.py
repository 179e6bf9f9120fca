"""What a fit says about data it has not seen.

Folds leave out one twentieth of the time of every run in turn. The refit without a fold is linear around the fit of all
data, so it costs no simulation; runs that the campaign itself holds out are simulated.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..problem.noise import rms
from ..problem.observations import Observations
from ..problem.problem import Problem
from .fit import Fit
from .linear import LinearisedModel


def folds(observations: Observations, stretches: int, count: int) -> list[np.ndarray]:
    """Masks (n,) of the entries left out in turn; together they are all entries.

    The longest run is cut into so many stretches of time, others into as long ones; they are dealt out to `count`
    folds, runs shifted to each other.
    Readings that stand alone, such as moments, are dealt out run by run.
    """
    length = max(float(observations.time.max()), 1e-12) / stretches * (1.0 + 1e-12)
    alone = np.zeros(len(observations), bool)
    for b in observations.blocks:
        alone[b.place] = len(b.t) == 1
    place = np.where(alone, 0, (observations.time / length).astype(int)) + np.where(alone, 1, 7) * observations.run
    return [mask for k in range(count) if (mask := place % count == k).any()]


class FoldPredictions(NamedTuple):
    """The normalised residual (n,) of every entry as a refit without its fold predicts it, and its spread (n,)."""

    residual: np.ndarray
    spread: np.ndarray


def predict_folds(problem: Problem, fit: Fit, nuisance_jacobian: np.ndarray) -> FoldPredictions:
    """Every entry predicted by a refit without its fold.

    The spread is what the prediction can be trusted with: the noise and what the readings that were not left out leave
    open of the parameters. With long records of several channels it is the noise alone; of a few single moments, or of
    the one run that shows a parameter, each matters to the fit and is not well predicted by the others.
    """
    linearised = LinearisedModel.around(problem, fit.normalised, fit.model, fit.jacobian, nuisance_jacobian)
    residual, spread = np.empty(len(problem.observations)), np.empty(len(problem.observations))
    settings = problem.settings.validation
    radius = np.full(len(fit.normalised), settings.linear_within)
    for mask in folds(problem.observations, settings.folds, settings.folds):
        reduced, part = linearised.leave_out(mask), linearised.A[mask]
        step = reduced.step(fit.parameters, fit.dispersion, radius)
        residual[mask] = linearised.predicted_residual(step)[mask]
        covariance = np.linalg.inv(reduced.curvature(fit.parameters, 1.0))
        spread[mask] = np.sqrt(1.0 + np.einsum("ij,jk,ik->i", part, covariance, part))
    return FoldPredictions(residual, spread)


def predict_each_run(problem: Problem, fit: Fit, nuisance_jacobian: np.ndarray) -> list[float]:
    """Normalised RMS of each run as the fit of all others foretells it; linear around the fit."""
    linearised = LinearisedModel.around(problem, fit.normalised, fit.model, fit.jacobian, nuisance_jacobian)
    radius, predicted_rms = np.full(len(fit.normalised), problem.settings.validation.linear_within), []
    for r in range(len(problem.runs)):
        mask = problem.observations.run == r
        step = linearised.leave_out(mask).step(fit.parameters, fit.dispersion, radius)
        predicted_rms.append(rms(linearised.predicted_residual(step)[mask]))
    return predicted_rms


class CrossValidated(NamedTuple):
    """The left-out residual (n,) in units of its spread, and the energy per reading that it shares."""

    residual: np.ndarray
    structured_energy: float


def cross_validate(problem: Problem, fit: Fit, nuisance_jacobian: np.ndarray) -> CrossValidated:
    """What a fit says of data it has not seen.

    In units of the spread: the only stretch that shows a parameter cannot be foretold by the others, and what they miss
    there is no gap of the model.
    """
    residual, spread = predict_folds(problem, fit, nuisance_jacobian)
    return CrossValidated(residual / spread, max(0.0, problem.observations.structured_energy(residual / spread)))
