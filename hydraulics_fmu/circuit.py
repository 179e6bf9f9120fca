"""The circuit: components put together to one system of ordinary differential equations with inputs x_h, v_h, x_ref.

States, for n segments a line (pressures as of `oil.pressure`, SI units):

    chain   line a-1: [Q_0, p_1, Q_1, ..., Q_(n-1)], then line b-2 likewise          2 (2n - 1)
    border  pa, p1, p2, pb, pt, x_c, v_c, integral, spool, spool rate                10

with pa, pb the valve ports, p1, p2 the chambers, each joined with the half segment of line next to it. Spool and its
rate move only when the valve has dynamics.
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
from .controller import integral_rate, pid_output, ramp_command, ramp_rate
from .curves import SIDE, on_curve
from .cylinder import chamber_volume, end_stop_force, leakage, rod_force
from .friction import piston_friction, sign_of
from .line import line_derivatives
from .oil import air_softening, effective_bulk_modulus, gap_flow, pressure, temperature_factor, viscosity
from .supply import limited_by_pump, override_pressure, pump_flow, supply_pressure
from .valve import flow_gain, land_diameter, land_flow, land_opening, limited, notched, spool_acceleration

BORDER = 10
PA, P1, P2, PB, PT, XC, VC, INTEGRAL, SPOOL, SPOOL_RATE = range(BORDER)
"""Places of the border states, counted from the end of the chain."""

(
    SEGMENTS, P_AM, ETA0, ALPHA, RHO, BETA_E, BETA, P_VAPOUR,
    K_Q, D_LAND, LAM_CRIT, I_MAX, Q_PUMP, P_CRACK,
    LINE_R, LINE_I, LINE_K, HALF_SEGMENT, VARIABLE,
    A1, A2, V0, C_L, B_H, STROKE, CLEARANCE, STOP_K, STOP_D,
    A_C, V_T, L_C, M_C, B_C, K_C, PRECOMPRESSION,
    GAIN, KP, KI, KD, USE_INPUT, TARGET, T_START, RAMP, HOLD, RTOL,
    F_C, V_0, F_EXTRA, V_S, K_P, AIR, POLYTROPIC, HALF_AT_CHAMBER, BETA_LINE,
    SPOOL_T, SPOOL_DAMPING, DELAY, NULL_SHIFT, OVERRIDE, MINOR, SAMPLING, LAW,
    UNEVEN_C, UNEVEN_S, UNEVEN_P, EXPONENT, STROKE_TIME, LAP_PA, LAP_AT, LAP_PB, LAP_BT,
    LEAK_PA, LEAK_AT, LEAK_PB, LEAK_BT, LEAK_TURBULENT, GAIN_ERROR, NOTCH, RETRACT, C_FURTHER, C_TURBULENT,
    CURVE_V, METERED,
) = range(83)  # fmt: skip
"""Places of the constants in the array made by `constants`."""

FRICTION_CURVE = METERED + 1
METERING = FRICTION_CURVE + 2 * SIDE
"""First places of the curves' values."""

SIZE = METERING + 2 * SIDE
"""Number of constants."""

SHORTEST = 2.5e-4
"""Shortest delay or sampling period of the controller that is followed slice by slice [s], see `march`."""

OUTPUTS = ("F_h", "P1", "P2", "Pa", "Pb", "Pp", "Pt", "Q1", "Q2", "Qa", "Qb", "Qrv", "x_v", "u", "x_cmd")


