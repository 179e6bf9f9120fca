"""Bounded Gauss-Newton on whitened residuals, as a coroutine that asks for simulations so that fits run side by side.

Cost of a point:

    C(u) = sum(r^2) / s + sum((u / sd)^2) + sum(q^2),   r = (measured - model(u) - N q) / floor

q are the linear nuisances (a bias per channel, a clock error per run) with priors of their own, in closed form with u;
s is the dispersion of r where the step begins, at least 1: what a model misses is neither noise that it beats nor as
many readings as it lasts. So the base parameters stay near what is stated until there is something that they explain.

A valve that saturates a millisecond later moves a pressure by hundreds of floors for that millisecond. Such a residual
is followed only with the derivative at the point itself: differences are taken as small as the simulations are smooth
(`Problem.difference`), and anew where the last ones did not foretell a step. Within `FAR` of the floor each accepted
point is also run at the package's step, beside the long steps of the differences.

Stretches in which machine and model are out of step do not lead a fit (`shares`); once it has arrived without them, it
ends with all readings counting in full, from the point on its way that leaves least.
"""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import lsq_linear

from ...core.errors import SimulationError
from ..problem.noise import rms
from ..problem.problem import BIAS, BIAS_OF_LEVEL, CLOCK, Point, Problem, Unknown


@dataclass(frozen=True)
class Wanted:
    """Points to be simulated: at long steps, and at the package's step."""

    coarse: list[Point]
    exact: list[Point]


Answer = tuple[list[np.ndarray | None], list[np.ndarray | None]]

Ask = Generator[Wanted, Answer, "Fit"]
"""Yields points, is sent their long vectors, returns a fit."""

LEAST = 600.0
"""Readings that count at least in the dispersion, however long their residuals stay on one side."""

WIDE = 0.2
"""Step, in u, of differences that serve for larger moves: refits without a fold, intervals, or where a small step shows
nothing."""

ROUGH = 0.7
"""Change of a difference from one step to the next, as a share of it, from which runs are not smooth in an unknown."""

FAR = 10.0
"""Floors from which on the error of long steps does not matter."""

SLACK, SLOW = 0.001, 0.02
"""Step of a difference for each floor that is left beyond one, for far away the way is seen better by larger steps; and
the share of the cost that a step has to gain for them to be kept."""

WINDOW, OUTLYING = 0.5, 2.0
"""Time [s] over which a residual's RMS is taken, and times the channel's usual one that it may be to count in full."""

TRIALS, GAIN, GAINED, HOLDS = 4, 0.3, 2.0, 0.1
"""Steps that are tried from a point; the gain in cost below which a step is not worth a run; that below which the next
one will not be; and how nearly a step has to have done what was foretold for its derivatives to serve again."""


@dataclass
class Fit:
    """Where a fit stands: unknowns (k), u (k,), the model's long vector (n,), its derivative (n, k), what is left."""

    unknowns: tuple[Unknown, ...]
    u: np.ndarray
    model: np.ndarray
    jacobian: np.ndarray
    q: np.ndarray
    """The linear nuisances in prior standard deviations: a bias of each channel, then a clock error of each run."""
    channels: int
    residual: np.ndarray
    correction: np.ndarray
    """The model at the package's step less that at long steps, where it was last taken (n,)."""
    phi: float
    """Dispersion: what a squared residual counts for less because neighbours share it; at least 1."""
    converged: bool = False
    holds: bool = False
    """The derivatives have foretold the last step and serve for the next."""
    plain: bool = False
    """All readings count in full from here on."""

    @property
    def point(self) -> dict[str, float]:
        """The point in the problem's terms."""
        return point_of(self.unknowns, self.u)

    @property
    def rms(self) -> float:
        """Whitened RMS of the residual."""
        return rms(self.residual)

    def strain(self) -> float:
        """Sum of (u / sd)^2: how far the unknowns are from what is stated."""
        return penalty(self.unknowns, self.u)

    def penalty(self) -> float:
        """What unknowns and the sensors' biases cost: sum of (u / sd)^2 and q^2; clocks may differ as they like."""
        return penalty(self.unknowns, self.u, self.q[: self.channels])


def point_of(unknowns: Sequence[Unknown], u: np.ndarray) -> dict[str, float]:
    """The point at u (k,) in the problem's terms."""
    return {x.name: v for x, v in zip(unknowns, u.tolist(), strict=True)}


