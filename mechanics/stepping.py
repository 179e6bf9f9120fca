"""The arm's motion by velocity Verlet, from one row of numbers, so that compiled code finds everything by one address.

Second order, one evaluation a step, steps of at most `MAX_STEP`; the arm alone is slow (its pendulum mode is below
1 Hz), the fast mode of the machine arises from the coupling. The cylinder force F_h is held during a step.
"""

from __future__ import annotations

from math import ceil, pi, sqrt

from ..core.jit import array_at, call_2, call_3, kernel
from . import loads
from .base import PARTS, base_motion
from .bending import held_by_spring, swung
from .constants import SIZE as NUMBERS
from .constants import by_name
from .effects import shedding_rate, vortex_torque
from .loads import LEVER, MASS, TORQUE
from .variables import ARM, BASE, BEAM_STRIPS

MAX_STEP = 4e-3
"""Longest internal step [s]."""

MOST_STEPS = 10_000_000
"""Most internal steps in one communication step."""

MODEL, DATA, FORWARD_POSITION, FORWARD_VELOCITY, FULL_MATRIX, Q, QD, BIAS, PASSIVE = range(9)
"""Places in the row of addresses: MuJoCo's model, data, functions, and of these data positions to passive forces."""
LEVER_0, TURNED = range(9, 11)
"""Places of the lever at the start, and of whether it was said that the linkage has turned over."""
THETA, OMEGA, T, SAG, SAG_RATE, HELD, PHASE, GIVEN = range(11, 19)
"""Places of the state: angle [rad], velocity [rad/s], time [s]; deflection of a bending beam [m], its rate, what holds
it [N]; phase of the vortices [rad]; the base's motion as it is given from outside at the start of a step."""
MOTION = GIVEN + PARTS
PROJECTION = MOTION + PARTS
"""Places of the base's motion now, and of the result of `loads.project`."""
MATRIX = PROJECTION + 5
CONSTANTS = MATRIX + 9
SIZE = CONSTANTS + NUMBERS
"""Places of MuJoCo's mass matrix and of the constants, and how many numbers a row has."""

DONE, TOO_LONG, TURNED_OVER = range(3)
"""What `advance` returns: done; the step is too long and was not begun; done, and now the linkage has passed its dead
centre (told once): its lever has another sign than at the start."""

FORCE = ARM.index("F_h")
FIRST_BASE = ARM.index(BASE[0])
FIRST = ARM.index("x_h")
BEHIND = FIRST + 11 + BEAM_STRIPS
"""Places among the instance's values."""


def too_long(h: float) -> str:
    """What is to be said of a step of h [s] that is `TOO_LONG`."""
    return f"communication step of {h:g} s: the arm takes at most {MOST_STEPS * MAX_STEP:g} s"


SHORT_STEPS = 20.0
"""Least internal steps in a period of the bending beam that is free to turn, without damping."""


@kernel
def evaluate(row: int, theta: float, omega: float, t: float, s: float) -> None:
    """Bring the projected equation of motion of the row at that address up to date for a state at time t [s], which is
    s [s] after the base's motion was given."""
    b = array_at(row, SIZE)
    c, motion = by_name(b[CONSTANTS:SIZE]), b[MOTION:PROJECTION]
    model, data, matrix = int(b[MODEL]), int(b[DATA]), row + 8 * MATRIX
    loads.place(theta, omega, c, array_at(int(b[Q]), 3), array_at(int(b[QD]), 3))
    call_2(int(b[FORWARD_POSITION]), model, data)
    call_2(int(b[FORWARD_VELOCITY]), model, data)
    call_3(int(b[FULL_MATRIX]), model, data, matrix)
    M, p = b[MATRIX:CONSTANTS].reshape(3, 3), b[PROJECTION:MATRIX]
    if c.switch.base_moves > 0.0:
        base_motion(t, s, b[GIVEN:MOTION], c, motion)
    loads.project(theta, omega, t, c, motion, M, array_at(int(b[BIAS]), 3), array_at(int(b[PASSIVE]), 3), p)
    if c.effect.viv.C_L > 0.0:
        p[TORQUE] += vortex_torque(loads.current(t, c)[0], b[PHASE], c)
    if c.bending.rate > 0.0:
        b[HELD] = held_by_spring(theta, b[SAG], b[SAG_RATE], c)
        p[MASS] -= c.bending.mass * c.beam_length**2
        p[TORQUE] += c.beam_length * b[HELD]