def constants(p: Mapping[str, float]) -> np.ndarray:
    """The numbers that the kernels need, (`SIZE`,) float64, from the parameters of the variable table.

    Raises `ParameterError` when parameters contradict each other.
    """
    if p["cylinder.d_h"] >= p["cylinder.D_h"]:
        raise ParameterError(
            f"parameter 'cylinder.d_h' = {p['cylinder.d_h']:g} m must be less than "
            f"'cylinder.D_h' = {p['cylinder.D_h']:g} m"
        )
    n = int(p["line.segments"])
    diameter = p["line.diameter"] * p["effect.line_diameter_error.scale"]
    bore = pi * diameter**2 / 4.0
    dx = p["line.length"] / n
    beta_e = effective_bulk_modulus.py_func(p["oil.beta"], p["line.beta_wall"])
    softer = 1.0 + beta_e * p["effect.hose_compliance.compliance"]
    beta_line = beta_e / softer
    nu0 = p["oil.nu0"] * temperature_factor(p["effect.oil_temperature.T"])
    q_rated = p["valve.q_rated"] * p["effect.valve_flow_gain.scale"]
    area_1, area_2 = cylinder.areas(p["cylinder.D_h"], p["cylinder.d_h"])
    p_am = ambient_pressure(p["depth"]) * p["effect.ambient_pressure_error.scale"]
    law = p["effect.viscosity_law.share"]
    delay, period = p["effect.command_delay.tau"], p["effect.controller_sampling.period"]
    if period < SHORTEST:  # sampling so fast is the delay of half a period that it amounts to
        delay, period = delay + 0.5 * period, 0.0
    c = np.zeros(SIZE)
    values = {
        SEGMENTS: n, P_AM: p_am,
        ETA0: p["oil.rho"] * nu0, ALPHA: p["oil.alpha"], RHO: p["oil.rho"],
        BETA_E: beta_e, BETA: p["oil.beta"], P_VAPOUR: p["oil.p_vapour"],
        K_Q: flow_gain(q_rated, p["valve.dp_rated"]),
        D_LAND: land_diameter(q_rated, p["valve.dp_rated"], p["oil.rho"]),
        LAM_CRIT: p["valve.lam_crit"], I_MAX: p["valve.i_rated"],
        Q_PUMP: pump_flow(
            p["pump.displacement"] * p["pump.speed"], p["effect.pump_slip.slip"],
            viscosity.py_func(p_am + 0.5 * p["relief.p_crack"], p["oil.rho"] * nu0, p["oil.alpha"], law)
            / (p["oil.rho"] * p["oil.nu0"]),
        ),
        P_CRACK: p["relief.p_crack"] * (1.0 - p["effect.supply_droop.droop"]),
        LINE_R: 128.0 * dx / (pi * diameter**4), LINE_I: p["oil.rho"] * dx / bore,
        LINE_K: beta_line / (bore * dx), HALF_SEGMENT: 0.5 * bore * dx, VARIABLE: float(p["line.variable_viscosity"]),
        A1: area_1, A2: area_2, V0: p["cylinder.dead_volume"],
        B_H: p["cylinder.B_h"] * p["effect.cylinder_viscous_error.scale"],
        STROKE: p["cylinder.stroke"], CLEARANCE: p["cylinder.stop_clearance"],
        STOP_K: p["cylinder.stop_stiffness"], STOP_D: p["cylinder.stop_damping"],
        A_C: pi * p["compensator.diameter"] ** 2 / 4.0, V_T: p["tank.volume"], L_C: p["compensator.length"],
        M_C: p["compensator.m_c"], B_C: p["compensator.B_c"], K_C: p["compensator.k_c"],
        PRECOMPRESSION: p["compensator.precompression"],
        GAIN: p["sensor.gain"], KP: p["controller.kp"], KI: p["controller.ki"], KD: p["controller.kd"],
        USE_INPUT: float(p["command.use_input"]), TARGET: p["command.target"], T_START: p["command.t_start"],
        RAMP: p["command.ramp_time"], HOLD: p["command.hold_time"], RTOL: p["solver.rtol"],
        F_C: p["effect.cylinder_coulomb_friction.F_c"], V_0: p["effect.cylinder_coulomb_friction.v_0"],
        F_EXTRA: p["effect.cylinder_stribeck_friction.F_extra"], V_S: p["effect.cylinder_stribeck_friction.v_s"],
        K_P: p["effect.seal_pressure_friction.k_p"],
        AIR: p["effect.entrained_air.fraction"], POLYTROPIC: p["effect.entrained_air.polytropic"],
        HALF_AT_CHAMBER: 0.5 * bore * dx * softer, BETA_LINE: beta_line,
        SPOOL_T: p["effect.valve_dynamics.T"], SPOOL_DAMPING: p["effect.valve_dynamics.damping"],
        DELAY: delay, NULL_SHIFT: p["effect.valve_null_shift.shift"], OVERRIDE: p["effect.relief_override.R"],
        MINOR: p["effect.line_minor_losses.K"] * p["oil.rho"] / (2.0 * bore**2 * n),
        SAMPLING: period, LAW: law, **_forms(p),
    }  # fmt: skip
    for place, value in values.items():
        c[place] = value
    return c