def penalty(unknowns: Sequence[Unknown], u: np.ndarray, biases: np.ndarray | None = None) -> float:
    """What unknowns at u (k,) and sensors' biases cost: their squares in prior standard deviations."""
    strain = float(sum((v / x.sd) ** 2 for x, v in zip(unknowns, u, strict=True)))
    return strain if biases is None else strain + float(biases @ biases)


def nuisances(problem: Problem, model: np.ndarray) -> np.ndarray:
    """Columns (n, m) of the linear nuisances, in the unit of the readings for one prior standard deviation each."""
    obs = problem.obs
    columns = []
    for k in range(len(obs.span)):
        columns.append(np.where(obs.channel == k, bias(problem, k), 0.0))
    slope = obs.slope(model)
    for r in range(len(problem.runs)):
        columns.append(np.where(obs.run == r, -clock(problem, r) * slope, 0.0))
    return np.stack(columns, axis=1)


def bias(problem: Problem, channel: int) -> float:
    """Usual bias of a channel, in its unit."""
    obs = problem.obs
    return float(max(BIAS * obs.span[channel], BIAS_OF_LEVEL * obs.level[channel]))


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


def shares(problem: Problem, residual: np.ndarray) -> np.ndarray:
    """By how much each reading of a residual (n,) counts in the next step, from 0 to 1.

    Where a machine swings or rests a second longer than the model, the residual is large whatever the parameters are,
    and says nothing about the way to go: there, where its RMS over `WINDOW` is more than `OUTLYING` times the channel's
    usual one, and more than as many floors, it counts no more than that. (An M-estimator with weights of windows.)
    """
    obs = problem.obs
    local = np.abs(residual)
    for b in obs.blocks:
        m = min(len(b.t), 1 + round(WINDOW / b.interval)) if b.interval > 0.0 else 1
        if m > 1:
            ones = np.ones(m)
            power = np.convolve(residual[b.place] ** 2, ones, "same") / np.convolve(np.ones(len(b.t)), ones, "same")
            local[b.place] = np.sqrt(power)
    made = np.ones(len(residual))
    for k in range(len(obs.span)):
        mine = obs.channel == k
        if not mine.any():
            continue
        usual = OUTLYING * max(1.0, float(np.median(local[mine])))
        made[mine] = np.minimum(1.0, usual / np.maximum(local[mine], usual))
    return made


class Linear:
    """The linearised problem around a fit: whitened columns of unknowns and nuisances, the residual without them."""

    def __init__(
        self, problem: Problem, u: np.ndarray, model: np.ndarray, jacobian: np.ndarray, N: np.ndarray,
        rows: slice | np.ndarray = slice(None), share: np.ndarray | float = 1.0,
    ):  # fmt: skip
        w = np.broadcast_to(share / problem.obs.floor, problem.obs.floor.shape)[rows]
        self.A = np.concatenate([jacobian[rows], N[rows]], axis=1) * w[:, None]
        self.r = (problem.obs.y - model)[rows] * w
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


def settle(
    problem: Problem, model: np.ndarray, N: np.ndarray, phi: float, share: np.ndarray | float = 1.0
) -> tuple[np.ndarray, np.ndarray]:
    """Nuisances and whitened residual at a point, of which each reading counts with its share."""
    lin = Linear(problem, np.zeros(0), model, np.zeros((len(model), 0)), N, share=share)
    _, q = lin.step((), phi, np.zeros(0))
    return q, lin.r - lin.A @ q


