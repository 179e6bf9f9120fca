"""The steps of a user's arm by velocity Verlet, from one row of numbers, so that compiled code finds everything by one
address (`row`).

(M + M_water) a = tendons' forces + water + weight and Coriolis + passive forces of the model, for the degrees of
freedom that are not held.
"""

from __future__ import annotations

from math import ceil, isfinite, sqrt

from ...core.jit import array_at, call_2, call_3, call_3d, call_5i, kernel
from ...core.sea import GRAVITY
from .row import HEAD_SIZE, WET, head_of
from .water import across, carried, drag_of_ball, drag_of_bar, plus

MOST_STEPS = 10_000_000
"""Most internal steps in one communication step."""

DONE, TOO_LONG, NOT_FINITE = range(3)
"""What `advance` returns: done; the step is too long and was not begun; the motion is not finite any more."""


@kernel
def vector(row: int, at: float, n: float) -> object:
    """The part (n,) of the row at that address which begins at a place."""
    return array_at(row + 8 * int(at), int(n))


@kernel
def matrix(row: int, at: float, m: float, n: float) -> object:
    """The part (m, n) of the row at that address which begins at a place."""
    return array_at(row + 8 * int(at), int(m * n)).reshape(int(m), int(n))


@kernel
def times(J: object, x: object) -> tuple[float, float, float]:
    """J x of a matrix (3, n) and a vector (n,)."""
    one, two, three = 0.0, 0.0, 0.0
    for k in range(len(x)):
        one += J[0, k] * x[k]
        two += J[1, k] * x[k]
        three += J[2, k] * x[k]
    return one, two, three


@kernel
def geom_axis(wet: object, h: object) -> tuple[float, float, float]:
    """Axis of a bar; (0, 0, 0) of a ball."""
    if wet[2] < 0.0:
        return 0.0, 0.0, 0.0
    turned = array_at(int(h.geom_xmat) + 72 * int(wet[0]), 9)
    k = int(wet[2])
    return turned[k], turned[3 + k], turned[6 + k]


@kernel
def add_water(row: int, wet: object, h: object) -> None:
    """Add the loads on a geom to the row's, and the mass of the water that moves along to its mass matrix."""
    n, body, place = h.nv, int(wet[1]), int(h.geom_xpos) + 24 * int(wet[0])
    model, data = int(h.mj_model), int(h.mj_data)
    call_5i(int(h.jacobian), model, data, row + 8 * int(h.at_Jp), row + 8 * int(h.at_Jr), place, body)
    call_5i(int(h.jacobian_rate), model, data, row + 8 * int(h.at_Kp), row + 8 * int(h.at_Kr), place, body)
    Jp, Jr, qvel = matrix(row, h.at_Jp, 3, n), matrix(row, h.at_Jr, 3, n), array_at(int(h.qvel), int(n))
    v, omega, axis = times(Jp, qvel), times(Jr, qvel), geom_axis(wet, h)
    a, alpha = times(matrix(row, h.at_Kp, 3, n), qvel), times(matrix(row, h.at_Kr, 3, n), qvel)
    u = (h.current - v[0], -v[1], -v[2])
    torque = (0.0, 0.0, 0.0)
    if wet[2] < 0.0:
        force = drag_of_ball(wet[4], wet[5], u, h.rho_drag)
    else:
        force, torque = drag_of_bar(wet[3], wet[4], wet[5], axis, u, omega, h.rho_drag)
    mass = h.rho_inertia * wet[7]
    one, other = carried(mass, wet[8], axis, omega, v, alpha, a)
    force, torque = plus(force, 1.0, one), plus(torque, 1.0, other)
    F_z = force[2] + h.rho * GRAVITY * wet[6]
    load, M = vector(row, h.at_load, n), matrix(row, h.at_M, n, n)
    for k in range(len(load)):
        load[k] += Jp[0, k] * force[0] + Jp[1, k] * force[1] + Jp[2, k] * F_z
        load[k] += Jr[0, k] * torque[0] + Jr[1, k] * torque[1] + Jr[2, k] * torque[2]
        p = across((Jp[0, k], Jp[1, k], Jp[2, k]), axis)
        r = across((Jr[0, k], Jr[1, k], Jr[2, k]), axis)
        for j in range(len(load)):
            M[k, j] += mass * (p[0] * Jp[0, j] + p[1] * Jp[1, j] + p[2] * Jp[2, j])
            M[k, j] += mass * wet[8] * (r[0] * Jr[0, j] + r[1] * Jr[1, j] + r[2] * Jr[2, j])


@kernel
def factorise(row: int, h: object) -> None:
    """Write the lower factor of the mass matrix of what is not held (Cholesky)."""
    M, L = matrix(row, h.at_M, h.nv, h.nv), matrix(row, h.at_factor, h.free, h.free)
    free = vector(row, h.at_free_dof, h.free)
    for i in range(len(free)):
        for j in range(i + 1):
            left = M[int(free[i]), int(free[j])]
            for k in range(j):
                left -= L[i, k] * L[j, k]
            L[i, j] = sqrt(left) if i == j else left / L[j, j]


