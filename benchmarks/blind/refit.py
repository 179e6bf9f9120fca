"""What a refit of the base parameters within their tolerance leaves of an effect: a bounded, global fit with the plant.

A linear projection overstates effects that are large and alike to a base parameter: 6 % less supply pressure by a
drooping pump is, to 0.01 floors, a relief valve set 6 % lower, and yet a projection leaves 11 floors of it, because the
machine swings where it did not. So the refit is searched for: each parameter alone over its range, then Gauss-Newton
steps from the best of these, first on smoothed readings, in which spikes and swings do not hide the way.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d
from scipy.optimize import lsq_linear

from .plant import PlantError

Array = NDArray[np.float64]

SCAN = 21
"""Values of each parameter alone."""

STARTS = 2
"""Points from which is fitted on."""

WIDTHS = (1.0, 0.0)
"""Widths of the running mean of the readings (s), one after the other."""

STEPS = (0.02, 0.3, 1.0)
"""Steps of the differences, in tolerances: a longer one where the one before leads nowhere."""

ITERATIONS, LITTLE = 8, 0.03
"""Most steps for each width; and the share of the cost that a step has to gain."""


def left_by_refit(
    model: Callable[[Array], Array], target: Array, start: Array, tolerance: float, parts: Sequence[tuple[int, float]],
    enough: float = 0.0, scan: int = SCAN,
) -> float:  # fmt: skip
    """RMS (in floors) of what the best point found within 1 +- tolerance leaves of the target readings (n,).

    model: readings (n,) at factors (k,), may raise `PlantError`; start: a point known; parts: number of readings and
    rate (1/s) of each series among them, in their order; scan: values at which each parameter is tried alone; the
    search ends where `enough` or less is left.
    """
    spread = tolerance / np.sqrt(3.0)

    def cost(left: Array, b: Array) -> float:
        return float(left @ left + np.sum(((b - 1.0) / spread) ** 2))

    found = [(cost(target - y, b), b, y) for b, y in _alone(model, start, tolerance, scan)]
    found.sort(key=lambda entry: entry[0])
    least = min(float(np.mean((target - y) ** 2)) for _, _, y in found)
    for _, b, y in found[:STARTS]:
        for width in WIDTHS:
            if least <= enough**2:
                break
            b, y = _descend(model, target, b, y, tolerance, lambda x, w=width: _smooth(x, parts, w), cost)
            least = min(least, float(np.mean((target - y) ** 2)))
    return float(np.sqrt(least))


def _alone(model: Callable[[Array], Array], start: Array, tolerance: float, scan: int) -> list[tuple[Array, Array]]:
    """The start, and for each parameter the points that differ from it in that one only, with their readings."""
    points = [start]
    for k in range(len(start)):
        for value in np.linspace(1.0 - tolerance, 1.0 + tolerance, scan):
            points.append(np.where(np.arange(len(start)) == k, value, start))
    made = []
    for b in points:
        try:
            made.append((b, model(b)))
        except PlantError:
            continue
    return made


def _descend(
    model: Callable[[Array], Array], target: Array, b: Array, y: Array, tolerance: float,
    smooth: Callable[[Array], Array], cost: Callable[[Array, Array], float],
) -> tuple[Array, Array]:  # fmt: skip
    """Gauss-Newton steps on smoothed readings, within the bounds."""
    spread, level = tolerance / np.sqrt(3.0), 0
    for _ in range(ITERATIONS):
        left = smooth(target - y)
        before = cost(left, b)
        columns = []
        for k in range(len(b)):
            h = STEPS[level] * tolerance * (1.0 if b[k] <= 1.0 else -1.0)
            moved = np.where(np.arange(len(b)) == k, b + h, b)
            try:
                columns.append(smooth(model(moved) - y) / h)
            except PlantError:
                columns.append(np.zeros_like(left))
        A = np.vstack([np.column_stack(columns), np.eye(len(b)) / spread])
        bounds = 1.0 - tolerance - b - 1e-9, 1.0 + tolerance - b + 1e-9
        d = lsq_linear(A, np.concatenate([left, (1.0 - b) / spread]), bounds, method="bvls").x
        best = (before, b, y)
        for s in (1.0, 0.4, 0.16, 0.06, 0.02):
            try:
                there = model(b + s * d)
            except PlantError:
                continue
            now = cost(smooth(target - there), b + s * d)
            if now < best[0]:
                best = (now, b + s * d, there)
            elif best[0] < before:
                break
        _, b, y = best
        level = level + 1 if before - best[0] < LITTLE * before else 0
        if level == len(STEPS):
            break
    return b, y


def _smooth(x: Array, parts: Sequence[tuple[int, float]], width: float) -> Array:
    """Running mean over the width (s) within each series."""
    made, i = np.empty_like(x), 0
    for n, rate in parts:
        made[i : i + n] = uniform_filter1d(x[i : i + n], max(1, round(width * rate)), mode="nearest")
        i += n
    return made