def _forms(p: Mapping[str, float]) -> dict[int, float]:
    """What effects are in, four lands each with its own, and the form that they have."""
    gain, overlap = p["effect.valve_flow_gain.scale"], p["effect.valve_dead_zone.overlap"]
    leak, worn = p["effect.valve_leakage.c"], p["effect.piston_leakage.scale"]
    bent, retraction = p["effect.piston_leakage.turbulent"], p["effect.valve_flow_gain.retraction"]
    lands = ("pa", "at", "pb", "bt")
    laps, leaks = (range(first, first + len(lands)) for first in (LAP_PA, LEAK_PA))
    lap = {place: overlap * p[f"effect.valve_dead_zone.{x}"] for place, x in zip(laps, lands, strict=True)}
    if max(lap.values()) >= 1.0:
        raise ParameterError(
            f"parameter 'effect.valve_dead_zone.overlap' = {overlap:g} makes a land's overlap {max(lap.values()):g} of "
            "the stroke, which has to be less than 1"
        )
    rubs, opens = _curve(p, "cylinder_friction_curve"), _curve(p, "valve_metering_curve")
    return {
        CURVE_V: p["effect.cylinder_friction_curve.v_max"] if any(rubs) else 0.0, METERED: float(any(opens)),
        **dict(enumerate(rubs, FRICTION_CURVE)), **dict(enumerate(opens, METERING)),
        UNEVEN_C: p["effect.cylinder_coulomb_friction.uneven"],
        UNEVEN_S: p["effect.cylinder_stribeck_friction.uneven"],
        UNEVEN_P: p["effect.seal_pressure_friction.uneven"], EXPONENT: p["effect.cylinder_stribeck_friction.exponent"],
        STROKE_TIME: p["effect.valve_dynamics.stroke_time"], **lap,
        **{place: leak * p[f"effect.valve_leakage.{x}"] for place, x in zip(leaks, lands, strict=True)},
        LEAK_TURBULENT: p["effect.valve_leakage.turbulent"], GAIN_ERROR: gain, NOTCH: p["effect.valve_flow_gain.notch"],
        RETRACT: 1.0 if retraction == 1.0 else (1.0 + (gain - 1.0) * retraction) / gain,
        C_L: p["cylinder.c_l"] * (worn if bent == 0.0 else 1.0),
        C_FURTHER: p["cylinder.c_l"] * (worn - 1.0) if bent != 0.0 else 0.0, C_TURBULENT: bent,
    }  # fmt: skip


def _curve(p: Mapping[str, float], effect: str) -> list[float]:
    return [p[f"effect.{effect}.y{k}"] for k in range(1, 2 * SIDE + 1)]


def state_scales(c: np.ndarray) -> np.ndarray:
    """Typical size of each state, (ny,), by which the integration's errors are made dimensionless."""
    n = int(c[SEGMENTS])
    chain = np.empty(2 * (2 * n - 1))
    flow = max(c[Q_PUMP], 1e-9)
    for first in (0, 2 * n - 1):
        chain[first : first + 2 * n - 1 : 2] = flow
        chain[first + 1 : first + 2 * n - 1 : 2] = c[P_CRACK]
    p = c[P_CRACK]
    rate = 1.0 / c[SPOOL_T] if c[SPOOL_T] > 0.0 else 1.0
    return np.concatenate([chain, [p, p, p, p, p, 0.1, 0.1, c[I_MAX], 1.0, rate]])


@kernel
def controller(error: float, error_rate: float, integral: float, held: float, c: object) -> float:
    """Controller output u [mA]: the PID's, or `held` when that is a number (delay and sampling, see `march`)."""
    if held == held:
        return held
    return pid_output(error, error_rate, integral, c[KP], c[KD], c[I_MAX])


