"""A period that the data show, such as a controller's sampling time, found over growing stretches of a run.

What comes again every T is a whole turn off at the end of n periods where T is wrong by T/n. So a fit sees only the
nearest pit of many (some five hundred ticks: 0.1 % apart), and no size of a grid is in the right one. What a period
does on the average, such as the lag of half of it, has one pit: there it is begun. Over the first second and a half of
a motion pits are ten times as wide as over the run; the best of them, tried closely enough there, are gone on with over
twice the stretch, until it is the run.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..estimation.linear import ProfiledPoint, profile_nuisances
from ..problem.noise import rms
from ..problem.parameters import EstimatedParameter, Point
from ..problem.problem import Problem
from .bank import evaluate_in_batches
from .sizes import grid


def find_period(
    problem: Problem, x: EstimatedParameter, point: Point, correction: np.ndarray, nuisance_jacobian: np.ndarray
) -> float:
    """The value of a period, normalised, that serves best with all else as it is at a point.

    It is looked for in the run that is missed most at the point. correction (n,): of the long step, as there.
    """
    settings, search = problem.settings.search, _Stretches(problem, x, point, correction, nuisance_jacobian)
    u, window = search.on_the_average(), search.begin + settings.period_window
    spacing = x.shift(u, window, settings.turn)
    reach = settings.period_range * abs(x.value(u) / x.scale)
    count = int(reach / spacing)
    tried = [u + k * spacing for k in range(-count, count + 1)]
    while True:
        window = min(window, search.end)
        best = search.best(tried, window)[: settings.periods_kept]
        if not best or problem.stop_requested:
            return u
        if window == search.end:
            break
        window *= 2.0
        tried = [v + k * x.shift(v, window, settings.turn) for v in best for k in (-1.0, 0.0, 1.0)]
    u = best[0]
    for part in (0.5, 0.25):
        step = part * x.shift(u, search.end, settings.turn)
        u = search.best([u - step, u, u + step], search.end)[0]
    return u


class _Stretches:
    """What is left of the first stretch of one run with other values of a period."""

    def __init__(
        self, problem: Problem, x: EstimatedParameter, point: Point, correction: np.ndarray,
        nuisance_jacobian: np.ndarray,
    ):  # fmt: skip
        self.x, self.point = x, point
        (model,) = problem.evaluate([point])
        left = correction if model is None else problem.observations.whiten(model + correction)
        run = max(range(len(problem.runs)), key=lambda r: rms(left[problem.observations.run == r]))
        of_run = problem.observations.run == run
        self.problem = problem.of_runs([run])
        self.correction, self.nuisance_jacobian = correction[of_run], nuisance_jacobian[of_run]
        self.time = self.problem.observations.time
        self.end = float(self.time.max())
        self.begin = self._begins_to_move()

    def _begins_to_move(self) -> float:
        """When a reading first leaves where it began by more than its noise [s]."""
        observations, moved = self.problem.observations, np.zeros(len(self.time), bool)
        for b in observations.blocks:
            y = observations.y[b.place]
            moved[b.place] = abs(y - y[0]) > self.problem.settings.search.moved * observations.noise_std[b.place]
        return float(self.time[moved].min()) if moved.any() else 0.0

    def on_the_average(self) -> float:
        """The value at which least is left of what is averaged over several of the longest periods."""
        settings, sizes = self.problem.settings.search, grid(self.x, self.problem.settings.search)
        width = settings.periods_averaged * abs(self.x.value(max(sizes, key=abs)))
        left: dict[float, float] = {}
        for _ in range(1 + settings.size_looks):
            for v, (nuisances, residual) in self._profiled([v for v in sizes if v not in left]).items():
                # a clock or a bias that stands for the lag costs what it does in a fit
                left[v] = float(np.sum(self._course(residual, width) ** 2) + nuisances @ nuisances)
            if not left:
                break
            tried, nearest = sorted(left), min(left, key=lambda v: left[v])
            k = tried.index(nearest)
            sizes = [float(np.sqrt(nearest * v)) for v in (*tried[max(0, k - 1) : k], *tried[k + 1 : k + 2])]
        return min(left, key=lambda v: left[v], default=self.point[self.x.name])

    def best(self, values: Sequence[float], until: float) -> list[float]:
        """Those values at which the model runs, the one that leaves least of the run until then [s] first."""
        inside = sorted({min(max(v, self.x.low), self.x.high) for v in values if v != 0.0})
        left = {v: rms(at.residual[self.time <= until]) for v, at in self._profiled(inside).items()}
        return sorted(left, key=lambda v: left[v])

    def _profiled(self, values: Sequence[float]) -> dict[float, ProfiledPoint]:
        points = [{**self.point, self.x.name: v} for v in values]
        models = evaluate_in_batches(self.problem, points)
        return {
            v: profile_nuisances(self.problem, m + self.correction, self.nuisance_jacobian, 1.0)
            for v, m in zip(values, models, strict=True) if m is not None
        }  # fmt: skip

    def _course(self, residual: np.ndarray, width: float) -> np.ndarray:
        """The residual averaged over so long a time [s] around each reading."""
        course = residual.copy()
        for b in self.problem.observations.series:
            if len(b.t) > 1:
                count = min(len(b.t), max(1, round(width / float(np.median(np.diff(b.t))))))
                course[b.place] = np.convolve(residual[b.place], np.full(count, 1.0 / count), "same")
        return course
