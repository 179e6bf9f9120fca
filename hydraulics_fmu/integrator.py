"""Error-controlled stiff integration of the circuit over one communication step (Rosenbrock-W, see `tableau`).

The Jacobian is built from differences, one evaluation per border state and three for the whole chain, and kept for
several steps, which a W-method allows without loss of order; the step is cut at the corners of the built-in command.
All memory of an instance is the state `y` and the workspace `w` (flat, `workspace_size`), so both together are what
has to be saved and restored.
"""

from __future__ import annotations

import numpy as np

from ..core.jit import kernel
from .bordered import eliminate_lags, factorise, flow_of, fold_lags, restore_lags, solve
from .circuit import derivatives
from .controller import command, command_rate
from .line import LAGS
from .states import border_length, chain_length, lag_length
from .tableau import GAMMA, NODES, A, C, E, M

STAGES = 4
STEP, AGE, FACTORED = 0, 1, 2
"""Scalars at the start of the workspace: proposed step [s], age of the Jacobian (-1 = none), sigma of the factors."""
SCALARS = 4
PORTS = 4
MAX_AGE = 20
MAX_STEPS = 200_000

OK, TOO_SMALL, TOO_MANY = 0, 1, 2
"""What `advance` returns: done; the step fell below what time resolves; too many steps."""


@kernel
def workspace_size(c: object) -> int:
    """Length of the workspace of a machine with these constants."""
    nc, m, nl = chain_length(c), border_length(c), lag_length(c)
    jacobian = 3 * nc + nc * m + PORTS + m * m + 2 * nl
    factors = 2 * nc + nc * m + m * m + m
    return SCALARS + jacobian + factors + (STAGES + 4) * (nc + m + nl)


def new_workspace(c: object) -> np.ndarray:
    """A workspace without a Jacobian, for a machine with these constants."""
    w = np.zeros(workspace_size(c))
    w[AGE] = -1.0
    return w


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


