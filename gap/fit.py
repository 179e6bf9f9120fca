"""Bounded Gauss-Newton on whitened residuals, as a coroutine that asks for simulations and shares its Jacobians.

Cost of a point:

    C(u) = sum(r^2) / phi + sum((u / sd)^2),   r = (measured - model(u) - N q) / floor

q are the linear nuisances (a bias per channel, a clock error per run) with priors of their own, in closed form with u.
phi is the dispersion: the mean square of the residual times its correlation time, at least 1. It is taken from the
fit's own residual, so a model that misses much does not squeeze its base parameters against their bounds, and a model
that fits to the floor is held to it.
"""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import lsq_linear

from .noise import rms
from .problem import BIAS, BIAS_OF_LEVEL, CLOCK, Point, Problem, Unknown

Ask = Generator[list[Point], list[np.ndarray | None], "Fit"]
"""Yields points, is sent their long vectors, returns a fit."""

LEAST = 600.0
"""Readings that count at least, however long their residuals stay on one side: a fit has to want to improve."""

MOVED = 0.5
"""How far a fit goes, in prior standard deviations, before its derivatives are too old to end with."""

DIFFERENCE, FINE_DIFFERENCE = 0.2, 0.05
"""Step of a finite difference, in u: on the way, and near the end, where kinks of the model matter."""


@dataclass
class Fit:
    """Where a fit stands: unknowns (k), u (k,), the model's long vector (n,), its derivative (n, k), what is left."""

    unknowns: tuple[Unknown, ...]
    u: np.ndarray
    model: np.ndarray
    jacobian: np.ndarray
    q: np.ndarray
    residual: np.ndarray
    phi: float
    converged: bool = False

    @property
    def point(self) -> dict[str, float]:
        """The point in the problem's terms."""
        return {x.name: float(u) for x, u in zip(self.unknowns, self.u, strict=True)}

    @property
    def rms(self) -> float:
        """Whitened RMS of the residual."""
        return rms(self.residual)

    def penalty(self) -> float:
        """Sum of (u / sd)^2."""
        return float(sum((u / x.sd) ** 2 for x, u in zip(self.unknowns, self.u, strict=True)))


def nuisances(problem: Problem, model: np.ndarray) -> np.ndarray:
    """Columns (n, m) of the linear nuisances, in the unit of the readings for one prior standard deviation each."""
    obs = problem.obs
    columns = []
    for k in range(len(obs.span)):
        usual = max(BIAS * obs.span[k], BIAS_OF_LEVEL * obs.level[k])
        columns.append(np.where(obs.channel == k, usual, 0.0))
    slope = obs.slope(model)
    for r in range(len(problem.runs)):
        columns.append(np.where(obs.run == r, -clock(problem, r) * slope, 0.0))
    return np.stack(columns, axis=1)


def clock(problem: Problem, run: int) -> float:
    """Usual misalignment of a run's clock [s]."""
    intervals = [b.interval for b in problem.obs.series if b.run == run]
    return min(1e-3, CLOCK * min(intervals, default=0.0))


