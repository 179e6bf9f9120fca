"""The circuit: components put together to one system of ordinary differential equations with inputs x_h, v_h, x_ref.

Its states are in `states`. Kernels take the constants as a record c (`constants.by_name`) and what the instance
remembers as a record m (`memory.remembering`).
"""

from __future__ import annotations

from ..core.jit import kernel
from ..core.records import record
from .compensator import gas_softening, oil_volume, stop_acceleration, tank_rates
from .controller import command, command_rate, controller_output, integral_rate
from .cylinder import (
    chamber_volume,
    cushion_loss,
    end_stop_force,
    eye_force,
    outward_leaks,
    piston_leak,
    rod_force,
    viscous,
)
from .friction import friction
from .line import LAGS, half_at_chamber, line_derivatives
from .moving_supply import delivered, hose_pressures, spilled, supply_rates
from .oil import line_factor, modulus_factor, pressure
from .ports import port_flows
from .states import BORDER, border, border_length, chain_length, further
from .supply import port_pressure
from .valve import caught_command, counterbalance_loss, limited, spool_acceleration, spool_position

OUTPUTS = ("F_h", "P1", "P2", "Pa", "Pb", "Pp", "Pt", "Q1", "Q2", "Qa", "Qb", "Qrv", "x_v", "u", "x_cmd", "Qp", "Qt")
READ = record(OUTPUTS)
"""The outputs, in the order of the variable table."""


@kernel
def node_pressures(s: object, c: object, m: object) -> tuple[float, float, float, float, float]:
    """Absolute pressures [Pa] at port a, chambers 1 and 2, port b and tank, from the border's states s."""
    p_vapour = c.oil.p_vapour
    return (
        pressure(s.p_a, p_vapour),
        pressure(s.p_1, p_vapour),
        pressure(s.p_2, p_vapour),
        pressure(s.p_b, p_vapour),
        m.P_r if c.supply.from_outside != 0.0 else pressure(s.p_t, p_vapour),
    )


@kernel
def stiffness_factors(
    Pa: float, P_1: float, P_2: float, Pb: float, c: object
) -> tuple[float, float, float, float]:
    """Factors on the modulus at port a, in chambers 1 and 2 and at port b at these pressures [Pa]."""
    if c.oil.softens == 0.0:
        return 1.0, 1.0, 1.0, 1.0
    beta = c.oil.beta_e
    return line_factor(Pa, c), modulus_factor(P_1, beta, c), modulus_factor(P_2, beta, c), line_factor(Pb, c)


@kernel
def rod_at(y: object, x_h: float, v_h: float, c: object) -> tuple[float, float]:
    """Place [m] and velocity [m/s] of the rod: those of the arm's eye, unless it is loose in that."""
    if c.cylinder.loose == 0.0:
        return x_h, v_h
    z = further(y, c)
    return z.x_r, z.v_r


@kernel
def piston_force(x: float, v: float, P_1: float, P_2: float, c: object, m: object) -> float:
    """Force [N] of oil, friction and stops on a rod at x [m] that moves at v [m/s], positive extends."""
    cylinder = c.cylinder
    F = rod_force(P_1, P_2, v, c.sea.p_am, cylinder.area_1, cylinder.area_2, viscous(v, P_1, P_2, c))
    F -= friction(v, P_1, P_2, c, m)
    F += end_stop_force(x, v, cylinder.stroke, cylinder.stop_clearance, cylinder.stop_stiffness, cylinder.stop_damping)
    return F


@kernel
def own_tank_rates(Q_in: float, Q_out: float, Pt: float, s: object, rate: object, c: object) -> None:
    """`tank_rates` with what effects make of them: a modulus that air and pressure change, trapped air, a stop."""
    tank_rates(Q_in, Q_out, Pt, s, rate, c)
    if c.oil.softens != 0.0:
        rate.p_t *= modulus_factor(Pt, c.oil.beta, c)
    if c.compensator.gas > 0.0:
        volume = oil_volume(s.x_c, c.compensator.area, c.tank.volume, c.compensator.length)
        rate.p_t *= gas_softening(Pt, volume, c.oil.beta, c.compensator.gas)
    rate.v_c += stop_acceleration(s.x_c, c)