def differences(
    problem: Problem, unknowns: Sequence[Unknown], u: np.ndarray, which: Sequence[int], h: float, here: np.ndarray
) -> Generator[Wanted, Answer, np.ndarray]:
    """Derivatives (n, len(which)) by some unknowns from runs at long steps; here (n,) is the run at u itself.

    A run that fails gives way to one on the other side; a derivative that cannot be found, or that is nothing even for
    a wide step, is zero. A controller's sampling time moves every one of its instants: of such an effect (`ROUGH`) only
    wide steps tell the way.
    """

    def moved(j: int, step: float) -> Point:
        v = u.copy()
        v[j] += step
        return point_of(unknowns, v)

    columns = np.zeros((len(here), len(which)))
    rough = {c for c, j in enumerate(which) if not problem.smooth.get(unknowns[j].name, True)}
    sizes = {c: max(h, WIDE) if c in rough else h for c in range(len(which))}
    effects = [c for c, j in enumerate(which) if unknowns[j].kind == "effect"]
    unseen = [c for c in effects if unknowns[which[c]].name not in problem.smooth]
    for attempt in range(3):
        steps, points = {}, []
        for c, size in sizes.items():
            j = which[c]
            low, high = unknowns[j].low - u[j], unknowns[j].high - u[j]
            size = min(size, 0.5 * (high - low))
            forward = size <= high and (attempt != 1 or -size < low)
            steps[c] = size if forward else -size
            points.append(moved(j, steps[c]))
        seen = unseen if attempt == 0 else []
        d = problem.difference
        small = [d if u[which[c]] + 2.0 * d <= unknowns[which[c]].high else -d for c in seen]
        points += [moved(which[c], k * s) for c, s in zip(seen, small, strict=True) for k in (1.0, 2.0)]
        results, _ = yield Wanted(points, [])
        again = {}
        for c, one, two in zip(seen, results[len(steps) :: 2], results[len(steps) + 1 :: 2], strict=True):
            if one is not None and two is not None and np.any(one - here):
                first, second = ((y - z) / problem.obs.floor for y, z in ((one, here), (two, one)))
                problem.smooth[unknowns[which[c]].name] = rms(second - first) <= ROUGH * rms(first)
        for (c, step), y in zip(steps.items(), results, strict=False):
            if y is None:
                again[c] = abs(step)
                continue
            columns[:, c] = (y - here) / step
            known = problem.smooth.get(unknowns[which[c]].name, True)
            if (not np.any(columns[:, c]) or not known) and abs(step) < WIDE:
                again[c] = WIDE
        sizes = again
        if not sizes:
            break
    return columns


def fit(
    problem: Problem,
    unknowns: tuple[Unknown, ...],
    u: np.ndarray,
    N: np.ndarray,
    iterations: int,
    like: Fit | None = None,
    at: Fit | None = None,
) -> Ask:
    """Lower the cost from u (k,), in at most that many iterations without outlying stretches and as many with them.

    like: a fit of the first of the unknowns nearby; its derivatives and its correction are kept, and only the other
    unknowns' are found. That is cheap, and enough to see whether an effect is worth more.
    at: a fit at u that is to go on.
    """
    if at is None or not at.plain:
        led, (u, model, correction) = yield from _descend(problem, unknowns, u, N, iterations, like, at)
        if like is not None or not led.converged or np.all(shares(problem, led.residual) == 1.0):
            return led
        at = replace(led, u=u, model=model, correction=correction, holds=False, plain=True)
    return (yield from _descend(problem, unknowns, u, N, iterations, None, at))[0]


def lead(problem: Problem, unknowns: tuple[Unknown, ...], u: np.ndarray, N: np.ndarray, iterations: int) -> Ask:
    """The first half of `fit`, for a start of another: without outlying stretches only."""
    return (yield from _descend(problem, unknowns, u, N, iterations, None, None))[0]


