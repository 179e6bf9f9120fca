"""The arm's motion by velocity Verlet, from one row of numbers, so that compiled code finds everything by one address.

Second order, one evaluation a step, steps of at most `MAX_STEP`; the arm alone is slow (its pendulum mode is below
1 Hz), the fast mode of the machine arises from the coupling. The cylinder force F_h is held during a step.
"""

from __future__ import annotations

from math import ceil

from ..core.jit import array_at, call_2, call_3, kernel
from . import loads
from .loads import LEVER, MASS, TORQUE
from .variables import ARM, BEAM_STRIPS

MAX_STEP = 4e-3
"""Longest internal step [s]."""

MOST_STEPS = 10_000_000
"""Most internal steps in one communication step."""

MODEL, DATA, FORWARD_POSITION, FORWARD_VELOCITY, FULL_MATRIX, Q, QD, BIAS, PASSIVE = range(9)
"""Places in the row of addresses: MuJoCo's model, data, functions, and of these data positions to passive forces."""
LEVER_0, TURNED = range(9, 11)
"""Places of the lever at the start, and of whether it was said that the linkage has turned over."""
THETA, OMEGA, T, PROJECTION = range(11, 15)
"""Places of the state: angle [rad], velocity [rad/s], time [s], result of `loads.project`."""
MATRIX = PROJECTION + 5
CONSTANTS = MATRIX + 9
SIZE = CONSTANTS + loads.SIZE
"""Places of MuJoCo's mass matrix and of the constants of `loads`, and how many numbers a row has."""

DONE, TOO_LONG, TURNED_OVER = range(3)
"""What `advance` returns: done; the step is too long and was not begun; done, and now the linkage has passed its dead
centre (told once): its lever has another sign than at the start."""

FORCE = ARM.index("F_h")
FIRST = ARM.index("x_h")
BEHIND = FIRST + 11 + BEAM_STRIPS
"""Places among the instance's values."""


def too_long(h: float) -> str:
    """What is to be said of a step of h [s] that is `TOO_LONG`."""
    return f"communication step of {h:g} s: the arm takes at most {MOST_STEPS * MAX_STEP:g} s"


@kernel
def evaluate(row: int, theta: float, omega: float, t: float) -> None:
    """Bring the projected equation of motion of the row at that address up to date for a state at time t [s]."""
    b = array_at(row, SIZE)
    c = b[CONSTANTS:SIZE]
    model, data, matrix = int(b[MODEL]), int(b[DATA]), row + 8 * MATRIX
    loads.place(theta, omega, c, array_at(int(b[Q]), 3), array_at(int(b[QD]), 3))
    call_2(int(b[FORWARD_POSITION]), model, data)
    call_2(int(b[FORWARD_VELOCITY]), model, data)
    call_3(int(b[FULL_MATRIX]), model, data, matrix)
    M, p = b[MATRIX:CONSTANTS].reshape(3, 3), b[PROJECTION:MATRIX]
    loads.project(theta, omega, t, c, M, array_at(int(b[BIAS]), 3), array_at(int(b[PASSIVE]), 3), p)


@kernel
def advance(values: int, n: int, row: int, m: int, t: float, h: float) -> int:
    """Advance from t by h [s] and write the outputs; with h = 0 only the outputs.

    values, row: addresses of the instance's values (n,) and of its row (m,). Returns `DONE`, `TOO_LONG`, `TURNED_OVER`.
    """
    v, b = array_at(values, n), array_at(row, m)
    c, p, F_h = b[CONSTANTS:SIZE], b[PROJECTION:MATRIX], v[FORCE]
    alpha = (p[TORQUE] + p[LEVER] * F_h) / p[MASS]
    if h > 0.0:
        parts = h / MAX_STEP * (1.0 - 1e-12)
        if not parts <= MOST_STEPS:
            return TOO_LONG
        steps = max(1, ceil(parts))
        dt = h / steps
        theta, omega = b[THETA], b[OMEGA]
        for i in range(1, steps + 1):
            theta += dt * (omega + 0.5 * dt * alpha)
            evaluate(row, theta, omega + dt * alpha, t + i * dt)
            alpha_end = (p[TORQUE] + p[LEVER] * F_h) / p[MASS]
            omega += 0.5 * dt * (alpha + alpha_end)
            alpha = alpha_end
        b[THETA], b[OMEGA], b[T] = theta, omega, t + h
    loads.report(b[THETA], b[OMEGA], alpha, b[T], F_h, c, v[FIRST:BEHIND])
    if h > 0.0 and b[TURNED] == 0.0 and p[LEVER] * b[LEVER_0] < 0.0:
        b[TURNED] = 1.0
        return TURNED_OVER
    return DONE
