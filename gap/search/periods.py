"""A period that the data show, such as a controller's sampling time, found over growing stretches of a run.

What comes again every T is a whole turn off at the end of n periods where T is wrong by T/n. So a fit sees only the
nearest local minimum of many (some five hundred ticks: 0.1 % apart), and no size of a grid is in the right one. What a
period does on the average, such as the lag of half of it, has one minimum: there it is begun. Over the first half
second of a motion minima are ten times as wide as over the run, and runs of that length are cheap; the best of them,
tried closely enough there, are gone on with over twice the stretch, until it is the run. Runs are exact: of long steps,
ticks are blurred.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..estimation.linear import ProfiledPoint, profile_nuisances
from ..estimation.nuisances import nuisance_jacobian_at
from ..problem.noise import rms, rms_of_runs
from ..problem.parameters import EstimatedParameter, Point
from ..problem.problem import Problem
from .sizes import between, grid


def find_period(problem: Problem, x: EstimatedParameter, point: Point) -> float:
    """The value of a period, normalised, that serves best with all else as it is at a point.

    It is looked for in the run that is missed most there; of the best local minima that one is taken which leaves least
    of all runs: of one run, a wrong one may leave as little as the right one.
    """
    if not problem.samples.series:  # moments alone were measured
        return point[x.name]
    settings, search = problem.settings.search, _OneRun(problem, x, point)
    u, window = search.smoothed_minimum(), search.begin + settings.period_window
    spacing = x.shift(u, window, settings.period_spacing)
    if not spacing:
        return u
    count = min(int(settings.period_range * abs(x.value(u) / x.scale) / spacing), settings.period_trials // 2)
    tried = [u + k * spacing for k in range(-count, count + 1)]
    while True:
        window = min(window, search.end)
        best = _apart(search.best(tried, window), 1.5 * spacing)[: settings.periods_kept]
        if not best or problem.stop_requested:
            return u
        if window == search.end:
            break
        window *= 2.0
        spacing = x.shift(best[0], window, settings.period_spacing)
        tried = [v + k * x.shift(v, window, settings.period_spacing) for v in best for k in (-1.0, 0.0, 1.0)]
    refined = [search.refined(u) for u in best]
    left = search.left(problem, refined)
    return min(left, key=lambda v: left[v], default=u)


def _apart(ordered: Sequence[float], distance: float) -> list[float]:
    """Values without those beside one that comes before them: these are in the same minimum."""
    apart: list[float] = []
    for v in ordered:
        if all(abs(v - w) > distance for w in apart):
            apart.append(v)
    return apart


class _OneRun:
    """What is left of one run, or of its beginning, with other values of a period."""

    def __init__(self, problem: Problem, x: EstimatedParameter, point: Point):
        self.x, self.point = x, point
        run = _missed_most(problem, point)
        self.problem = problem.of_runs([run])
        samples = self.problem.samples
        self.end = max(float(b.last_sample.max()) for b in samples.series)
        least = problem.settings.search.motion_threshold
        moved = [b.t[abs(b.y - b.y[0]) > least * samples.noise_std[b.place]] for b in samples.series]
        self.begin = min((float(t[0]) for t in moved if len(t)), default=0.0)
        """When a reading first leaves where it began [s]."""

    def smoothed_minimum(self) -> float:
        """The value at which least is left of what is averaged over several of the longest periods."""
        settings, sizes = self.problem.settings.search, grid(self.x, self.problem.settings.search)
        width = settings.periods_averaged * abs(self.x.value(max(sizes, key=abs)))
        whole, left = self.problem.until(self.end), dict[float, float]()
        for _ in range(1 + settings.size_halvings):
            for v, at in self._profiled(whole, [v for v in sizes if v not in left]).items():
                # a clock or a bias that stands for the lag costs what it does in a fit
                left[v] = float(np.sum(_moving_average(whole, at.residual, width) ** 2) + at.nuisances @ at.nuisances)
            if not left:
                break
            sizes = between(left, min(left, key=lambda v: left[v]))
        return min(left, key=lambda v: left[v], default=self.point[self.x.name])

    def best(self, values: Sequence[float], until: float) -> list[float]:
        """Those values at which the model runs, the one that leaves least of the run until then [s] first."""
        inside = sorted({min(max(v, self.x.low), self.x.high) for v in values if v != 0.0})
        left = self.left(self.problem.until(until), inside)
        return sorted(left, key=lambda v: left[v])

    def refined(self, u: float) -> float:
        """What is best of the run near to a value."""
        for part in (0.5, 0.25):
            step = part * self.x.shift(u, self.end, self.problem.settings.search.period_spacing)
            u = next(iter(self.best([u - step, u, u + step], self.end)), u)
        return u

    def left(self, problem: Problem, values: Sequence[float]) -> dict[float, float]:
        """Normalised RMS that each of these values leaves of a problem's runs; those that do not run are left out."""
        return {v: rms(at.residual) for v, at in self._profiled(problem, values).items()}

    def _profiled(self, problem: Problem, values: Sequence[float]) -> dict[float, ProfiledPoint]:
        profiled = {}
        step = problem.settings.search.batch
        for k in range(0, len(values), step):
            part = values[k : k + step]
            for v, model in zip(part, problem.exact([{**self.point, self.x.name: v} for v in part]), strict=True):
                if model is not None:
                    profiled[v] = profile_nuisances(problem, model, nuisance_jacobian_at(problem, model), 1.0)
        return profiled


def _missed_most(problem: Problem, point: Point) -> int:
    """The run with signals of which most is left at a point; the first one where the model does not run there."""
    with_signals = sorted({b.run for b in problem.samples.series})
    (model,) = problem.evaluate([point])
    if model is None:
        return with_signals[0]
    observations = problem.observations
    left = rms_of_runs(observations.whiten(model), observations.run, len(problem.runs))
    return max(with_signals, key=lambda r: left[r])


def _moving_average(problem: Problem, residual: np.ndarray, width: float) -> np.ndarray:
    """The residual averaged over so long a time [s] around each reading."""
    course = residual.copy()
    for b in problem.observations.series:
        if len(b.t) > 1:
            count = min(len(b.t), max(1, round(width / float(np.median(np.diff(b.t))))))
            course[b.place] = np.convolve(residual[b.place], np.full(count, 1.0 / count), "same")
    return course