def correlation_time(x: np.ndarray) -> float:
    """1 + 2 sum of the autocorrelations of x (n,), windowed after Sokal; at least 1."""
    n = len(x)
    if n < 8 or not np.any(x):
        return 1.0
    size = 1 << (2 * n - 1).bit_length()
    f = np.fft.rfft(x, size)
    acf = np.fft.irfft(f * np.conj(f), size)[: n // 2]
    acf = acf / acf[0]
    tau = 2.0 * np.cumsum(acf) - 1.0
    window = np.flatnonzero(np.arange(len(tau)) >= 5.0 * tau)
    return float(max(1.0, tau[window[0]] if len(window) else tau[-1]))


def dispersion(problem: Problem, residual: np.ndarray, least: float = LEAST) -> float:
    """Mean square times correlation time over all blocks, at least 1, and as if at least `least` readings counted."""
    total = 0.0
    for b in problem.obs.blocks:
        part = residual[b.place]
        total += float(part @ part) * correlation_time(part)
    most = float(residual @ residual) / max(1.0, min(least, len(residual)))
    return max(1.0, min(total / len(residual), most))


class Linear:
    """The linearised problem around a fit: whitened columns of unknowns and nuisances, the residual without them."""

    def __init__(
        self, problem: Problem, u: np.ndarray, model: np.ndarray, jacobian: np.ndarray, N: np.ndarray,
        rows: slice | np.ndarray = slice(None),
    ):  # fmt: skip
        w = 1.0 / problem.obs.floor[rows]
        self.A = np.concatenate([jacobian[rows], N[rows]], axis=1) * w[:, None]
        self.r = problem.obs.whiten(model)[rows]
        self.u = u
        self.gram, self.moment = self.A.T @ self.A, self.A.T @ self.r

    def with_column(self, k: int, column: np.ndarray) -> Linear:
        """The same with a whitened column inserted as unknown k, at u = 0."""
        made = Linear.__new__(Linear)
        made.A = np.insert(self.A, k, column, axis=1)
        made.r, made.u = self.r, np.append(self.u, 0.0)
        cross = made.A.T @ column
        made.gram = np.insert(np.insert(self.gram, k, 0.0, axis=0), k, 0.0, axis=1)
        made.gram[k, :] = made.gram[:, k] = cross
        made.moment = np.insert(self.moment, k, column @ self.r)
        return made

    def without(self, mask: np.ndarray) -> Linear:
        """The same without the entries of the mask, for `step` only."""
        made = Linear.__new__(Linear)
        made.A, made.r, made.u = self.A, self.r, self.u
        part, r = self.A[mask], self.r[mask]
        made.gram, made.moment = self.gram - part.T @ part, self.moment - part.T @ r
        return made

    def curvature(self, unknowns: Sequence[Unknown], phi: float) -> np.ndarray:
        """Half the second derivative of the cost by unknowns and nuisances (k + m, k + m), their priors included."""
        nuisances = self.A.shape[1] - len(unknowns)
        return self.gram / phi + np.diag([*(1.0 / x.sd**2 for x in unknowns), *[1.0] * nuisances])

    def step(self, unknowns: Sequence[Unknown], phi: float, radius: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(d, q): the change of u within bounds and radius that lowers the cost most, and the nuisances."""
        k, m = len(unknowns), self.A.shape[1] - len(unknowns)
        sd = np.array([x.sd for x in unknowns])
        H, g = self.curvature(unknowns, phi), self.moment / phi
        g[:k] -= self.u / sd**2
        low = np.maximum(np.array([x.low for x in unknowns]) - self.u, -radius)
        high = np.minimum(np.array([x.high for x in unknowns]) - self.u, radius)
        low, high = np.minimum(low, 0.0), np.maximum(high, 0.0)
        scale = 1.0 / np.sqrt(np.diag(H))
        L = np.linalg.cholesky(H * np.outer(scale, scale) + 1e-12 * np.eye(k + m))
        rhs = np.linalg.solve(L, g * scale)
        d = np.linalg.solve(L.T, rhs)
        lo = np.concatenate([low, np.full(m, -np.inf)]) / scale
        hi = np.concatenate([high, np.full(m, np.inf)]) / scale
        if np.any(d < lo) or np.any(d > hi):
            hi = np.where(hi - lo < 1e-12, lo + 1e-9, hi)
            d = lsq_linear(L.T, rhs, (lo, hi), method="bvls").x
        d = d * scale
        return d[:k], d[k:]

    def left(self, d: np.ndarray, q: np.ndarray) -> np.ndarray:
        """Predicted whitened residual."""
        return self.r - self.A @ np.concatenate([d, q])


def settle(problem: Problem, model: np.ndarray, N: np.ndarray, phi: float) -> tuple[np.ndarray, np.ndarray]:
    """Nuisances and whitened residual at a point."""
    lin = Linear(problem, np.zeros(0), model, np.zeros((len(model), 0)), N)
    _, q = lin.step((), phi, np.zeros(0))
    return q, lin.r - lin.A @ q


def difference_points(
    unknowns: Sequence[Unknown], u: np.ndarray, which: Sequence[int], difference: float
) -> list[tuple[int, float]]:
    """(index, step) of finite differences that stay within the bounds."""
    made = []
    for j in which:
        x = unknowns[j]
        h = min(difference, 0.5 * (x.high - x.low))
        made.append((j, h if u[j] + h <= x.high else -h))
    return made


def renew(
    J: np.ndarray, unknowns: Sequence[Unknown], u: np.ndarray, model: np.ndarray, which: Sequence[int],
    difference: float,
) -> Generator[list[Point], list[np.ndarray | None], None]:
    """Write the derivatives by some unknowns into J (n, k), by finite differences; a failing run gives the other side.

    A derivative that cannot be found on either side is zero.
    """
    steps = difference_points(unknowns, u, which, difference)
    names = [x.name for x in unknowns]

    def at(j: int, h: float) -> dict[str, float]:
        v = u.copy()
        v[j] += h
        return dict(zip(names, v.tolist(), strict=True))

    results = yield [at(j, h) for j, h in steps]
    again = []
    for (j, h), y in zip(steps, results, strict=True):
        J[:, j] = 0.0 if y is None else (y - model) / h
        if y is None:
            again.append((j, -0.25 * h))
    if again:
        again = [(j, h) for j, h in again if unknowns[j].low <= u[j] + h <= unknowns[j].high]
        results = (yield [at(j, h) for j, h in again]) if again else []
        for (j, h), y in zip(again, results, strict=True):
            if y is not None:
                J[:, j] = (y - model) / h


def fit(
    problem: Problem,
    unknowns: tuple[Unknown, ...],
    u: np.ndarray,
    N: np.ndarray,
    jacobian: np.ndarray,
    known: np.ndarray,
    iterations: int,
    model: np.ndarray | None = None,
    refreshes: int = 0,
    least: float = LEAST,
    difference: float = DIFFERENCE,
) -> Ask:
    """Lower the cost from u (k,) in at most that many iterations.

    jacobian (n, k) with known (k,) true where a column is usable; the others are found by finite differences first.
    Derivatives grow old as the fit moves: before it ends, all are found anew, at most `refreshes` times.
    """
    u = u.astype(float).copy()
    names = [x.name for x in unknowns]
    sd = np.array([x.sd for x in unknowns])

    def point(v: np.ndarray) -> dict[str, float]:
        return dict(zip(names, v.tolist(), strict=True))

    if model is None:
        for _ in range(4):
            model = (yield [point(u)])[0]
            if model is not None:
                break
            u *= 0.5
        else:
            raise FitFailed
    J = jacobian.copy()
    missing = np.flatnonzero(~known)
    if len(missing):
        yield from renew(J, unknowns, u, model, missing, difference)
    q, residual = settle(problem, model, N, 1.0)
    mine = dispersion(problem, residual, least)
    q, residual = settle(problem, model, N, mine)
    radius = np.array([1.0 if x.kind == "base" else max(1.0, abs(v)) for x, v in zip(unknowns, u, strict=True)])
    adaptive = np.array([x.kind != "base" for x in unknowns])
    converged, stale, small = False, False, 0
    seen_at, poor = u.copy(), False

    def gone_far() -> bool:
        return bool(np.any(np.abs(u - seen_at) / sd > MOVED))

    def cost(res: np.ndarray, v: np.ndarray, qq: np.ndarray, p: float) -> float:
        return float(res @ res / p + np.sum((v / sd) ** 2) + qq @ qq)

    for count in range(iterations):
        tired = small >= 2 or poor or count == iterations // 2
        if refreshes > 0 and tired and gone_far():
            yield from renew(J, unknowns, u, model, range(len(u)), difference)
            radius = np.maximum(radius, 0.5)
            refreshes, stale, small, poor, seen_at = refreshes - 1, False, 0, False, u.copy()
        if small >= 2:
            converged = True
            break
        lin = Linear(problem, u, model, J, N)
        d, dq = lin.step(unknowns, mine, radius)
        predicted = lin.left(d, dq)
        now = cost(residual, u, q, mine)
        gain = now - cost(predicted, u + d, dq, mine)
        if gain < 0.3:
            if refreshes > 0 and gone_far():
                small = 2
                continue
            if stale:  # the derivative is old where the fit moved: look again before giving up
                yield from renew(J, unknowns, u, model, np.flatnonzero(adaptive), difference)
                stale = False
                continue
            converged = True
            break
        trial = (yield [point(u + d)])[0]
        if trial is None:
            radius *= 0.3
            continue
        change = trial - model - J @ d
        weight = d / sd**2
        J += np.outer(change, weight) / float(weight @ d)
        q_new, res_new = settle(problem, trial, N, mine)
        real = now - cost(res_new, u + d, q_new, mine)
        if real > 0.0:
            u, model, q, residual = u + d, trial, q_new, res_new
            radius = np.where(real > 0.5 * gain, np.maximum(radius, 2.0 * np.abs(d)), radius)
            if real < 0.25 * gain:
                radius = np.maximum(0.5 * np.abs(d), 0.25 * radius)
            stale = stale or bool(np.any(np.abs(d[adaptive]) > 0.3))
            fresh = dispersion(problem, residual, least)
            if not 0.8 < fresh / mine < 1.25:
                mine = fresh
                q, residual = settle(problem, model, N, mine)
            small = small + 1 if real < 0.5 else 0
            poor = real < 0.6 * gain
        else:
            poor = True
            radius = 0.3 * np.maximum(np.abs(d), 1e-3)
            if refreshes == 0 and (stale or np.any(adaptive)):
                yield from renew(J, unknowns, u, model, np.flatnonzero(adaptive), difference)
                stale = False
    return Fit(unknowns, u, model, J, q, residual, mine, converged)


class FitFailed(Exception):
    """No point near the start of a fit could be simulated."""


def drive(problem: Problem, fits: Sequence[Ask]) -> list[Fit | None]:
    """Run fits side by side so that their simulations share the processes; None for one that failed."""
    results: list[Fit | None] = [None] * len(fits)
    waiting: dict[int, list[Point]] = {}

    def forward(i: int, answer: list[np.ndarray | None] | None) -> None:
        try:
            waiting[i] = next(fits[i]) if answer is None else fits[i].send(answer)
        except StopIteration as done:
            waiting.pop(i, None)
            results[i] = done.value
        except FitFailed:
            waiting.pop(i, None)

    for i in range(len(fits)):
        forward(i, None)
    while waiting:
        order = list(waiting)
        asked = [waiting[i] for i in order]
        answers = problem.evaluate([p for points in asked for p in points])
        place = 0
        for i, points in zip(order, asked, strict=True):
            forward(i, answers[place : place + len(points)])
            place += len(points)
    return results


def recorrect(fit: Fit, problem: Problem, exact: np.ndarray, N: np.ndarray) -> Fit:
    """The fit with its model replaced by a run at the package's step at the same point."""
    q, residual = settle(problem, exact, N, fit.phi)
    return replace(fit, model=exact, q=q, residual=residual)
