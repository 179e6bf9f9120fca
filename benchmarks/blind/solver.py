"""RODAS, a Rosenbrock method of order 4 with error control and dense output, for the plant.

Coefficients: Hairer & Wanner (1996), Solving Ordinary Differential Equations II, section IV.7 and their code RODAS.
The Jacobian is a forward difference; states inside the lines, which act only on their neighbours, share evaluations.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .compiled import kernel
from .lines import LINE_A, LINE_B
from .machine import SEGMENTS
from .system import RUN, SETTLE, STATES, controller, derivative, linkage, outputs, rod

GAMMA = 0.25
A = np.array([
    [0.0, 0.0, 0.0, 0.0, 0.0],
    [1.544, 0.0, 0.0, 0.0, 0.0],
    [0.9466785280815826, 0.2557011698983284, 0.0, 0.0, 0.0],
    [3.314825187068521, 2.896124015972201, 0.9986419139977817, 0.0, 0.0],
    [1.221224509226641, 6.019134481288629, 12.53708332932087, -0.6878860361058950, 0.0],
    [1.221224509226641, 6.019134481288629, 12.53708332932087, -0.6878860361058950, 1.0],
])  # fmt: skip
C = np.array([
    [0.0, 0.0, 0.0, 0.0, 0.0],
    [-5.6688, 0.0, 0.0, 0.0, 0.0],
    [-2.430093356833875, -0.2063599157091915, 0.0, 0.0, 0.0],
    [-0.1073529058151375, -9.594562251023355, -20.47028614809616, 0.0, 0.0],
    [7.496443313967647, -10.24680431464352, -33.99990352819905, 11.70890893206160, 0.0],
    [8.083246795921522, -7.981132988064893, -31.52159432874371, 16.31930543123136, -6.058818238834054],
])  # fmt: skip
ALPHA = np.array([0.0, 0.386, 0.21, 0.63, 1.0, 1.0])
GAMMA_T = np.array([0.25, -0.1043, 0.1035, -0.0362, 0.0, 0.0])
D = np.array([
    [10.12623508344586, -7.487995877610167, -34.80091861555747, -7.992771707568823, 1.025137723295662],
    [-0.6762803392806898, 6.087714651680015, 16.43084320892478, 24.76722511418386, -6.594389125716872],
])  # fmt: skip

OK, TOO_MANY_STEPS, NO_REST = 0, 1, 2


def kinds(position: float, velocity: float, pressure: float, angle: float, rate: float, current: float, flow: float):
    """One number per state from one number per kind of state."""
    line = [pressure, flow] * SEGMENTS + [pressure]
    share = 1e-2 * current
    extra = [share, 100 * share, *4 * [current], pressure, share, position, angle, rate]
    later = [share, 0.1 * position, velocity, flow, flow, flow, pressure, flow, *6 * [flow]]
    return np.array([position, velocity, pressure, angle, rate, current, *line, *line, *extra, *later])


DIFFERENCE = kinds(1e-7, 1e-5, 100.0, 1e-7, 1e-6, 1e-4, 1e-9)
ATOL = kinds(1e-7, 1e-6, 100.0, 1e-8, 1e-7, 1e-5, 1e-9)


@kernel
def jacobian(t: float, y, c, piece: int, mode: int, held: float, step, active, f0, work, J) -> None:
    """Write the derivative of the rates by the active states into J (m, m); f0: the rates at y."""
    z, f = work[0], work[1]
    z[:] = y
    m = active.size
    J[:m, :m] = 0.0
    inner = 2 * SEGMENTS - 1 if c.history == 0.0 else 0  # a flow's history acts on all its line
    for colour in range(3):
        for i in range(colour, inner, 3):
            for first in (LINE_A, LINE_B):
                z[first + 1 + i] = y[first + 1 + i] + step[first + 1 + i]
        derivative(t, z, c, piece, mode, held, f)
        for i in range(colour, inner, 3):
            for first in (LINE_A, LINE_B):
                k = first + 1 + i
                for row in range(k - 1, k + 2):
                    J[row, k] = (f[row] - f0[row]) / (z[k] - y[k])
                z[k] = y[k]
    for j in range(m):
        k = active[j]
        if LINE_A < k < LINE_A + inner + 1 or LINE_B < k < LINE_B + inner + 1:
            continue
        z[k] = y[k] + step[k]
        derivative(t, z, c, piece, mode, held, f)
        for i in range(m):
            J[i, j] = (f[active[i]] - f0[active[i]]) / (z[k] - y[k])
        z[k] = y[k]


@kernel
def factor(M, m: int, pivot) -> None:
    """LU decomposition of M (m, m) in place with row exchanges."""
    for k in range(m):
        best = k
        for i in range(k + 1, m):
            if abs(M[i, k]) > abs(M[best, k]):
                best = i
        pivot[k] = best
        if best != k:
            for j in range(m):
                M[k, j], M[best, j] = M[best, j], M[k, j]
        for i in range(k + 1, m):
            if M[i, k] != 0.0:
                q = M[i, k] / M[k, k]
                M[i, k] = q
                for j in range(k + 1, m):
                    M[i, j] -= q * M[k, j]


@kernel
def substitute(M, m: int, pivot, b) -> None:
    """Solve with the decomposition; b (m,) is overwritten by the solution."""
    for k in range(m):
        if pivot[k] != k:
            b[k], b[pivot[k]] = b[pivot[k]], b[k]
    for i in range(1, m):
        s = b[i]
        for j in range(i):
            s -= M[i, j] * b[j]
        b[i] = s
    for i in range(m - 1, -1, -1):
        s = b[i]
        for j in range(i + 1, m):
            s -= M[i, j] * b[j]
        b[i] = s / M[i, i]


@kernel
def rest(y, c, step, active) -> bool:
    """Bring y to the state at rest at x_h = 0: implicit Euler with growing steps, the arm held, the integral free."""
    nan = float("nan")
    m = active.size
    J, work = np.empty((m, m)), np.empty((2, STATES))
    f0, b, pivot = np.zeros(STATES), np.empty(m), np.empty(m, np.int64)
    h = 1e-4
    for _ in range(200):
        derivative(0.0, y, c, 0, SETTLE, nan, f0)
        jacobian(0.0, y, c, 0, SETTLE, nan, step, active, f0, work, J)
        for i in range(m):
            b[i] = f0[active[i]]
            for j in range(m):
                J[i, j] = -J[i, j]
            J[i, i] += 1.0 / h
        factor(J, m, pivot)
        substitute(J, m, pivot, b)
        change = 0.0
        for i in range(m):
            change = max(change, abs(b[i]) / (1e3 * step[active[i]]))
        if not change < 1e300:
            return False
        if change > 300.0:
            h *= 0.25
            continue
        for i in range(m):
            y[active[i]] += b[i]
        if h > 1e4 and change < 1e-4:
            return True
        h = min(h * (3.0 if change < 30.0 else 1.2), 1e6)
    return False


class Room(NamedTuple):
    """Arrays that a step of `integrate` writes into, for m active of all states."""

    J: np.ndarray
    M: np.ndarray
    """The Jacobian and the matrix of the stages, decomposed, (m, m)."""
    pivot: np.ndarray
    """Its row exchanges (m,)."""
    f0: np.ndarray
    ft: np.ndarray
    """The rates at the start of the step, and how they change with time alone (STATES,)."""
    k: np.ndarray
    """The stages (6, m)."""
    z: np.ndarray
    new: np.ndarray
    """The last stage's state, and the state at the end of the step (STATES,)."""
    work: np.ndarray
    """For differences, (2, STATES)."""