@kernel
def look(row: int, h: object) -> None:
    """Bring masses, loads and levers up to date with position and velocity."""
    model, data, n = int(h.mj_model), int(h.mj_data), h.nv
    call_2(int(h.forward_position), model, data)
    call_2(int(h.forward_velocity), model, data)
    call_3(int(h.full_matrix), model, data, row + 8 * int(h.at_M))
    load, bias = vector(row, h.at_load, n), array_at(int(h.qfrc_bias), int(n))
    passive = array_at(int(h.qfrc_passive), int(n))
    for k in range(len(load)):
        load[k] = passive[k] - bias[k]
    tendons, levers = matrix(row, h.at_tendon, h.tendons, 1 + 2 * n), matrix(row, h.at_levers, h.tendons, n)
    for i in range(len(tendons)):
        for k in range(len(load)):
            if tendons[i, 1 + 2 * k] > 0.0:
                levers[i, k] = array_at(int(h.ten_J) + 8 * int(tendons[i, 2 + 2 * k]), 1)[0]
    if h.rho != 0.0:
        wet = matrix(row, h.at_geom, h.wet, WET)
        for i in range(len(wet)):
            add_water(row, wet[i], h)
    factorise(row, h)


@kernel
def accelerate(row: int, h: object) -> None:
    """Write the acceleration for the present forces."""
    levers, force = matrix(row, h.at_levers, h.tendons, h.nv), vector(row, h.at_force, h.tendons)
    load, found = vector(row, h.at_load, h.nv), vector(row, h.at_acceleration, h.nv)
    free, x = vector(row, h.at_free_dof, h.free), vector(row, h.at_right, h.free)
    L = matrix(row, h.at_factor, h.free, h.free)
    for i in range(len(free)):
        k = int(free[i])
        x[i] = load[k]
        for j in range(len(force)):
            x[i] += levers[j, k] * force[j]
        for j in range(i):
            x[i] -= L[i, j] * x[j]
        x[i] /= L[i, i]
    for i in range(len(free) - 1, -1, -1):
        for j in range(i + 1, len(free)):
            x[i] -= L[j, i] * x[j]
        x[i] /= L[i, i]
        found[int(free[i])] = x[i]


@kernel
def move(row: int, dt: float, h: object) -> None:
    """Move the state on by dt [s]."""
    n, qvel = int(h.nv), array_at(int(h.qvel), int(h.nv))
    before, acceleration = vector(row, h.at_before, n), vector(row, h.at_acceleration, n)
    for k in range(n):
        before[k] = qvel[k]
        qvel[k] = before[k] + 0.5 * dt * acceleration[k]
    call_3d(int(h.integrate), int(h.mj_model), int(h.qpos), int(h.qvel), dt)
    for k in range(n):
        qvel[k] = before[k] + dt * acceleration[k]
        before[k] += 0.5 * dt * acceleration[k]
    look(row, h)
    accelerate(row, h)
    for k in range(n):
        qvel[k] = before[k] + 0.5 * dt * acceleration[k]


@kernel
def report(v: object, row: int, h: object) -> None:
    """Write the outputs into the values, which begin with the forces and go on with the outputs."""
    n, nt = int(h.nv), int(h.tendons)
    qvel, levers = array_at(int(h.qvel), n), matrix(row, h.at_levers, nt, n)
    tendons, start = matrix(row, h.at_tendon, nt, 1 + 2 * n), vector(row, h.at_start, nt)
    F_hold, at = vector(row, h.at_F_hold, nt), nt
    for i in range(nt):
        length = array_at(int(h.ten_length) + 8 * int(tendons[i, 0]), 1)[0]
        speed = 0.0
        for k in range(n):
            speed += levers[i, k] * qvel[k]
        v[at], v[at + 1], v[at + 2], v[at + 3] = length - start[i], speed, length, F_hold[i]
        at += 4
    joints, qpos = matrix(row, h.at_joint, h.joints, 2), array_at(int(h.qpos), int(h.nq))
    for j in range(len(joints)):
        v[at], v[at + 1] = qpos[int(joints[j, 0])], qvel[int(joints[j, 1])]
        at += 2
    v[at] = h.P_am


@kernel
def settle(values: int, n: int, row: int, m: int, t: float, h: float) -> int:
    """Work everything out anew for positions, velocities and forces as they are; arguments as of `advance`."""
    head = head_of(array_at(row, HEAD_SIZE))
    look(row, head)
    accelerate(row, head)
    return DONE


@kernel
def advance(values: int, n: int, row: int, m: int, t: float, h: float) -> int:
    """Advance from t by h [s] with the forces held, and write the outputs; with h = 0 only the outputs.

    values, row: addresses of the instance's values (n,), which begin with the forces, and of its row (m,). Returns
    `DONE`, `TOO_LONG`, `NOT_FINITE`.
    """
    v, head = array_at(values, n), head_of(array_at(row, HEAD_SIZE))
    if h > 0.0:
        parts = h / head.longest * (1.0 - 1e-12)
        if not parts <= MOST_STEPS:
            return TOO_LONG
        force = vector(row, head.at_force, head.tendons)
        for i in range(len(force)):
            force[i] = v[i]
        accelerate(row, head)
        steps = max(1, ceil(parts))
        for _ in range(steps):
            move(row, h / steps, head)
        head.t = t + h
        acceleration = vector(row, head.at_acceleration, head.nv)
        for k in range(len(acceleration)):
            if not isfinite(acceleration[k]):
                return NOT_FINITE
    report(v, row, head)
    return DONE
