"""The circuit: components put together to one system of ordinary differential equations with inputs x_h, v_h, x_ref.

States, for n segments a line (pressures as of `oil.pressure`, SI units):

    chain   line a-1: [Q_0, p_1, Q_1, ..., Q_(n-1)], then line b-2 likewise          2 (2n - 1)
    border  pa, p1, p2, pb, pt, x_c, v_c, integral                                   8

with pa, pb the valve ports, p1, p2 the chambers, each joined with the half segment of line next to it.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import pi

import numpy as np

from ..core.errors import ParameterError
from ..core.jit import kernel
from ..core.sea import ambient_pressure
from . import cylinder
from .compensator import piston_acceleration, tank_pressure_rate
from .controller import integral_rate, pid_output, ramp_command
from .cylinder import chamber_volume, end_stop_force, leakage, rod_force
from .line import line_derivatives
from .oil import effective_bulk_modulus, pressure
from .supply import limited_by_pump, supply_pressure
from .valve import flow_gain, land_diameter, land_flow

BORDER = 8
PA, P1, P2, PB, PT, XC, VC, INTEGRAL = range(BORDER)
"""Places of the border states, counted from the end of the chain."""

(
    SEGMENTS, P_AM, ETA0, ALPHA, RHO, BETA_E, BETA, P_VAPOUR,
    K_Q, D_LAND, LAM_CRIT, I_MAX, Q_PUMP, P_CRACK,
    LINE_R, LINE_I, LINE_K, HALF_SEGMENT, VARIABLE,
    A1, A2, V0, C_L, B_H, STROKE, CLEARANCE, STOP_K, STOP_D,
    A_C, V_T, L_C, M_C, B_C, K_C, PRECOMPRESSION,
    GAIN, KP, KI, KD, USE_INPUT, TARGET, T_START, RAMP, HOLD, RTOL,
) = range(45)  # fmt: skip
"""Places of the constants in the array made by `constants`."""

OUTPUTS = ("F_h", "P1", "P2", "Pa", "Pb", "Pp", "Pt", "Q1", "Q2", "Qa", "Qb", "Qrv", "x_v", "u", "x_cmd")


def constants(p: Mapping[str, float]) -> np.ndarray:
    """The numbers that the kernels need, (45,) float64, from the parameters of the variable table.

    Raises `ParameterError` when parameters contradict each other.
    """
    if p["cylinder.d_h"] >= p["cylinder.D_h"]:
        raise ParameterError(
            f"parameter 'cylinder.d_h' = {p['cylinder.d_h']:g} m must be less than "
            f"'cylinder.D_h' = {p['cylinder.D_h']:g} m"
        )
    n = int(p["line.segments"])
    bore = pi * p["line.diameter"] ** 2 / 4.0
    dx = p["line.length"] / n
    beta_e = effective_bulk_modulus.py_func(p["oil.beta"], p["line.beta_wall"])
    area_1, area_2 = cylinder.areas(p["cylinder.D_h"], p["cylinder.d_h"])
    c = np.zeros(45)
    values = {
        SEGMENTS: n, P_AM: ambient_pressure(p["depth"]),
        ETA0: p["oil.rho"] * p["oil.nu0"], ALPHA: p["oil.alpha"], RHO: p["oil.rho"],
        BETA_E: beta_e, BETA: p["oil.beta"], P_VAPOUR: p["oil.p_vapour"],
        K_Q: flow_gain(p["valve.q_rated"], p["valve.dp_rated"]),
        D_LAND: land_diameter(p["valve.q_rated"], p["valve.dp_rated"], p["oil.rho"]),
        LAM_CRIT: p["valve.lam_crit"], I_MAX: p["valve.i_rated"],
        Q_PUMP: p["pump.displacement"] * p["pump.speed"], P_CRACK: p["relief.p_crack"],
        LINE_R: 128.0 * dx / (pi * p["line.diameter"] ** 4), LINE_I: p["oil.rho"] * dx / bore,
        LINE_K: beta_e / (bore * dx), HALF_SEGMENT: 0.5 * bore * dx, VARIABLE: float(p["line.variable_viscosity"]),
        A1: area_1, A2: area_2, V0: p["cylinder.dead_volume"], C_L: p["cylinder.c_l"], B_H: p["cylinder.B_h"],
        STROKE: p["cylinder.stroke"], CLEARANCE: p["cylinder.stop_clearance"],
        STOP_K: p["cylinder.stop_stiffness"], STOP_D: p["cylinder.stop_damping"],
        A_C: pi * p["compensator.diameter"] ** 2 / 4.0, V_T: p["tank.volume"], L_C: p["compensator.length"],
        M_C: p["compensator.m_c"], B_C: p["compensator.B_c"], K_C: p["compensator.k_c"],
        PRECOMPRESSION: p["compensator.precompression"],
        GAIN: p["sensor.gain"], KP: p["controller.kp"], KI: p["controller.ki"], KD: p["controller.kd"],
        USE_INPUT: float(p["command.use_input"]), TARGET: p["command.target"], T_START: p["command.t_start"],
        RAMP: p["command.ramp_time"], HOLD: p["command.hold_time"], RTOL: p["solver.rtol"],
    }  # fmt: skip
    for place, value in values.items():
        c[place] = value
    return c


def state_scales(c: np.ndarray) -> np.ndarray:
    """Typical size of each state, (ny,), by which the integration's errors are made dimensionless."""
    n = int(c[SEGMENTS])
    chain = np.empty(2 * (2 * n - 1))
    flow = max(c[Q_PUMP], 1e-9)
    for first in (0, 2 * n - 1):
        chain[first : first + 2 * n - 1 : 2] = flow
        chain[first + 1 : first + 2 * n - 1 : 2] = c[P_CRACK]
    p = c[P_CRACK]
    return np.concatenate([chain, [p, p, p, p, p, 0.1, 0.1, c[I_MAX]]])