@kernel
def spool_command(u: float, c: object) -> float:
    """Commanded spool position k_v u with k_v = 1/i_rated (Eq. 10), shifted by the null shift, in -1..1."""
    return min(max(u / c[I_MAX] + c[NULL_SHIFT], -1.0), 1.0)


@kernel
def spool(u: float, state: float, c: object) -> float:
    """Spool position x_v in -1..1: its command at once, or the spool's own state when it has dynamics."""
    if c[SPOOL_T] == 0.0:
        return spool_command(u, c)
    return min(max(state, -1.0), 1.0)


@kernel
def land(opening: float, P_from: float, P_to: float, c: object) -> float:
    """Flow [m3/s] through one land of the servo valve."""
    return land_flow(opening, P_from, P_to, c[K_Q], c[D_LAND], c[LAM_CRIT], c[RHO], c[ETA0], c[ALPHA], c[LAW])


@kernel
def land_of(x: float, overlap: float, c: object) -> float:
    """Opening (0..1) of a land that the spool opens by moving so far."""
    opening = land_opening(x, overlap)
    return opening if c[NOTCH] == 1.0 else notched(opening, c[GAIN_ERROR], c[NOTCH])


@kernel
def metered(opening: float, x_v: float, c: object) -> float:
    """Opening (0..1) of a land that the spool opens by where it is, with what the metering curve adds."""
    if c[METERED] == 0.0:
        return opening
    return max(0.0, opening + on_curve(x_v, c, METERING, 0.0))


@kernel
def supplied_opening(x_v: float, c: object) -> float:
    """Opening of the land p-a, or that of the land p-b with a negative sign; of two at most one is open."""
    if x_v >= 0.0:
        return metered(land_of(x_v, c[LAP_PA], c), x_v, c)
    return -metered(c[RETRACT] * land_of(-x_v, c[LAP_PB], c), x_v, c)


@kernel
def relief_pressure(s: float, Pa: float, Pb: float, Pt: float, c: object) -> float:
    """Pressure [Pa] that the relief valve holds at port p, as long as the pump suffices; s: signed opening."""
    P = Pt + c[P_CRACK]
    if c[OVERRIDE] == 0.0:
        return P
    return override_pressure(
        P, c[OVERRIDE], c[Q_PUMP], c[LEAK_PA], c[LEAK_PB], c[LEAK_TURBULENT], Pa, Pb,
        abs(s), Pa if s >= 0.0 else Pb, c[K_Q], c[D_LAND], c[LAM_CRIT], c[RHO], c[ETA0], c[ALPHA], c[LAW],
    )  # fmt: skip


@kernel
def valve_flows(x_v: float, Pa: float, Pb: float, Pt: float, c: object) -> tuple[float, float, float, float]:
    """Flows Q_a, Q_b of the valve's ports (Eqs. 8, 9), Q_p taken from the supply and Q_t given to the tank [m3/s].

    What the supplied land takes is limited by the pump. Leakage past the lands flows from p to both ports and from both
    ports to t.
    """
    s = supplied_opening(x_v, c)
    P_p = relief_pressure(s, Pa, Pb, Pt, c)
    a_t, b_t = c[RETRACT] * land_of(-x_v, c[LAP_AT], c), land_of(x_v, c[LAP_BT], c)
    if x_v >= 0.0:
        b_t = metered(b_t, x_v, c)
    else:
        a_t = metered(a_t, x_v, c)
    Q_at = land(a_t, Pa, Pt, c) if a_t > 0.0 else 0.0
    Q_bt = land(b_t, Pb, Pt, c) if b_t > 0.0 else 0.0
    Q_p = limited_by_pump(land(abs(s), P_p, Pa if s >= 0.0 else Pb, c), c[Q_PUMP])
    Q_t = Q_at + Q_bt
    Q_a, Q_b = (Q_p - Q_at, Q_bt) if s >= 0.0 else (-Q_at, Q_bt - Q_p)
    if c[LEAK_PA] + c[LEAK_AT] + c[LEAK_PB] + c[LEAK_BT] > 0.0:
        bent = c[LEAK_TURBULENT]
        pa, at = gap_flow(P_p - Pa, c[LEAK_PA], bent), gap_flow(Pa - Pt, c[LEAK_AT], bent)
        pb, bt = gap_flow(P_p - Pb, c[LEAK_PB], bent), gap_flow(Pb - Pt, c[LEAK_BT], bent)
        Q_a += pa - at
        Q_b -= pb - bt
        Q_p += pa + pb
        Q_t += at + bt
    return Q_a, Q_b, Q_p, Q_t