def _descend(
    problem: Problem, unknowns: tuple[Unknown, ...], u: np.ndarray, N: np.ndarray, iterations: int,
    like: Fit | None, at: Fit | None,
) -> Generator[Wanted, Answer, tuple[Fit, tuple[np.ndarray, np.ndarray, np.ndarray]]]:
    """Where the iterations of `fit` end; and (u, model, correction) where they left least on their way."""
    u = u.astype(float).copy()
    sd = np.array([x.sd for x in unknowns])
    old = 0 if like is None else len(like.unknowns)

    def cost(res: np.ndarray, v: np.ndarray, q: np.ndarray, s: float) -> float:
        return float(res @ res / s + np.sum((v / sd) ** 2) + q @ q)

    if at is not None:
        coarse, correction = at.model - at.correction, at.correction
    else:
        for _ in range(TRIALS):
            coarse = (yield Wanted([point_of(unknowns, u)], []))[0][0]
            if coarse is not None:
                break
            u *= 0.5
        else:
            raise FitFailed
        correction = np.zeros(len(coarse)) if like is None else like.correction
    model = coarse + correction
    q, residual = settle(problem, model, N, 1.0)
    J = np.zeros((len(model), len(u)))
    if like is not None:
        J[:, :old] = like.jacobian
    holds = at is not None and at.holds  # whether the derivatives have foretold the last step
    if holds:
        J[:] = at.jacobian
    exact = like is not None or holds  # whether the correction is that of u, or need not be
    plain = at is not None and at.plain
    least, passed = rms(residual), (u, model, correction)
    radius = np.array([1.0 if x.kind == "base" else max(1.0, abs(v)) for x, v in zip(unknowns, u, strict=True)])
    fine = arrived = better = False
    real = 0.0
    for i in range(iterations):
        if i and problem.hurry():
            break
        if not exact and rms(residual) < FAR:
            model = (yield Wanted([], [point_of(unknowns, u)]))[1][0]
            if model is None:
                raise FitFailed
            correction, exact = model - coarse, True
            q, residual = settle(problem, model, N, 1.0)
        share = np.ones(len(residual)) if plain else shares(problem, residual)
        s = dispersion(problem, share * residual)
        h = problem.difference
        if not fine:
            h = float(np.clip(SLACK * (rms(share * residual) - 1.0), h, WIDE))
            fine = h == problem.difference
        if not holds:
            J[:, old:] = yield from differences(problem, unknowns, u, range(old, len(u)), h, coarse)
        q, shared = settle(problem, model, N, s, share)
        lin, now = Linear(problem, u, model, J, N, share=share), cost(shared, u, q, s)
        arrived = better = False
        for _ in range(1 if holds else TRIALS):
            d, dq = lin.step(unknowns, s, radius)
            gain = now - cost(lin.left(d, dq), u + d, dq, s)
            arrived = gain < GAIN
            if arrived:
                break
            both = exact and like is None
            wanted = [point_of(unknowns, u + d)]
            there, exactly = yield Wanted(wanted, wanted if both else [])
            if there[0] is None or (both and exactly[0] is None):
                radius = 0.3 * np.minimum(radius, np.maximum(np.abs(d), 1e-3))
                continue
            trial = exactly[0] if both else there[0] + correction
            q_new, res_new = settle(problem, trial, N, s, share)
            real = now - cost(res_new, u + d, q_new, s)
            better = real > 0.0
            if better:
                u, q, shared, coarse, model = u + d, q_new, res_new, there[0], trial
                correction = model - coarse
                if real > 0.5 * gain:
                    radius = np.maximum(radius, 2.0 * np.abs(d))
                break
            if not holds:
                radius = 0.3 * np.maximum(np.abs(d), 1e-3)
        residual = shared / share
        if rms(residual) < least:
            least, passed = rms(residual), (u, model, correction)
        slow = arrived or not (better or holds) or (better and 0.5 * gain < real < max(GAINED, SLOW * now * (not fine)))
        if slow and fine:
            break
        fine = fine or slow
        holds = better and not slow and abs(real / gain - 1.0) < HOLDS
    converged = fine and (arrived or (better and real < GAINED))
    phi, channels = dispersion(problem, residual), len(problem.obs.span)
    return Fit(unknowns, u, model, J, q, channels, residual, correction, phi, converged, holds, plain), passed


def wide(problem: Problem, at: Fit, N: np.ndarray) -> Ask:
    """The fit where it stands, run at the package's step, with derivatives that serve for larger moves."""
    every, coarse = range(len(at.u)), at.model - at.correction
    J = yield from differences(problem, at.unknowns, at.u, every, WIDE, coarse)
    model = (yield Wanted([], [at.point]))[1][0]
    if model is None:
        raise FitFailed
    q, residual = settle(problem, model, N, at.phi)
    return replace(at, jacobian=J, model=model, correction=model - coarse, q=q, residual=residual, holds=False)


class FitFailed(Exception):
    """No point near the start of a fit could be simulated."""


def drive(problem: Problem, fits: Sequence[Ask]) -> list[Fit | None]:
    """Run fits side by side so that their simulations share the processes; None for one that failed."""
    results: list[Fit | None] = [None] * len(fits)
    waiting: dict[int, Wanted] = {}

    def forward(i: int, answer: Answer | None) -> None:
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
        asked = dict(waiting)
        coarse, exact = problem.answer(
            [p for w in asked.values() for p in w.coarse], [p for w in asked.values() for p in w.exact]
        )
        for i, w in asked.items():
            mine = coarse[: len(w.coarse)], exact[: len(w.exact)]
            coarse, exact = coarse[len(w.coarse) :], exact[len(w.exact) :]
            forward(i, mine)
    return results


def went(problem: Problem, ask: Ask) -> Fit:
    """The outcome of one fit; raises `SimulationError` where no point near its start can be simulated."""
    found = drive(problem, [ask])[0]
    if found is None:
        raise SimulationError(f"{problem.campaign.system.name}: a refit cannot be simulated: {problem.failure}")
    return found
