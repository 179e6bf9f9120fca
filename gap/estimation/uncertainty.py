"""How sure the figures are: intervals of parameters and of the reduction."""

from __future__ import annotations

import numpy as np

from ..problem.problem import Problem
from ..settings import BootstrapSettings
from .fit import Fit
from .linear import LinearisedModel


def data_std(problem: Problem, fit: Fit, nuisance_jacobian: np.ndarray, energy: float = 0.0) -> np.ndarray:
    """Standard deviation of each u (k,) from the cost's curvature, base parameters and nuisances free.

    energy: what lasts through all readings beyond the noise, per reading.
    """
    std: np.ndarray = np.sqrt(np.maximum(np.diag(data_covariance(problem, fit, nuisance_jacobian, energy)), 0.0))
    return std


def data_covariance(problem: Problem, fit: Fit, nuisance_jacobian: np.ndarray, energy: float) -> np.ndarray:
    """Covariance (k, k) of the u; energy: as of `data_std`."""
    linearised = LinearisedModel.around(problem, fit.normalised, fit.model, fit.jacobian, nuisance_jacobian)
    H = linearised.curvature(fit.parameters, fit.dispersion + energy * len(problem.observations))
    k = len(fit.normalised)
    return np.asarray(np.linalg.inv(H)[:k, :k])


def parameter_std(problem: Problem, fit: Fit, nuisance_jacobian: np.ndarray) -> np.ndarray:
    """Standard deviation of each u (k,) with what the library's forms leave open; a base parameter's is its prior's
    at most."""
    settings = problem.settings.uncertainty
    std = data_std(problem, fit, nuisance_jacobian, settings.form_energy)
    base = np.array([x.kind == "base" for x in fit.parameters], dtype=bool)
    wider = np.hypot(std, np.where(base, settings.form_of_base, settings.form_of_effect * np.abs(fit.normalised)))
    limited: np.ndarray = np.where(base, np.minimum(wider, [x.sd for x in fit.parameters]), wider)
    return limited


def block_length(energy: np.ndarray, kind: str, settings: BootstrapSettings) -> float | None:
    """How many stretches belong together, of which each has that energy (stretches,); kind: stationary or circular.
    None where they are too few to tell, or all alike."""
    from arch.bootstrap import optimal_block_length

    if len(energy) <= settings.fewest or not np.ptp(energy) > 0.0:
        return None
    with np.errstate(divide="ignore", invalid="ignore"):  # of stretches that are nearly alike
        return float(np.nan_to_num(optimal_block_length(energy)[kind].iloc[0], nan=1.0))


def reduction_interval(problem: Problem, before: np.ndarray, after: np.ndarray) -> tuple[float, float]:
    """95 % interval of 1 - RMS(after) / RMS(before), by a stationary block bootstrap over time; -1 at least."""
    from arch.bootstrap import StationaryBootstrap

    settings = problem.settings.bootstrap
    place = problem.observations.stretches(settings.bin)
    sums = np.stack([np.bincount(place, before**2), np.bincount(place, after**2)], axis=1)
    sums = sums[sums.sum(1) > 0.0]  # limits that are kept say nothing
    if len(sums) < 2:
        return -1.0, 1.0

    def reduction(x: np.ndarray) -> float:
        total = x.sum(0)
        return max(-1.0, float(1.0 - np.sqrt(total[1] / max(total[0], 1e-300))))

    length = 2.0
    if (optimal := block_length(sums[:, 1], "stationary", settings)) is not None:
        length = float(np.clip(optimal, 1.0, len(sums) / 3))
    bootstrap = StationaryBootstrap(length, sums, seed=settings.seed)  # type: ignore[arg-type]  # a mean, so not always whole
    draws = bootstrap.apply(reduction, settings.draws)[:, 0]
    low, high = np.quantile(draws, [0.025, 0.975])
    return float(low), float(high)