@kernel
def outflow_losses(y: object, x: float, P_1: float, P_2: float, c: object, f: object) -> None:
    """Add to the lines' rates f what oil on its way out of the chambers meets: a counterbalance valve, end cushions."""
    b = chain_length(c)
    Q_1, Q_2 = y[b // 2 - 1], y[b // 2]
    if c.effect.counterbalance_valve.p_set > 0.0 and Q_1 < 0.0:
        f[b // 2 - 1] += counterbalance_loss(Q_1, P_1, P_2, c) / c.line.inertance
    if c.effect.end_cushion.length > 0.0:
        if Q_1 < 0.0:
            f[b // 2 - 1] += cushion_loss(Q_1, x, P_1, c) / c.line.inertance
        if Q_2 > 0.0:
            f[b // 2] -= cushion_loss(Q_2, c.cylinder.stroke - x, P_2, c) / c.line.inertance


@kernel
def spool_rates(u: float, s: object, rate: object, c: object, m: object) -> None:
    """Write the rates of a spool with dynamics, which the output u [mA] of the controller moves; else none."""
    rate.spool = 0.0
    rate.spool_rate = 0.0
    if c.valve.spool_time > 0.0:
        dynamics = c.effect.valve_dynamics
        target = caught_command(u, c, m)
        rate.spool = limited(s.spool_rate, dynamics.stroke_time)
        rate.spool_rate = spool_acceleration(s.spool, s.spool_rate, target, c.valve.spool_time, dynamics.damping)


@kernel
def derivatives(
    y: object, c: object, x_h: float, v_h: float, x_cmd: float, v_cmd: float, held: float, m: object, f: object
) -> None:
    """Write dy/dt into f for the eye's place x_h [m], velocity v_h [m/s], command x_cmd [m] and its rate v_cmd [m/s].

    `held` is the controller output [mA] where it is not computed continuously, else NaN.
    """
    n, b = int(c.line.segments), chain_length(c)
    s, rate = border(y, c), border(f, c)
    cylinder = c.cylinder
    Pa, P_1, P_2, Pb, Pt = node_pressures(s, c, m)
    P_p, P_pump = hose_pressures(y, Pt, c, m)
    x, v = rod_at(y, x_h, v_h, c)

    lags = b + border_length(c)
    line_derivatives(y, 0, lags, Pa, P_1, c, f)
    line_derivatives(y, b // 2, lags + LAGS * n, P_2, Pb, c, f)
    outflow_losses(y, x, P_1, P_2, c, f)

    error = c.sensor.gain * (x_cmd - x)
    u = controller_output(error, c.sensor.gain * (v_cmd - v), s.integral, held, c)
    Q_a, Q_b, Q_p, Q_t = port_flows(spool_position(u, s.spool, c, m), Pa, Pb, Pt, P_p, c)

    leak = piston_leak(P_1, P_2, c)
    out_1, out_2 = outward_leaks(P_1, P_2, c)
    V_1 = chamber_volume(cylinder.dead_volume, cylinder.area_1, x) + half_at_chamber(P_1, c)
    V_2 = chamber_volume(cylinder.dead_volume, cylinder.area_2, cylinder.stroke - x) + half_at_chamber(P_2, c)
    beta, port = c.oil.beta_e, c.line.beta / c.line.half_segment
    Q_1, Q_2 = cylinder.area_1 * v, cylinder.area_2 * v
    K_a, K_1, K_2, K_b = stiffness_factors(Pa, P_1, P_2, Pb, c)
    rate.p_a = port * K_a * (Q_a - y[0])
    rate.p_1 = beta / V_1 * K_1 * (y[b // 2 - 1] - Q_1 - leak - out_1)
    rate.p_2 = beta / V_2 * K_2 * (Q_2 + leak - y[b // 2] - out_2)
    rate.p_b = port * K_b * (y[b - 1] - Q_b)
    Q_in, Q_out = Q_t + c.pump.flow - Q_p, c.pump.flow
    if c.states.further != 0.0:
        f[b + BORDER : lags] = 0.0
        if c.supply.moves != 0.0:
            supply_rates(y, Q_p, P_p, P_pump, Pt, c, f)
            Q_in, Q_out = Q_t + spilled(y, P_pump, Pt, c), delivered(y, c)
        if cylinder.loose != 0.0:
            z = further(f, c)
            z.x_r = v
            z.v_r = (piston_force(x, v, P_1, P_2, c, m) - eye_force(x - x_h, v - v_h, c)) / cylinder.rod_mass
    if c.supply.from_outside != 0.0:
        rate.p_t, rate.x_c, rate.v_c = 0.0, 0.0, 0.0
    else:
        own_tank_rates(Q_in, Q_out, Pt, s, rate, c)
    rate.integral = integral_rate(error, u, c.controller.ki, c.valve.i_rated)
    spool_rates(u, s, rate, c, m)


@kernel
def outputs(
    y: object, c: object, x_h: float, v_h: float, x_cmd: float, v_cmd: float, held: float, m: object, out: object
) -> None:
    """Write the outputs, in the order of OUTPUTS, into out; arguments as of `derivatives`."""
    b, s = chain_length(c), border(y, c)
    Pa, P_1, P_2, Pb, Pt = node_pressures(s, c, m)
    P_p, P_pump = hose_pressures(y, Pt, c, m)
    x, v = rod_at(y, x_h, v_h, c)
    u = controller_output(c.sensor.gain * (x_cmd - x), c.sensor.gain * (v_cmd - v), s.integral, held, c)
    x_v = spool_position(u, s.spool, c, m)
    Q_a, Q_b, Q_p, Q_t = port_flows(x_v, Pa, Pb, Pt, P_p, c)
    read = out.view(READ)[0]
    read.F_h = eye_force(x - x_h, v - v_h, c) if c.cylinder.loose != 0.0 else piston_force(x, v, P_1, P_2, c, m)
    read.P1, read.P2, read.Pa, read.Pb, read.Pt = P_1, P_2, Pa, Pb, Pt
    read.Pp = P_p if P_p == P_p else port_pressure(x_v, Pa, Pb, Pt, c)
    read.Q1, read.Q2 = y[b // 2 - 1], y[b // 2]
    read.Qa, read.Qb = Q_a, Q_b
    read.Qp, read.Qt, read.Qrv = Q_p, Q_t, c.pump.flow - Q_p
    if c.supply.moves != 0.0:
        read.Qrv = spilled(y, P_pump, Pt, c)
    elif c.supply.from_outside != 0.0:
        read.Qrv = 0.0
    read.x_v, read.u, read.x_cmd = x_v, u, x_cmd


@kernel
def outputs_at(
    y: object, c: object, t_0: float, h: float, x_0: float, v_h: float, x_ref: float, ref_rate: float,
    held: float, m: object, out: object,
) -> None:  # fmt: skip
    """Write the outputs at t_0 + h [s] for inputs that were given at t_0 and moved on at their rates."""
    t = t_0 + h
    x_cmd = command(t, t_0, x_ref, ref_rate, c)
    v_cmd = command_rate(t, ref_rate, c)
    outputs(y, c, x_0 + v_h * h, v_h, x_cmd, v_cmd, held, m, out)
