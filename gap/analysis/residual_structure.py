"""Is what a model leaves over noise, or does it follow something?

A flexible model (gradient-boosted trees) predicts the residual of each channel from the signals of the simulation and
their rates, on stretches of time it has not seen. What it predicts is structure that no candidate explains.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..estimation.cross_validation import folds
from ..problem.problem import Problem
from ..problem.stop import StopRequested


@dataclass(frozen=True)
class Structure:
    """Share of the residual's energy that is predictable, and per connector what it varies with most."""

    share: float
    channels: dict[str, float]
    varies_with: dict[str, str]


def _features(problem: Problem, rows: list[np.ndarray], step: float) -> tuple[list[str], np.ndarray]:
    """Names and values (n, features) at every reading, from the rows of a simulation."""
    names = [*problem.connectors, *(f"rate of {c}" for c in problem.connectors)]
    values = np.empty((len(problem.observations), len(names)))
    for b in problem.observations.blocks:
        grid = problem.grid(b.run, step)
        for k in range(len(problem.connectors)):
            x = rows[b.run][:, k]
            values[b.place, k] = np.interp(b.t, grid, x)
            values[b.place, k + len(problem.connectors)] = np.interp(b.t, grid, np.gradient(x, step))
    return names, values


def residual_structure(problem: Problem, residual: np.ndarray, rows: list[np.ndarray], step: float) -> Structure:
    """What of a normalised residual (n,) a flexible model predicts where it has not been trained."""
    from threadpoolctl import threadpool_limits

    with threadpool_limits(1):  # the trees are small: more threads only wait for each other
        return _structure(problem, residual, rows, step)


def _structure(problem: Problem, residual: np.ndarray, rows: list[np.ndarray], step: float) -> Structure:
    from sklearn.ensemble import HistGradientBoostingRegressor

    names, X = _features(problem, rows, step)
    settings = problem.settings.analysis
    masks = folds(problem.observations, settings.structure_stretches, 5)
    total = unexplained = 0.0
    channels, varies = {}, {}
    for k, label in enumerate(problem.labels):
        if problem.stop_requested:
            raise StopRequested
        entries = np.flatnonzero(problem.observations.channel == k)
        if len(entries) < settings.structure_least:
            continue
        entries = entries[:: max(1, len(entries) // settings.structure_samples)]
        e, x = residual[entries], X[entries]
        predicted = np.zeros(len(e))
        for mask in masks:
            test = mask[entries]
            if not test.any() or test.all():
                continue
            tree = HistGradientBoostingRegressor(
                max_iter=40, max_leaf_nodes=12, min_samples_leaf=30, learning_rate=0.15, l2_regularization=5.0,
                random_state=0,
            )  # fmt: skip
            tree.fit(x[~test], e[~test])
            predicted[test] = tree.predict(x[test])
        energy = float(e @ e)
        rest = float((e - predicted) @ (e - predicted))
        total, unexplained = total + energy, unexplained + min(rest, energy)
        channels[label] = max(0.0, 1.0 - rest / energy) if energy > 0 else 0.0
        varies[label] = _strongest(names, x, e, settings.structure_bins)
    return Structure(0.0 if total == 0.0 else 1.0 - unexplained / total, channels, varies)


def _strongest(names: list[str], x: np.ndarray, e: np.ndarray, bins: int) -> str:
    """The feature whose bins explain most of the residual."""
    best, name = -1.0, names[0]
    for k, n in enumerate(names):
        edges = np.unique(np.quantile(x[:, k], np.linspace(0, 1, bins + 1)[1:-1]))
        place = np.digitize(x[:, k], edges)
        counts = np.maximum(np.bincount(place, minlength=len(edges) + 1), 1)
        means = np.bincount(place, e, minlength=len(edges) + 1) / counts
        explained = float(np.sum(counts * means**2))
        if explained > best:
            best, name = explained, n
    return name