@kernel
def spool(error: float, error_rate: float, integral: float, c: object) -> float:
    """Spool position x_v = k_v u with k_v = 1/i_rated (Eq. 10), in -1..1."""
    return pid_output(error, error_rate, integral, c[KP], c[KD], c[I_MAX]) / c[I_MAX]


@kernel
def land(opening: float, P_from: float, P_to: float, c: object) -> float:
    """Flow [m3/s] through one land of the servo valve."""
    return land_flow(opening, P_from, P_to, c[K_Q], c[D_LAND], c[LAM_CRIT], c[RHO], c[ETA0], c[ALPHA])


@kernel
def valve_flows(x_v: float, Pa: float, Pb: float, Pt: float, c: object) -> tuple[float, float]:
    """Flows Q_a, Q_b [m3/s] of the valve's ports (Eqs. 8, 9), the supplied one limited by the pump."""
    P_relief = Pt + c[P_CRACK]
    if x_v >= 0.0:
        Q_a = limited_by_pump(land(x_v, P_relief, Pa, c), c[Q_PUMP])
        Q_b = land(x_v, Pb, Pt, c)
    else:
        Q_a = -land(-x_v, Pa, Pt, c)
        Q_b = -limited_by_pump(land(-x_v, P_relief, Pb, c), c[Q_PUMP])
    return Q_a, Q_b


@kernel
def derivatives(
    y: object, c: object, x_h: float, v_h: float, x_cmd: float, v_cmd: float, f: object
) -> None:
    """Write dy/dt into f for rod position x_h [m], velocity v_h [m/s], command x_cmd [m] and its rate v_cmd [m/s]."""
    n = int(c[SEGMENTS])
    b = 2 * (2 * n - 1)
    chain = 2 * n - 1
    p_vap = c[P_VAPOUR]
    Pa = pressure(y[b + PA], p_vap)
    Pb = pressure(y[b + PB], p_vap)
    P_1 = pressure(y[b + P1], p_vap)
    P_2 = pressure(y[b + P2], p_vap)
    Pt = pressure(y[b + PT], p_vap)
    variable = c[VARIABLE] != 0.0

    line_derivatives(y, 0, n, Pa, P_1, c[ETA0], c[ALPHA], variable, p_vap, c[LINE_R], c[LINE_I], c[LINE_K], f)
    line_derivatives(y, chain, n, P_2, Pb, c[ETA0], c[ALPHA], variable, p_vap, c[LINE_R], c[LINE_I], c[LINE_K], f)

    error = c[GAIN] * (x_cmd - x_h)
    error_rate = c[GAIN] * (v_cmd - v_h)
    x_v = spool(error, error_rate, y[b + INTEGRAL], c)
    Q_a, Q_b = valve_flows(x_v, Pa, Pb, Pt, c)
    Q_p = Q_a if x_v >= 0.0 else -Q_b
    Q_t = Q_b if x_v >= 0.0 else -Q_a
    Q_in = Q_t + c[Q_PUMP] - Q_p

    leak = leakage(P_1, P_2, c[C_L])
    V_1 = chamber_volume(c[V0], c[A1], x_h) + c[HALF_SEGMENT]
    V_2 = chamber_volume(c[V0], c[A2], c[STROKE] - x_h) + c[HALF_SEGMENT]
    f[b + PA] = c[BETA_E] / c[HALF_SEGMENT] * (Q_a - y[0])
    f[b + P1] = c[BETA_E] / V_1 * (y[chain - 1] - c[A1] * v_h - leak)
    f[b + P2] = c[BETA_E] / V_2 * (c[A2] * v_h + leak - y[chain])
    f[b + PB] = c[BETA_E] / c[HALF_SEGMENT] * (y[b - 1] - Q_b)
    f[b + PT] = tank_pressure_rate(Q_in, c[Q_PUMP], y[b + VC], y[b + XC], c[A_C], c[V_T], c[L_C], c[BETA])
    f[b + XC] = y[b + VC]
    f[b + VC] = piston_acceleration(
        Pt, y[b + XC], y[b + VC], c[P_AM], c[A_C], c[M_C], c[B_C], c[K_C], c[PRECOMPRESSION]
    )
    f[b + INTEGRAL] = integral_rate(error, x_v * c[I_MAX], c[KI], c[I_MAX])


