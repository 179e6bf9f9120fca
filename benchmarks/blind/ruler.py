"""Sizes of effects, and the amplitude that makes an effect as large as is wanted."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .case import BASE, Array, Case, Wrong
from .measure import BIAS_SHARE, DELAY_MOST
from .plant import PlantError
from .readings import Readings

SMALLEST, LARGEST = 0.3, 30.0
"""Range of the sizes that are aimed at, in noise floors."""


class Ruler(Readings):
    """Measures how much an effect changes the readings beyond what a refit of the base parameters takes up.

    The size is the root mean square, in noise floors, of what the best refit within the tolerances leaves (`refit`). To
    find an amplitude a linear one serves: the change of all readings, divided by each channel's noise, is projected off
    the sensitivities of the base parameters (finite differences of the plant) by ridge regression with their tolerances
    (uniform: standard deviation tolerance/sqrt 3).
    """

    def __init__(self, case: Case):
        super().__init__(case)
        columns = []
        for address in BASE:
            step = 0.5 * case.tolerance
            moved = {**case.factors, address: case.factors[address] + step}
            change = self.whitened(self.signals(moved, ()), case.channels) - self.reading
            columns.append(change / (step / case.tolerance) / np.sqrt(3.0))
        self.base = np.column_stack(columns)
        self.net = np.column_stack([self.base, *self._nuisances()])

    def _nuisances(self) -> list[Array]:
        later = self.whitened(self.plain, self.case.channels, DELAY_MOST) - self.reading
        columns = [later / np.sqrt(12.0)]
        for channel in self.case.channels:
            parts = []
            for run in self.case.runs:
                for other in self.case.channels:
                    value = BIAS_SHARE * other.kind.span / other.std if other is channel else 0.0
                    parts.append(np.full(run.at.size, value))
            columns.append(np.concatenate(parts))
        return columns

    @staticmethod
    def beyond(change: Array, columns: Array) -> float:
        """Root mean square of what ridge regression on the columns, each of unit prior, leaves."""
        weights = np.linalg.solve(columns.T @ columns + np.eye(columns.shape[1]), columns.T @ change)
        return float(np.sqrt(np.mean((change - columns @ weights) ** 2)))

    def sizes(self, wrong: tuple[Wrong, ...]) -> tuple[float, float]:
        """Size beyond the base parameters, and beyond base parameters, biases and the common delay."""
        change = self.change(wrong)
        return max(self.beyond(change, self.base), 1e-9), self.beyond(change, self.net)

    def size(self, wrong: tuple[Wrong, ...], enough: float = 0.0) -> float:
        """What the best refit of the base parameters leaves; not looked for below `enough`."""
        return self.left(self.reading + self.change(wrong), (), enough)

    def scaled(self, w: Wrong, wanted: float, tries: int = 4) -> Wrong | None:
        """The effect with its amplitude such that its linear size is about the wanted one, by a secant in logarithms.

        At the greatest amplitude allowed when more would be needed; None when even that cannot be seen.
        """
        most = w.effect.most(w.sign)
        amplitude, history = min(w.effect.usual, most), []
        best = None
        for _ in range(tries):
            try:
                size, net = self.sizes((replace(w, amplitude=amplitude),))
            except PlantError:
                most = min(most, 0.5 * amplitude)
                amplitude = 0.3 * amplitude
                continue
            now = replace(w, amplitude=amplitude, size_linear=size, size_net=net, wanted=wanted)
            history.append((np.log(amplitude), np.log(size)))
            if best is None or abs(np.log(size / wanted)) < abs(np.log(best.size_linear / wanted)):
                best = now
            if abs(np.log(size / wanted)) < 0.1 or (size < wanted and amplitude >= 0.999 * most):
                break
            slope = 1.0
            if len(history) > 1 and abs(history[-1][0] - history[-2][0]) > 1e-6:
                slope = (history[-1][1] - history[-2][1]) / (history[-1][0] - history[-2][0])
            slope = min(max(slope, 0.4), 3.0)
            amplitude = min(amplitude * np.exp((np.log(wanted) - np.log(size)) / slope), most)
        return best if best is not None and best.size_linear >= SMALLEST * 0.9 else None
