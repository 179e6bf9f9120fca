"""Derivatives of the model by differences of simulations, as a coroutine that asks for them."""

from __future__ import annotations

from collections.abc import Generator, Sequence

import numpy as np

from ..problem.noise import rms
from ..problem.parameters import EstimatedParameter, Point, point_of
from ..problem.problem import Problem
from .fit import SimulationAnswer, SimulationRequest


class FiniteDifferences:
    """Derivatives (n, len(which)) by some parameters at u (k,), from runs at the fit's step; base_model (n,): at u.

    A run that fails gives way to one on the other side; a derivative that cannot be found, or that is nothing even for
    a wide step, is zero. Of an effect in which the runs are not smooth only wide steps tell the way; of a period,
    which moves every one of its instants, only small ones.
    """

    def __init__(
        self, problem: Problem, parameters: Sequence[EstimatedParameter], u: np.ndarray, which: Sequence[int],
        base_model: np.ndarray,
    ):  # fmt: skip
        self.problem, self.parameters, self.u, self.base_model = problem, parameters, u, base_model
        self.which = list(which)
        self.smooth = problem.simulator.smooth
        self.columns = np.zeros((len(base_model), len(self.which)))

    def _parameter(self, c: int) -> EstimatedParameter:
        return self.parameters[self.which[c]]

    def _is_smooth(self, c: int) -> bool:
        return bool(self._parameter(c).longest_run) or self.smooth.get(self._parameter(c).name, True)

    def _shifted_point(self, c: int, step: float) -> Point:
        v = self.u.copy()
        v[self.which[c]] += step
        return point_of(self.parameters, v)

    def compute(self, h: float) -> Generator[SimulationRequest, SimulationAnswer, np.ndarray]:
        """The derivatives with steps of h, wider ones where these show nothing."""
        wide = self.problem.settings.fit.wide_step
        all_columns = range(len(self.which))
        sizes = {c: max(h, wide) if not self._is_smooth(c) else h for c in all_columns}
        unseen = [
            c for c in all_columns if self._parameter(c).kind == "effect" and self._parameter(c).name not in self.smooth
        ]
        for attempt in range(3):
            steps = {c: self._signed_step(c, size, attempt) for c, size in sizes.items()}
            points = [self._shifted_point(c, step) for c, step in steps.items()]
            probed = unseen if attempt == 0 else []
            small = [self._small_step(c) for c in probed]
            points += [self._shifted_point(c, k * s) for c, s in zip(probed, small, strict=True) for k in (1.0, 2.0)]
            results = (yield SimulationRequest(points, [])).at_fit_step
            self._record_smoothness(probed, results[len(steps) :])
            sizes = self._fill_columns(steps, results)
            if not sizes:
                break
        return self.columns

    def _signed_step(self, c: int, size: float, attempt: int) -> float:
        """A step that stays within the bounds; to the other side on the second attempt."""
        x, u = self._parameter(c), self.u[self.which[c]]
        low, high = x.low - u, x.high - u
        turn = self.problem.settings.search.period_difference
        size = min(size, 0.5 * (high - low), x.longest_difference(float(u), turn))
        forward = size <= high and (attempt != 1 or -size < low)
        return size if forward else -size

    def _small_step(self, c: int) -> float:
        d = self.problem.discretisation.difference_step
        return d if self.u[self.which[c]] + 2.0 * d <= self._parameter(c).high else -d

    def _record_smoothness(self, probed: Sequence[int], results: Sequence[np.ndarray | None]) -> None:
        """Remember in which effects a small step and the next one change the runs alike."""
        settings, noise = self.problem.settings.fit, self.problem.observations.noise_std
        for c, one, two in zip(probed, results[::2], results[1::2], strict=True):
            if one is not None and two is not None and np.any(one - self.base_model):
                first, second = ((y - z) / noise for y, z in ((one, self.base_model), (two, one)))
                self.smooth[self._parameter(c).name] = rms(second - first) <= settings.rough_from * rms(first)

    def _fill_columns(self, steps: dict[int, float], results: Sequence[np.ndarray | None]) -> dict[int, float]:
        """Fill in the columns; returns the sizes with which some are to be found again."""
        wide = self.problem.settings.fit.wide_step
        retries = {}
        for (c, step), y in zip(steps.items(), results, strict=False):
            if y is None:
                retries[c] = abs(step)
                continue
            self.columns[:, c] = (y - self.base_model) / step
            if (not np.any(self.columns[:, c]) or not self._is_smooth(c)) and abs(step) < wide:
                retries[c] = wide
        return retries