@kernel
def room(y, m: int):
    """Room for m active states, none of which has moved from y."""
    return Room(
        np.empty((m, m)), np.empty((m, m)), np.empty(m, np.int64), np.zeros(STATES), np.empty(STATES),
        np.zeros((6, m)), y.copy(), y.copy(), np.empty((2, STATES)),
    )  # fmt: skip


@kernel
def linearise(t: float, y, c, piece: int, held: float, step, active, r) -> None:
    """Write rates, their change with time, and the Jacobian at t into the `Room` r."""
    dt = 1e-6
    derivative(t, y, c, piece, RUN, held, r.f0)
    jacobian(t, y, c, piece, RUN, held, step, active, r.f0, r.work, r.J)
    derivative(t + dt, y, c, piece, RUN, held, r.ft)
    for i in range(STATES):
        r.ft[i] = (r.ft[i] - r.f0[i]) / dt


@kernel
def take_stages(t: float, h: float, y, c, piece: int, held: float, active, r) -> None:
    """Write the stages of a step of h [s] from y, and the last one's state, into the `Room` r."""
    m = active.size
    M, k, z = r.M, r.k, r.z
    f = r.work[1]
    for i in range(m):
        for j in range(m):
            M[i, j] = -r.J[i, j]
        M[i, i] += 1.0 / (GAMMA * h)
    factor(M, m, r.pivot)
    for stage in range(6):
        if stage > 0:
            z[:] = y
            for s in range(stage):
                if A[stage, s] != 0.0:
                    for i in range(m):
                        z[active[i]] += A[stage, s] * k[s, i]
            derivative(t + ALPHA[stage] * h, z, c, piece, RUN, held, f)
        else:
            f[:] = r.f0
        b = k[stage]
        for i in range(m):
            v = f[active[i]] + GAMMA_T[stage] * h * r.ft[active[i]]
            for s in range(stage):
                v += C[stage, s] / h * k[s, i]
            b[i] = v
        substitute(M, m, r.pivot, b)