@kernel
def node_pressures(y: object, b: int, p_vapour: float) -> tuple[float, float, float, float, float]:
    """Absolute pressures [Pa] at port a, chambers 1 and 2, port b and tank, from the border states y[b:]."""
    return (
        pressure(y[b + PA], p_vapour),
        pressure(y[b + P1], p_vapour),
        pressure(y[b + P2], p_vapour),
        pressure(y[b + PB], p_vapour),
        pressure(y[b + PT], p_vapour),
    )


@kernel
def derivatives(
    y: object, c: object, x_h: float, v_h: float, x_cmd: float, v_cmd: float, held: float, f: object
) -> None:
    """Write dy/dt into f for rod position x_h [m], velocity v_h [m/s], command x_cmd [m] and its rate v_cmd [m/s].

    `held` is the controller output [mA] where it is not computed continuously, else NaN.
    """
    n = int(c[SEGMENTS])
    b = 2 * (2 * n - 1)
    chain = 2 * n - 1
    p_vap = c[P_VAPOUR]
    Pa, P_1, P_2, Pb, Pt = node_pressures(y, b, p_vap)
    variable = c[VARIABLE] != 0.0

    for first in range(0, b, chain):
        P_in, P_out = (Pa, P_1) if first == 0 else (P_2, Pb)
        line_derivatives(
            y, first, n, P_in, P_out, c[ETA0], c[ALPHA], c[LAW], variable, p_vap,
            c[LINE_R], c[LINE_I], c[LINE_K], c[MINOR], c[BETA_LINE], c[AIR], c[POLYTROPIC], f,
        )  # fmt: skip

    error = c[GAIN] * (x_cmd - x_h)
    u = controller(error, c[GAIN] * (v_cmd - v_h), y[b + INTEGRAL], held, c)
    x_v = spool(u, y[b + SPOOL], c)
    Q_a, Q_b, Q_p, Q_t = valve_flows(x_v, Pa, Pb, Pt, c)
    Q_in = Q_t + c[Q_PUMP] - Q_p

    leak = leakage(P_1, P_2, c[C_L], c[C_FURTHER], c[C_TURBULENT])
    V_1 = chamber_volume(c[V0], c[A1], x_h) + c[HALF_AT_CHAMBER]
    V_2 = chamber_volume(c[V0], c[A2], c[STROKE] - x_h) + c[HALF_AT_CHAMBER]
    beta, air, n_air = c[BETA_E], c[AIR], c[POLYTROPIC]
    port = c[BETA_LINE] / c[HALF_SEGMENT]
    f[b + PA] = port * air_softening(Pa, c[BETA_LINE], air, n_air) * (Q_a - y[0])
    f[b + P1] = beta / V_1 * air_softening(P_1, beta, air, n_air) * (y[chain - 1] - c[A1] * v_h - leak)
    f[b + P2] = beta / V_2 * air_softening(P_2, beta, air, n_air) * (c[A2] * v_h + leak - y[chain])
    f[b + PB] = port * air_softening(Pb, c[BETA_LINE], air, n_air) * (y[b - 1] - Q_b)
    softening = air_softening(Pt, c[BETA], air, n_air)
    f[b + PT] = softening * tank_pressure_rate(
        Q_in, c[Q_PUMP], y[b + VC], y[b + XC], c[A_C], c[V_T], c[L_C], c[BETA]
    )
    f[b + XC] = y[b + VC]
    f[b + VC] = piston_acceleration(
        Pt, y[b + XC], y[b + VC], c[P_AM], c[A_C], c[M_C], c[B_C], c[K_C], c[PRECOMPRESSION]
    )
    f[b + INTEGRAL] = integral_rate(error, u, c[KI], c[I_MAX])
    f[b + SPOOL] = 0.0
    f[b + SPOOL_RATE] = 0.0
    if c[SPOOL_T] > 0.0:
        f[b + SPOOL] = limited(y[b + SPOOL_RATE], c[STROKE_TIME])
        f[b + SPOOL_RATE] = spool_acceleration(
            y[b + SPOOL], y[b + SPOOL_RATE], spool_command(u, c), c[SPOOL_T], c[SPOOL_DAMPING]
        )


