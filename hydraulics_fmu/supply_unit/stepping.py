"""A step of the supply, from one row of numbers: ROS2, a linearly implicit method of second order (Verwer et al. 1999,
SIAM J. Sci. Comput. 20), in steps of a quarter of a millisecond at most, for the tank's compensator is stiff.

The flows are held during a step.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import ceil, sqrt

import numpy as np

from ...core.jit import array_at, kernel
from .equations import COUNT, SIZE, at_pump, by_name, constants, gas_volume, rates, rest, states
from .variables import AXES, SUPPLY

GAMMA = 1.0 - sqrt(0.5)
LONGEST = 2.5e-4
"""Longest internal step [s]."""
MOST_STEPS = 10_000_000
"""Most internal steps in one communication step."""
DONE, TOO_LONG, EMPTY = range(3)
"""What `advance` returns: done; the step is too long and was not begun; the supply is empty, its pressure gone."""

FIRST_TAKEN, FIRST_GIVEN = SUPPLY.index("Qp[1]"), SUPPLY.index("Qt[1]")
FIRST = SUPPLY.index("P_s")
"""Places among the instance's values."""

CONSTANTS, STATE, SCRATCH = 0, SIZE, SIZE + COUNT
LENGTH = SCRATCH + COUNT * (COUNT + 5)
"""Places in the row, and its length: constants, states, and room for a step."""


def initial_row(p: Mapping[str, float], Q_p: float) -> np.ndarray:
    """The row (`LENGTH`,) of an instance at rest, of which the valves take Q_p [m3/s]."""
    row = np.zeros(LENGTH)
    row[:STATE] = constants(p)
    row[STATE:SCRATCH] = rest(by_name.py_func(row[:STATE]), Q_p)
    return row


@kernel
def solve(A: object, b: object) -> None:
    """Solve A x = b in place by elimination with pivots."""
    n = len(b)
    for k in range(n):
        p = k
        for i in range(k + 1, n):
            if abs(A[i, k]) > abs(A[p, k]):
                p = i
        if p != k:
            b[k], b[p] = b[p], b[k]
            for j in range(n):
                A[k, j], A[p, j] = A[p, j], A[k, j]
        for i in range(k + 1, n):
            w = A[i, k] / A[k, k]
            for j in range(k, n):
                A[i, j] -= w * A[k, j]
            b[i] -= w * b[k]
    for k in range(n - 1, -1, -1):
        for j in range(k + 1, n):
            b[k] -= A[k, j] * b[j]
        b[k] /= A[k, k]


@kernel
def system(y: object, f0: object, h: float, Q_p: float, Q_t: float, c: object, z: object, f: object, A: object) -> None:
    """Write I - gamma h J at y, whose rates are f0, into A; z, f: room."""
    for j in range(COUNT):
        z[:] = y
        d = 1e-7 * (abs(y[j]) + 1e-6)
        z[j] += d
        rates(z, Q_p, Q_t, c, f)
        for i in range(COUNT):
            A[i, j] = -GAMMA * h * (f[i] - f0[i]) / d
        A[j, j] += 1.0


@kernel
def move(y: object, h: float, Q_p: float, Q_t: float, c: object, room: object) -> None:
    """Move the states y on by h [s]."""
    n = COUNT
    A, room = room[: n * n].reshape(n, n), room[n * n :]
    f0, k1, k2, z, f = room[:n], room[n : 2 * n], room[2 * n : 3 * n], room[3 * n : 4 * n], room[4 * n : 5 * n]
    rates(y, Q_p, Q_t, c, f0)
    system(y, f0, h, Q_p, Q_t, c, z, f, A)
    k1[:] = f0
    solve(A, k1)
    for i in range(n):
        z[i] = y[i] + h * k1[i]
    rates(z, Q_p, Q_t, c, k2)
    for i in range(n):
        k2[i] -= 2.0 * k1[i]
    system(y, f0, h, Q_p, Q_t, c, z, f, A)
    solve(A, k2)
    for i in range(n):
        y[i] += h * (1.5 * k1[i] + 0.5 * k2[i])


@kernel
def advance(values: int, n: int, row: int, m: int, t: float, h: float) -> int:
    """Advance by h [s] from t and write the outputs; with h = 0 only the outputs.

    values, row: addresses of the instance's values (n,) and of its row (m,). Returns `DONE`, `TOO_LONG` or `EMPTY`.
    """
    v, b = array_at(values, n), array_at(row, m)
    c, y = by_name(b[CONSTANTS:STATE]), b[STATE:SCRATCH]
    Q_p, Q_t = 0.0, 0.0
    for i in range(AXES):
        Q_p += v[FIRST_TAKEN + i]
        Q_t += v[FIRST_GIVEN + i]
    if h > 0.0:
        parts = h / LONGEST * (1.0 - 1e-12)
        if not parts <= MOST_STEPS:
            return TOO_LONG
        steps = max(1, ceil(parts))
        for _ in range(steps):
            move(y, h / steps, Q_p, Q_t, c, b[SCRATCH:])
    s = states(y)
    P_pump, Q_rv = at_pump(s, c)
    v[FIRST], v[FIRST + 1], v[FIRST + 2], v[FIRST + 3] = s.P, s.p_t, P_pump, s.Q_pump
    v[FIRST + 4] = Q_rv
    v[FIRST + 5] = c.accumulator.volume - gas_volume(s.P, c)
    return DONE if s.P > 0.0 and s.p_t > 0.0 else EMPTY