@kernel
def outputs(
    y: object, c: object, x_h: float, v_h: float, x_cmd: float, v_cmd: float, out: object
) -> None:
    """Write the outputs, in the order of OUTPUTS, into out."""
    n = int(c[SEGMENTS])
    b = 2 * (2 * n - 1)
    p_vap = c[P_VAPOUR]
    Pa = pressure(y[b + PA], p_vap)
    Pb = pressure(y[b + PB], p_vap)
    P_1 = pressure(y[b + P1], p_vap)
    P_2 = pressure(y[b + P2], p_vap)
    Pt = pressure(y[b + PT], p_vap)
    x_v = spool(c[GAIN] * (x_cmd - x_h), c[GAIN] * (v_cmd - v_h), y[b + INTEGRAL], c)
    Q_a, Q_b = valve_flows(x_v, Pa, Pb, Pt, c)
    out[0] = rod_force(P_1, P_2, v_h, c[P_AM], c[A1], c[A2], c[B_H]) + end_stop_force(
        x_h, v_h, c[STROKE], c[CLEARANCE], c[STOP_K], c[STOP_D]
    )
    out[1] = P_1
    out[2] = P_2
    out[3] = Pa
    out[4] = Pb
    out[5] = supply_pressure(
        abs(x_v), Pa if x_v >= 0.0 else Pb, Pt + c[P_CRACK], c[Q_PUMP],
        c[K_Q], c[D_LAND], c[LAM_CRIT], c[RHO], c[ETA0], c[ALPHA],
    )  # fmt: skip
    out[6] = Pt
    out[7] = y[2 * n - 2]
    out[8] = y[2 * n - 1]
    out[9] = Q_a
    out[10] = Q_b
    out[11] = c[Q_PUMP] - (Q_a if x_v >= 0.0 else -Q_b)
    out[12] = x_v
    out[13] = x_v * c[I_MAX]
    out[14] = x_cmd


@kernel
def command(t: float, t_0: float, x_ref: float, ref_rate: float, c: object) -> float:
    """Command in force [m]: the built-in ramp, or the input continued from time t_0 with its rate."""
    if c[USE_INPUT] != 0.0:
        return x_ref + ref_rate * (t - t_0)
    return ramp_command(t, c[TARGET], c[T_START], c[RAMP], c[HOLD])


@kernel
def outputs_at(
    y: object, c: object, t_0: float, h: float, x_0: float, v_h: float, x_ref: float, ref_rate: float, out: object
) -> None:
    """Write the outputs at t_0 + h [s] for inputs that were given at t_0 and moved on at their rates."""
    t = t_0 + h
    x_cmd = command(t, t_0, x_ref, ref_rate, c)
    back = 1e-6
    v_cmd = (x_cmd - command(t - back, t_0, x_ref, ref_rate, c)) / back
    outputs(y, c, x_0 + v_h * h, v_h, x_cmd, v_cmd, out)