@kernel
def finish(y, active, rtol: float, atol, r) -> float:
    """Write the state at the end of the step into the `Room` r; returns the estimated error, in tolerances."""
    m, new = active.size, r.new
    error = 0.0
    new[:] = y
    for i in range(m):
        a = active[i]
        new[a] = r.z[a] + r.k[5, i]
        error += (r.k[5, i] / (atol[a] + rtol * max(abs(y[a]), abs(new[a])))) ** 2
    error = np.sqrt(error / m)
    return error if error < 1e300 else 1e4


@kernel
def within(s: float, y, active, r, z) -> None:
    """Write the state at the share s of a step from y into z: the method's dense output."""
    z[:] = y
    for i in range(active.size):
        c2, c3 = 0.0, 0.0
        for j in range(5):
            c2 += D[0, j] * r.k[j, i]
            c3 += D[1, j] * r.k[j, i]
        a = active[i]
        z[a] = (1.0 - s) * y[a] + s * (r.new[a] + (1.0 - s) * (c2 + s * c3))


@kernel
def sampled(t: float, y, c, piece: int) -> float:
    """The controller's output at t."""
    length, length1, _, _, _, _ = linkage(c, y[3])
    x, v = rod(c, y, length - c.length0, length1 * y[4])
    return controller(c, piece, t, x, v, y[5])[0]


@kernel
def integrate(c, y, times, corners, step, active, rtol: float, atol, most: int, out) -> tuple[int, int]:
    """Integrate from y at t = 0 and write the outputs at `times` into out; returns the status and the number of steps.

    The integration restarts at the corners of the command and at the controller's sampling times.
    """
    r = room(y, active.size)
    t, h, steps, row, rejected = 0.0, 1e-3, 0, 0, False
    end = times[-1]
    piece, held, tick = 0, float("nan"), 0
    while row < times.size and times[row] <= 0.0:
        outputs(0.0, y, c, 0, held, out[row])
        row += 1
    while t < end:
        # what bounds this stretch, and the controller's output in it
        while piece < 4 and t >= corners[piece] - 1e-12:
            piece += 1
        stop = min(end, corners[piece]) if piece < 4 else end
        if c.sampling > 0.0:
            if t >= tick * c.sampling - 1e-12:
                held = sampled(t, y, c, piece)
                tick += 1
            stop = min(stop, tick * c.sampling)
        while t < stop - 1e-12:
            steps += 1
            if steps > most:
                return TOO_MANY_STEPS, steps
            last = h >= stop - t
            if last:
                h = stop - t
            elif h > 0.5 * (stop - t):
                h = 0.5 * (stop - t)
            if not rejected:
                linearise(t, y, c, piece, held, step, active, r)
            take_stages(t, h, y, c, piece, held, active, r)
            error = finish(y, active, rtol, atol, r)
            change = min(max(0.9 / max(error, 1e-10) ** 0.25, 0.2), 4.0)
            if error > 1.0:
                rejected = True
                h *= change
                if h < 1e-10:
                    return TOO_MANY_STEPS, steps
                continue
            reached = stop if last else t + h
            while row < times.size and times[row] <= reached:
                within((times[row] - t) / h, y, active, r, r.z)
                outputs(times[row], r.z, c, piece, held, out[row])
                row += 1
            y[:] = r.new
            if rejected:
                change = min(change, 1.0)
            rejected = False
            if not last or change < 1.0:
                h *= change
            elif c.sampling > 0.0:
                h = c.sampling
            t = reached
    return OK, steps