@kernel
def advance(
    y: object, w: object, c: object, scale: object,
    t_0: float, h: float, x_0: float, v_h: float, x_ref: float, ref_rate: float, memory: object,
) -> int:  # fmt: skip
    """Advance y in place from t_0 over h [s]; the rod moves as x_0 + v_h (t - t_0), the input command likewise.

    A controller output that is not continuous is u + u_rate (t - t_0) [mA] of the memory; otherwise its u is NaN.

    Returns OK, or TOO_SMALL or TOO_MANY with y as it was. The largest error over all states, each divided by its
    scale, is kept below the relative tolerance `solver.rtol` in every step.
    """
    nc, m, nl = chain_length(c), border_length(c), lag_length(c)
    nb = nc + m
    ny = nb + nl
    # the rooms of the workspace
    a = SCALARS
    sub, a = w[a : a + nc], a + nc
    dia, a = w[a : a + nc], a + nc
    sup, a = w[a : a + nc], a + nc
    B, a = w[a : a + nc * m].reshape(nc, m), a + nc * m
    feed, a = w[a : a + PORTS], a + PORTS
    D, a = w[a : a + m * m].reshape(m, m), a + m * m
    pull, a = w[a : a + nl], a + nl
    follow, a = w[a : a + nl], a + nl
    damped, a = w[a : a + nc], a + nc
    pivot, a = w[a : a + nc], a + nc
    Z, a = w[a : a + nc * m].reshape(nc, m), a + nc * m
    S, a = w[a : a + m * m].reshape(m, m), a + m * m
    order, a = w[a : a + m], a + m
    U, a = w[a : a + STAGES * ny].reshape(STAGES, ny), a + STAGES * ny
    f0, a = w[a : a + ny], a + ny
    yp, a = w[a : a + ny], a + ny
    y_0, a = w[a : a + ny], a + ny
    f = w[a : a + ny]
    port = (0, nc // 2 - 1, nc // 2, nc - 1)  # the chain columns that feed the border rows pa, p1, p2, pb

    for i in range(ny):
        y_0[i] = y[i]
    if w[STEP] <= 0.0:
        w[STEP] = 1e-5
    s_now = 0.0  # time since t_0, so that neither large times nor short steps lose digits
    fault, failed = TOO_MANY, False
    for _ in range(MAX_STEPS):
        if s_now >= h:
            return OK
        # the command is linear up to its next corner, so its rate is a difference
        stop = next_corner(s_now, h, t_0, c)
        left = stop - s_now
        step = left if w[STEP] >= 0.999999 * left else (0.5 * left if w[STEP] > 0.5 * left else w[STEP])
        r = command(t_0 + s_now, t_0, x_ref, ref_rate, c)
        rate = command_rate(t_0 + s_now + 0.5 * left, ref_rate, c)
        sigma = 1.0 / (step * GAMMA)
        for s in range(STAGES):
            for i in range(ny):
                yp[i] = y[i]
            for q in range(s):
                share = A[s, q]
                for i in range(ny):
                    yp[i] += share * U[q, i]
            dt = NODES[s] * step
            held = memory.u + memory.u_rate * (s_now + dt)
            derivatives(yp, c, x_0 + v_h * (s_now + dt), v_h, r + rate * dt, rate, held, memory, f)
            if s == 0:
                if w[AGE] < 0.0 or w[AGE] >= MAX_AGE:
                    for i in range(ny):
                        f0[i] = f[i]
                    for colour in range(3 + m):  # every third state of the chain, then each border state alone
                        first = colour if colour < 3 else nc + colour - 3
                        jump = 3 if colour < 3 else nb
                        last = nc if colour < 3 else nb
                        for i in range(first, last, jump):
                            yp[i] = y[i] + 1e-7 * (abs(y[i]) + scale[i])
                        derivatives(yp, c, x_0 + v_h * s_now, v_h, r, rate, held, memory, f)
                        for i in range(first, last, jump):
                            d = yp[i] - y[i]
                            yp[i] = y[i]
                            if i < nc:
                                dia[i] = (f[i] - f0[i]) / d
                                if i > 0:
                                    sup[i - 1] = (f[i - 1] - f0[i - 1]) / d
                                if i < nc - 1:
                                    sub[i + 1] = (f[i + 1] - f0[i + 1]) / d
                                for e in range(PORTS):
                                    if port[e] == i:
                                        feed[e] = (f[nc + e] - f0[nc + e]) / d
                            else:
                                for k in range(nc):
                                    B[k, i - nc] = (f[k] - f0[k]) / d
                                for k in range(m):
                                    D[k, i - nc] = (f[nc + k] - f0[nc + k]) / d
                    for q in range(LAGS if nl > 0 else 0):  # a lag acts on its own flow only
                        for i in range(nb + q, ny, LAGS):
                            yp[i] = y[i] + 1e-7 * (abs(y[i]) + scale[i])
                        derivatives(yp, c, x_0 + v_h * s_now, v_h, r, rate, held, memory, f)
                        for i in range(q, nl, LAGS):
                            d = yp[nb + i] - y[nb + i]
                            yp[nb + i] = y[nb + i]
                            k = flow_of(i // LAGS, nc)
                            pull[i], follow[i] = (f[k] - f0[k]) / d, (f0[nb + i] - f[nb + i]) / d
                    # the lines meet only in the border
                    sub[nc // 2] = 0.0
                    sup[nc // 2 - 1] = 0.0
                    for i in range(ny):
                        f[i] = f0[i]
                    w[AGE] = 0.0
                    w[FACTORED] = 0.0
                if abs(w[FACTORED] - sigma) > 1e-9 * sigma:
                    for i in range(nc):
                        damped[i] = dia[i]
                    fold_lags(pull, follow, LAGS, sigma, damped)
                    factorise(sub, damped, sup, B, port, feed, D, sigma, pivot, Z, S, order)
                    w[FACTORED] = sigma
            for i in range(ny):
                U[s, i] = f[i]
            for q in range(s):
                share = C[s, q] / step
                for i in range(ny):
                    U[s, i] += share * U[q, i]
            eliminate_lags(pull, follow, LAGS, sigma, nc, nb, U[s])
            solve(sub, sup, port, feed, pivot, Z, S, order, U[s])
            restore_lags(follow, LAGS, sigma, nc, nb, U[s])
        error = 0.0
        for i in range(ny):
            e = abs(E[0] * U[0, i] + E[1] * U[1, i] + E[2] * U[2, i] + E[3] * U[3, i]) / scale[i]
            if not (e <= error):  # also true for NaN, which must not pass
                error = e
        error /= c.solver.rtol
        if error <= 1.0:
            for i in range(ny):
                y[i] += M[0] * U[0, i] + M[1] * U[1, i] + M[2] * U[2, i] + M[3] * U[3, i]
            s_now = stop if step == left else s_now + step
            w[AGE] += 1.0
            failed = False
            proposal = step * min(0.9 * (1.0 / max(error, 1e-6)) ** (1.0 / 3.0), 4.0)
            # a step cut short by the end says nothing against a longer one
            w[STEP] = proposal if step < left else max(proposal, min(w[STEP], 2.0 * proposal))
        else:
            w[STEP] = step * (max(0.2, 0.9 * (1.0 / error) ** (1.0 / 3.0)) if error < 1e30 else 0.1)
            if w[STEP] < min(1e-14, 1e-9 * h):
                fault = TOO_SMALL
                break
            if failed and w[AGE] > 0.0:  # a shorter step alone does not do: the fault may be the old Jacobian's
                w[AGE] = -1.0
            failed = True
    for i in range(ny):
        y[i] = y_0[i]
    w[STEP] = 0.0
    w[AGE] = -1.0
    return fault