@kernel
def outputs(
    y: object, c: object, x_h: float, v_h: float, x_cmd: float, v_cmd: float, held: float, out: object
) -> None:
    """Write the outputs, in the order of OUTPUTS, into out; arguments as of `derivatives`."""
    n = int(c[SEGMENTS])
    b = 2 * (2 * n - 1)
    Pa, P_1, P_2, Pb, Pt = node_pressures(y, b, c[P_VAPOUR])
    u = controller(c[GAIN] * (x_cmd - x_h), c[GAIN] * (v_cmd - v_h), y[b + INTEGRAL], held, c)
    x_v = spool(u, y[b + SPOOL], c)
    Q_a, Q_b, Q_p, _ = valve_flows(x_v, Pa, Pb, Pt, c)
    opening = supplied_opening(x_v, c)
    friction = piston_friction(
        v_h, P_1, P_2, c[F_C], c[V_0], c[F_EXTRA], c[V_S], c[K_P], c[UNEVEN_C], c[UNEVEN_S], c[UNEVEN_P], c[EXPONENT]
    )
    if c[CURVE_V] > 0.0:
        friction += on_curve(v_h / c[CURVE_V], c, FRICTION_CURVE, 1.0) * sign_of(v_h, c[V_0])
    out[0] = rod_force(P_1, P_2, v_h, c[P_AM], c[A1], c[A2], c[B_H]) - friction + end_stop_force(
        x_h, v_h, c[STROKE], c[CLEARANCE], c[STOP_K], c[STOP_D]
    )
    out[1] = P_1
    out[2] = P_2
    out[3] = Pa
    out[4] = Pb
    out[5] = supply_pressure(
        abs(opening), Pa if opening >= 0.0 else Pb, relief_pressure(opening, Pa, Pb, Pt, c), c[Q_PUMP],
        c[K_Q], c[D_LAND], c[LAM_CRIT], c[RHO], c[ETA0], c[ALPHA], c[LAW],
    )  # fmt: skip
    out[6] = Pt
    out[7] = y[2 * n - 2]
    out[8] = y[2 * n - 1]
    out[9] = Q_a
    out[10] = Q_b
    out[11] = c[Q_PUMP] - Q_p
    out[12] = x_v
    out[13] = u
    out[14] = x_cmd


@kernel
def command(t: float, t_0: float, x_ref: float, ref_rate: float, c: object) -> float:
    """Command in force [m]: the built-in ramp, or the input continued from time t_0 with its rate."""
    if c[USE_INPUT] != 0.0:
        return x_ref + ref_rate * (t - t_0)
    return ramp_command(t, c[TARGET], c[T_START], c[RAMP], c[HOLD])


@kernel
def command_rate(t: float, ref_rate: float, c: object) -> float:
    """Rate [m/s] of the command in force just before time t [s]."""
    if c[USE_INPUT] != 0.0:
        return ref_rate
    return ramp_rate(t, c[TARGET], c[T_START], c[RAMP], c[HOLD])


@kernel
def outputs_at(
    y: object, c: object, t_0: float, h: float, x_0: float, v_h: float, x_ref: float, ref_rate: float,
    held: float, out: object,
) -> None:  # fmt: skip
    """Write the outputs at t_0 + h [s] for inputs that were given at t_0 and moved on at their rates."""
    t = t_0 + h
    x_cmd = command(t, t_0, x_ref, ref_rate, c)
    v_cmd = command_rate(t, ref_rate, c)
    outputs(y, c, x_0 + v_h * h, v_h, x_cmd, v_cmd, held, out)
