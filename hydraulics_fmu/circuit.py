"""The circuit: components put together to one system of ordinary differential equations with inputs x_h, v_h, x_ref.

States, for n segments a line (pressures as of `oil.pressure`, SI units):

    chain   line a-1: [Q_0, p_1, Q_1, ..., Q_(n-1)], then line b-2 likewise          2 (2n - 1)
    border  p_a, p_1, p_2, p_b, p_t, x_c, v_c, integral, spool, spool_rate           10

with p_a, p_b the valve ports, p_1, p_2 the chambers, each joined with the half segment of line next to it. Spool and
its rate move only when the valve has dynamics. Kernels take the constants as a record c (`constants.by_name`).
"""

from __future__ import annotations

import numpy as np

from ..core.jit import kernel
from ..core.records import record, size_of
from .compensator import piston_acceleration, tank_pressure_rate
from .constants import by_name
from .controller import command, command_rate, controller_output, integral_rate
from .cylinder import chamber_volume, end_stop_force, piston_leak, rod_force
from .friction import friction
from .line import line_derivatives
from .oil import air_softening, pressure
from .ports import port_flows
from .supply import port_pressure
from .valve import limited, spool_acceleration, spool_command, spool_position

STATES = record(("p_a", "p_1", "p_2", "p_b", "p_t", "x_c", "v_c", "integral", "spool", "spool_rate"))
"""The border's states."""

BORDER = size_of(STATES)
"""How many these are."""

OUTPUTS = ("F_h", "P1", "P2", "Pa", "Pb", "Pp", "Pt", "Q1", "Q2", "Qa", "Qb", "Qrv", "x_v", "u", "x_cmd")
READ = record(OUTPUTS)
"""The outputs, in the order of the variable table."""


def state_scales(constants: np.ndarray) -> np.ndarray:
    """Typical size of each state, (ny,), by which the integration's errors are made dimensionless."""
    c = by_name(constants)
    line = chain_length(c) // 2
    scales = np.empty(2 * line + BORDER)
    flow, p = max(c.pump.flow, 1e-9), c.relief.p_set
    for first in (0, line):
        scales[first : first + line : 2] = flow
        scales[first + 1 : first + line : 2] = p
    rate = 1.0 / c.valve.spool_time if c.valve.spool_time > 0.0 else 1.0
    scales[-BORDER:] = p, p, p, p, p, 0.1, 0.1, c.valve.i_rated, 1.0, rate
    return scales


@kernel
def chain_length(c: object) -> int:
    """How many states the insides of both lines have; the border's come behind them."""
    return 2 * (2 * int(c.line.segments) - 1)


@kernel
def border(y: object) -> object:
    """The border's states of y (ny,), or their rates, by name."""
    return y[len(y) - BORDER :].view(STATES)[0]


@kernel
def node_pressures(s: object, p_vapour: float) -> tuple[float, float, float, float, float]:
    """Absolute pressures [Pa] at port a, chambers 1 and 2, port b and tank, from the border's states s."""
    return (
        pressure(s.p_a, p_vapour),
        pressure(s.p_1, p_vapour),
        pressure(s.p_2, p_vapour),
        pressure(s.p_b, p_vapour),
        pressure(s.p_t, p_vapour),
    )


