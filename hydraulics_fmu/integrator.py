"""Error-controlled stiff integration of the circuit over one communication step (Rosenbrock-W, see `tableau`).

The Jacobian is built from differences, one evaluation per border state and three for the whole chain, and kept for
several steps, which a W-method allows without loss of order; the step is cut at the corners of the built-in command.
All memory of an instance is the state `y` and the workspace `w` (see `workspace`), so both together are what has to be
saved and restored.
"""

from __future__ import annotations

from typing import NamedTuple

from ..core.jit import inlined, kernel
from .bordered import factorise, flow_of, solve
from .circuit import derivatives
from .controller import command, command_rate
from .line import LAGS
from .tableau import GAMMA, NODES, STAGES, A, C, E, M
from .workspace import AGE, FACTORED, STEP, factors_in, jacobian_in, scratch_in

MAX_AGE = 20
MAX_STEPS = 200_000

OK, TOO_SMALL, TOO_MANY = 0, 1, 2
"""What `advance` returns: done; the step fell below what time resolves; too many steps."""


@kernel
def next_corner(s: float, h: float, t_0: float, c: object) -> float:
    """The next corner of the built-in command after t_0 + s [s], as time since t_0; h when that comes first."""
    corner = c.command.t_start - t_0
    margin = 1e-9 * h + 1e-15 * abs(t_0)
    if c.command.use_input == 0.0:
        for i in range(4):
            if s + margin < corner < h - margin:
                return corner
            corner += c.command.hold_time if i == 1 else c.command.ramp_time
    return h


class Motion(NamedTuple):
    """What drives the circuit from a time on: all of it moves on in straight lines."""

    s: float
    """That time, counted from the start of the communication step [s]."""
    x_0: float
    v_h: float
    """The eye at the start of the communication step [m], and its velocity [m/s]."""
    x_cmd: float
    v_cmd: float
    """The command at time s [m], and its rate [m/s]."""


@inlined
def rates(y: object, c: object, motion: object, dt: float, memory: object, f: object) -> None:
    """Write dy/dt into f, dt [s] after the motion's time.

    A controller output that is not continuous is u + u_rate (t - t_0) [mA] of the memory; otherwise its u is NaN.
    """
    s = motion.s + dt
    x_cmd, held = motion.x_cmd + motion.v_cmd * dt, memory.u + memory.u_rate * s
    derivatives(y, c, motion.x_0 + motion.v_h * s, motion.v_h, x_cmd, motion.v_cmd, held, memory, f)


@kernel
def move(y: object, scale: object, which: object, moved: object) -> None:
    """Move these states away from y, by what differences are taken over."""
    for i in which:
        moved[i] = y[i] + 1e-7 * (abs(y[i]) + scale[i])