@kernel
def longest_step(mass: float, c: object) -> float:
    """Longest internal step [s]; mass: effective inertia [kg m2], of a bending beam without what swings at its end."""
    if c.bending.rate == 0.0:
        return MAX_STEP
    stiffer = sqrt(1.0 + c.bending.mass * c.beam_length**2 / mass)
    quickest = c.bending.rate * stiffer * (1.0 + c.effect.beam_flexibility.damping * stiffer)
    return min(MAX_STEP, 2.0 * pi / quickest / SHORT_STEPS)


@kernel
def move(row: int, dt: float, t: float, s: float, F_h: float) -> None:
    """Move the state on by dt [s] to t, s [s] after the start of the step."""
    b = array_at(row, SIZE)
    c, p = by_name(b[CONSTANTS:SIZE]), b[PROJECTION:MATRIX]
    if c.effect.viv.C_L > 0.0:
        b[PHASE] += dt * shedding_rate(loads.current(t - 0.5 * dt, c)[0], c)
    if c.bending.rate > 0.0:
        move_bending(row, dt, t, s, F_h)
        return
    alpha = (p[TORQUE] + p[LEVER] * F_h) / p[MASS]
    theta, omega = b[THETA] + dt * (b[OMEGA] + 0.5 * dt * alpha), b[OMEGA]
    evaluate(row, theta, omega + dt * alpha, t, s)
    alpha_end = (p[TORQUE] + p[LEVER] * F_h) / p[MASS]
    b[THETA], b[OMEGA] = theta, omega + 0.5 * dt * (alpha + alpha_end)


@kernel
def move_bending(row: int, dt: float, t: float, s: float, F_h: float) -> None:
    """The same for a beam that bends: inertia, torque and lever, which MuJoCo takes long to find, change along a
    straight line meanwhile, for what swings does so many times. They are foretold as they were, then taken from there.
    """
    b = array_at(row, SIZE)
    c, p = by_name(b[CONSTANTS:SIZE]), b[PROJECTION:MATRIX]
    parts = max(1, ceil(dt / longest_step(p[MASS], c) * (1.0 - 1e-12)))
    before = p[MASS], p[TORQUE] - c.beam_length * b[HELD], p[LEVER]
    after = before
    begin = b[THETA], b[OMEGA], b[SAG], b[SAG_RATE]
    for _ in range(2):
        theta, omega, w, rate = swung(begin, before, after, dt, parts, F_h, c)
        b[SAG], b[SAG_RATE] = w, rate
        evaluate(row, theta, omega, t, s)
        after = p[MASS], p[TORQUE] - c.beam_length * b[HELD], p[LEVER]
    b[THETA], b[OMEGA] = theta, omega


@kernel
def take_base(v: object, row: int, t: float) -> None:
    """Take the base's motion from the inputs; as soon as there is any, it counts."""
    b = array_at(row, SIZE)
    c = by_name(b[CONSTANTS:SIZE])
    changed = False
    for i in range(PARTS):
        if v[FIRST_BASE + i] != b[GIVEN + i]:
            b[GIVEN + i], changed = v[FIRST_BASE + i], True
    if changed:
        c.switch.base_moves = 1.0
        evaluate(row, b[THETA], b[OMEGA], t, 0.0)


@kernel
def advance(values: int, n: int, row: int, m: int, t: float, h: float) -> int:
    """Advance from t by h [s] and write the outputs; with h = 0 only the outputs.

    values, row: addresses of the instance's values (n,) and of its row (m,). Returns `DONE`, `TOO_LONG`, `TURNED_OVER`.
    """
    v, b = array_at(values, n), array_at(row, m)
    c, p, F_h = by_name(b[CONSTANTS:SIZE]), b[PROJECTION:MATRIX], v[FORCE]
    if h > 0.0:
        if not h / longest_step(p[MASS], c) * (1.0 - 1e-12) <= MOST_STEPS:
            return TOO_LONG
        take_base(v, row, t)
        steps = max(1, ceil(h / MAX_STEP * (1.0 - 1e-12)))
        dt = h / steps
        for i in range(1, steps + 1):
            move(row, dt, t + i * dt, i * dt, F_h)
        b[T] = t + h
    alpha = (p[TORQUE] + p[LEVER] * F_h) / p[MASS]
    loads.report(b[THETA], b[OMEGA], alpha, b[T], F_h, c, b[MOTION:PROJECTION], v[FIRST:BEHIND])
    if h > 0.0 and b[TURNED] == 0.0 and p[LEVER] * b[LEVER_0] < 0.0:
        b[TURNED] = 1.0
        return TURNED_OVER
    return DONE