@kernel
def derivatives(
    y: object, c: object, x_h: float, v_h: float, x_cmd: float, v_cmd: float, held: float, f: object
) -> None:
    """Write dy/dt into f for rod position x_h [m], velocity v_h [m/s], command x_cmd [m] and its rate v_cmd [m/s].

    `held` is the controller output [mA] where it is not computed continuously, else NaN.
    """
    n, b = int(c.line.segments), chain_length(c)
    s, rate = border(y), border(f)
    pump, tank, valve, cylinder, compensator = c.pump.flow, c.tank, c.valve, c.cylinder, c.compensator
    air, n_air = c.effect.entrained_air.fraction, c.effect.entrained_air.polytropic
    Pa, P_1, P_2, Pb, Pt = node_pressures(s, c.oil.p_vapour)

    for first in range(0, b, b // 2):
        P_in, P_out = (Pa, P_1) if first == 0 else (P_2, Pb)
        line_derivatives(
            y, first, n, P_in, P_out, c.oil.eta0, c.oil.alpha, c.effect.viscosity_law.share,
            c.line.variable_viscosity != 0.0, c.oil.p_vapour, c.line.resistance, c.line.inertance, c.line.stiffness,
            c.line.minor, c.line.beta, air, n_air, f,
        )  # fmt: skip

    error = c.sensor.gain * (x_cmd - x_h)
    u = controller_output(error, c.sensor.gain * (v_cmd - v_h), s.integral, held, c)
    Q_a, Q_b, Q_p, Q_t = port_flows(spool_position(u, s.spool, c), Pa, Pb, Pt, c)
    Q_in = Q_t + pump - Q_p

    leak = piston_leak(P_1, P_2, c)
    V_1 = chamber_volume(cylinder.dead_volume, cylinder.area_1, x_h) + c.line.half_at_chamber
    V_2 = chamber_volume(cylinder.dead_volume, cylinder.area_2, cylinder.stroke - x_h) + c.line.half_at_chamber
    beta, port = c.oil.beta_e, c.line.beta / c.line.half_segment
    rate.p_a = port * air_softening(Pa, c.line.beta, air, n_air) * (Q_a - y[0])
    rate.p_1 = beta / V_1 * air_softening(P_1, beta, air, n_air) * (y[b // 2 - 1] - cylinder.area_1 * v_h - leak)
    rate.p_2 = beta / V_2 * air_softening(P_2, beta, air, n_air) * (cylinder.area_2 * v_h + leak - y[b // 2])
    rate.p_b = port * air_softening(Pb, c.line.beta, air, n_air) * (y[b - 1] - Q_b)
    softening = air_softening(Pt, c.oil.beta, air, n_air)
    rate.p_t = softening * tank_pressure_rate(
        Q_in, pump, s.v_c, s.x_c, compensator.area, tank.volume, compensator.length, c.oil.beta
    )
    rate.x_c = s.v_c
    rate.v_c = piston_acceleration(
        Pt, s.x_c, s.v_c, c.sea.p_am, compensator.area, compensator.m_c, compensator.B_c, compensator.k_c,
        compensator.precompression,
    )  # fmt: skip
    rate.integral = integral_rate(error, u, c.controller.ki, valve.i_rated)
    rate.spool = 0.0
    rate.spool_rate = 0.0
    if valve.spool_time > 0.0:
        rate.spool = limited(s.spool_rate, c.effect.valve_dynamics.stroke_time)
        rate.spool_rate = spool_acceleration(
            s.spool, s.spool_rate, spool_command(u, c), valve.spool_time, c.effect.valve_dynamics.damping
        )


@kernel
def outputs(
    y: object, c: object, x_h: float, v_h: float, x_cmd: float, v_cmd: float, held: float, out: object
) -> None:
    """Write the outputs, in the order of OUTPUTS, into out; arguments as of `derivatives`."""
    b, s, cylinder = chain_length(c), border(y), c.cylinder
    Pa, P_1, P_2, Pb, Pt = node_pressures(s, c.oil.p_vapour)
    u = controller_output(c.sensor.gain * (x_cmd - x_h), c.sensor.gain * (v_cmd - v_h), s.integral, held, c)
    x_v = spool_position(u, s.spool, c)
    Q_a, Q_b, Q_p, _ = port_flows(x_v, Pa, Pb, Pt, c)
    read = out.view(READ)[0]
    read.F_h = (
        rod_force(P_1, P_2, v_h, c.sea.p_am, cylinder.area_1, cylinder.area_2, cylinder.viscous)
        - friction(v_h, P_1, P_2, c)
        + end_stop_force(
            x_h, v_h, cylinder.stroke, cylinder.stop_clearance, cylinder.stop_stiffness, cylinder.stop_damping
        )
    )
    read.P1, read.P2, read.Pa, read.Pb, read.Pt = P_1, P_2, Pa, Pb, Pt
    read.Pp = port_pressure(x_v, Pa, Pb, Pt, c)
    read.Q1, read.Q2 = y[b // 2 - 1], y[b // 2]
    read.Qa, read.Qb, read.Qrv = Q_a, Q_b, c.pump.flow - Q_p
    read.x_v, read.u, read.x_cmd = x_v, u, x_cmd


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