@kernel
def differentiate(y: object, scale: object, c: object, motion: object, memory: object, J: object, own: object) -> None:
    """Write the Jacobian at y into J, from differences to the rates there, which are `own.U[0]`."""
    nc, m = J.B.shape
    nb, ny = nc + m, len(y)
    moved, f = own.moved, own.f
    for first in range(3):  # of the chain's states every third one: a rate feels its neighbours only
        move(y, scale, range(first, nc, 3), moved)
        rates(moved, c, motion, 0.0, memory, f)
        chain_columns(y, first, J, own)
    for j in range(m):
        move(y, scale, range(nc + j, nc + j + 1), moved)
        rates(moved, c, motion, 0.0, memory, f)
        border_column(y, j, J, own)
    for first in range(LAGS if ny > nb else 0):  # a lag acts on its own flow only
        move(y, scale, range(nb + first, ny, LAGS), moved)
        rates(moved, c, motion, 0.0, memory, f)
        lag_columns(y, first, J, own)
    # the lines meet only in the border
    J.sub[nc // 2] = 0.0
    J.sup[nc // 2 - 1] = 0.0


@kernel
def chain_columns(y: object, first: int, J: object, own: object) -> None:
    """Every third column of the chain, by the states that have been moved, and move them back."""
    nc, f0, f, moved = len(J.dia), own.U[0], own.f, own.moved
    for i in range(first, nc, 3):
        d = moved[i] - y[i]
        moved[i] = y[i]
        J.dia[i] = (f[i] - f0[i]) / d
        if i > 0:
            J.sup[i - 1] = (f[i - 1] - f0[i - 1]) / d
        if i < nc - 1:
            J.sub[i + 1] = (f[i + 1] - f0[i + 1]) / d
        for e in range(len(J.port)):
            if J.port[e] == i:
                J.feed[e] = (f[nc + e] - f0[nc + e]) / d


@kernel
def border_column(y: object, j: int, J: object, own: object) -> None:
    """Likewise a column of the border."""
    (nc, m), f0, f, moved = J.B.shape, own.U[0], own.f, own.moved
    d = moved[nc + j] - y[nc + j]
    moved[nc + j] = y[nc + j]
    for k in range(nc):
        J.B[k, j] = (f[k] - f0[k]) / d
    for k in range(m):
        J.D[k, j] = (f[nc + k] - f0[nc + k]) / d


@kernel
def lag_columns(y: object, first: int, J: object, own: object) -> None:
    """Likewise a lag of every flow."""
    (nc, m), f0, f, moved = J.B.shape, own.U[0], own.f, own.moved
    for i in range(first, len(J.pull), LAGS):
        w, k = nc + m + i, flow_of(i // LAGS, nc)
        d = moved[w] - y[w]
        moved[w] = y[w]
        J.pull[i], J.follow[i] = (f[k] - f0[k]) / d, (f0[w] - f[w]) / d


@inlined
def take_stages(
    y: object, w: object, scale: object, c: object, motion: object, step: float, memory: object, own: object
) -> None:
    """Write the stages of a step [s] from y into `own.U`, with a Jacobian that is new where the old one is too old."""
    J, factors = jacobian_in(w, c), factors_in(w, c)
    ny, U, z = len(y), own.U, own.moved
    sigma = 1.0 / (step * GAMMA)
    for s in range(STAGES):
        for i in range(ny):
            z[i] = y[i]
        for q in range(s):
            share = A[s, q]
            for i in range(ny):
                z[i] += share * U[q, i]
        rates(z, c, motion, NODES[s] * step, memory, U[s])
        if s == 0:
            if w[AGE] < 0.0 or w[AGE] >= MAX_AGE:
                differentiate(y, scale, c, motion, memory, J, own)
                w[AGE] = 0.0
                w[FACTORED] = 0.0
            if abs(w[FACTORED] - sigma) > 1e-9 * sigma:
                factorise(J, sigma, factors)
                w[FACTORED] = sigma
        for q in range(s):
            share = C[s, q] / step
            for i in range(ny):
                U[s, i] += share * U[q, i]
        solve(J, sigma, factors, U[s])


@kernel
def estimated_error(U: object, scale: object) -> float:
    """The largest error over all states, each divided by its scale."""
    error = 0.0
    for i in range(len(scale)):
        e = abs(E[0] * U[0, i] + E[1] * U[1, i] + E[2] * U[2, i] + E[3] * U[3, i]) / scale[i]
        if not (e <= error):  # also true for NaN, which must not pass
            error = e
    return error


@kernel
def length_of_try(proposed: float, left: float) -> float:
    """The step to try [s] where so much is left: no tiny one is left for the end."""
    if proposed >= 0.999999 * left:
        return left
    return 0.5 * left if proposed > 0.5 * left else proposed


@kernel
def after_success(step: float, error: float, proposed: float, left: float) -> float:
    """The step to propose [s] after one with that error, in tolerances."""
    proposal = step * min(0.9 * (1.0 / max(error, 1e-6)) ** (1.0 / 3.0), 4.0)
    # a step cut short by the end says nothing against a longer one
    return proposal if step < left else max(proposal, min(proposed, 2.0 * proposal))


@kernel
def after_failure(step: float, error: float) -> float:
    """The step to propose [s] after one whose error, in tolerances, was above 1."""
    return step * (max(0.2, 0.9 * (1.0 / error) ** (1.0 / 3.0)) if error < 1e30 else 0.1)


@kernel
def advance(
    y: object, w: object, c: object, scale: object,
    t_0: float, h: float, x_0: float, v_h: float, x_ref: float, ref_rate: float, memory: object,
) -> int:  # fmt: skip
    """Advance y in place from t_0 over h [s]; the rod moves as x_0 + v_h (t - t_0), the input command likewise.

    Returns OK, or TOO_SMALL or TOO_MANY with y as it was. The error (`estimated_error`) is kept below the relative
    tolerance `solver.rtol` in every step.
    """
    own = scratch_in(w, len(y))
    U, y_0 = own.U, own.y_0
    for i in range(len(y)):
        y_0[i] = y[i]
    if w[STEP] <= 0.0:
        w[STEP] = 1e-5
    s = 0.0  # time since t_0, so that neither large times nor short steps lose digits
    fault, failed = TOO_MANY, False
    for _ in range(MAX_STEPS):
        if s >= h:
            return OK
        stop = next_corner(s, h, t_0, c)
        left = stop - s
        step = length_of_try(w[STEP], left)
        # the command is linear up to its next corner, so its rate is a difference
        v_cmd = command_rate(t_0 + s + 0.5 * left, ref_rate, c)
        motion = Motion(s, x_0, v_h, command(t_0 + s, t_0, x_ref, ref_rate, c), v_cmd)
        take_stages(y, w, scale, c, motion, step, memory, own)
        error = estimated_error(U, scale) / c.solver.rtol
        if error <= 1.0:
            for i in range(len(y)):
                y[i] += M[0] * U[0, i] + M[1] * U[1, i] + M[2] * U[2, i] + M[3] * U[3, i]
            s = stop if step == left else s + step
            w[AGE] += 1.0
            w[STEP] = after_success(step, error, w[STEP], left)
            failed = False
            continue
        w[STEP] = after_failure(step, error)
        if w[STEP] < min(1e-14, 1e-9 * h):
            fault = TOO_SMALL
            break
        if failed and w[AGE] > 0.0:  # a shorter step alone does not do: the fault may be the old Jacobian's
            w[AGE] = -1.0
        failed = True
    for i in range(len(y)):
        y[i] = y_0[i]
    w[STEP] = 0.0
    w[AGE] = -1.0
    return fault
