"""The plant as one ordinary differential equation. SI units; pressures are absolute.

State vector, n = 5 segments per line:

====================  =====  ================================================================================
index                 unit   meaning
====================  =====  ================================================================================
0, 1, 2               m m/s  compensator piston: position, velocity; tank pressure (Pa)
3, 4                  rad    beam angle above the horizontal, its rate (rad/s)
5                     mA     integral part of the controller
6 .. 16               Pa     line a-1 in turn: port a, flow (m3/s), node, flow, ..., chamber 1
17 .. 27              Pa     line b-2 in turn: chamber 2, flow (m3/s), ..., port b
28, 29                1 1/s  spool and its rate, with valve dynamics
30 .. 33              mA     controller output on its way, with delay
34                    Pa     supply pressure, where it is not that of an ideal relief valve
35                    1      spool behind its play
36                    m      bristles of the piston's friction
37, 38                rad    bending of the beam and its rate (rad/s)
39                    1      how silted up the spool is
40, 41                m m/s  rod ahead of its loose eye
42, 43                m3/s   flow of a pump that needs time, in turn
44, 45, 46            m3/s   long hose: flow, pressure in its middle (Pa), flow
47 .. 52              m3/s   lags of the mean flows of both lines
====================  =====  ================================================================================
"""

from __future__ import annotations

import numpy as np

from .compiled import kernel
from .forms import (
    bristle_rate,
    delayed,
    friction,
    land,
    land_leak,
    lands,
    leak,
    oil_compliance,
    physical,
    piston_leak,
    viscosity_now,
    wall_compliance,
)
from .lines import HISTORY, LINE_A, LINE_B, line
from .machine import ATMOSPHERE, SEGMENTS
from .supply import pump_flow, relief_pressure, supply_flows
from .water import arm, base_torque, current_at, linkage, other_torque, uneven_arm

SPOOL, DELAY, SUPPLY, PLAY, BRISTLE, BEND, SILT, ROD = 28, 30, 34, 35, 36, 37, 39, 40
STATES = HISTORY + 6
RUN, SETTLE = 0, 1
"""Modes: the run itself, or the search for the state at rest with the arm held and the controller's integral free."""

KEYS = ("x_h", "v_h", "theta", "F_h", "P1", "P2", "Pa", "Pb", "Pp", "Pt", "x_v", "u", "x_cmd")


@kernel
def command_at(c, piece: int, t: float) -> tuple[float, float]:
    """Commanded position (m) and velocity (m/s) at t; piece 0..4 counts the corners passed."""
    slope = c.target / c.ramp_time
    if piece == 1:
        return slope * (t - c.t_start), slope
    if piece == 2:
        return c.target, 0.0
    if piece == 3:
        return c.target - slope * (t - c.t_start - c.ramp_time - c.hold_time), -slope
    return 0.0, 0.0


@kernel
def controller(c, piece: int, t: float, x_h: float, v_h: float, integral: float) -> tuple[float, float]:
    """Valve current (mA, clipped) and the rate of the integral part (mA/s, held while saturated along the error)."""
    x_cmd, v_cmd = command_at(c, piece, t)
    e = c.sensor_gain * (x_cmd - x_h)
    raw = c.gain_p * e + integral + c.gain_d * c.sensor_gain * (v_cmd - v_h)
    u = min(max(raw, -c.rated_current), c.rated_current)
    stuck = (raw >= c.rated_current and e > 0.0) or (raw <= -c.rated_current and e < 0.0)
    return u, 0.0 if stuck else c.gain_i * e


@kernel
def cylinder_force(c, p1: float, p2: float, x: float, v: float, bristle: float) -> float:
    """Force (N) of the cylinder on the arm, positive extending, Eqs. 26, 27; with end stops that only push."""
    force = (p1 - c.p_am) * c.area1 - (p2 - c.p_am) * c.area2 - c.cylinder_damping * v
    force -= friction(c, p1, p2, x, v, bristle)
    low, high = -c.stop_clearance - x, x - c.stroke - c.stop_clearance
    if low > 0.0:
        damping = c.stop_damping * min(low / c.stop_damping_depth, 1.0)
        force += max(c.stop_stiffness * low - damping * v, 0.0)
    if high > 0.0:
        damping = c.stop_damping * min(high / c.stop_damping_depth, 1.0)
        force -= max(c.stop_stiffness * high + damping * v, 0.0)
    return force


@kernel
def rod(c, y, x_h: float, v_h: float) -> tuple[float, float]:
    """Place (m) and velocity (m/s) of the rod: those of its eye, unless that is loose."""
    if c.clearance == 0.0:
        return x_h, v_h
    return x_h + y[ROD], v_h + y[ROD + 1]


@kernel
def eye_force(c, ahead: float, faster: float) -> float:
    """Force (N) of the rod on its loose eye, `ahead` of it (m) and faster (m/s): none within half the clearance, then a
    pin's contact that stiffens (power 1.5) and loses a part of a blow (Hunt & Crossley 1975, J. Appl. Mech. 42)."""
    deep = abs(ahead) - 0.5 * c.clearance
    if deep <= 0.0:
        return 0.0
    way = 1.0 if ahead > 0.0 else -1.0
    return way * max(2e10 * deep**1.5 * (1.0 + 2.0 * way * faster), 0.0)


@kernel
def spool_of(c, y, u: float, f, settle: bool) -> float:
    """Spool position (-1..1) for the controller output u (mA); writes the rates of the states between them into f."""
    if c.delay > 0.0:
        u = delayed(c, u, y[DELAY : DELAY + 4], f[DELAY : DELAY + 4])
    x = u / c.rated_current + c.null_shift
    x = min(max(x, -1.0), 1.0)
    if c.play > 0.0 or c.silt > 0.0:
        if settle:
            f[PLAY] = 300.0 * (x - y[PLAY])
        else:
            half = c.play + c.silt * y[SILT]
            f[PLAY] = c.play_rate * (max(x - y[PLAY] - half, 0.0) + min(x - y[PLAY] + half, 0.0))
            if c.silt > 0.0:  # settles while the spool stands, is washed out as it moves by some ten-thousandths
                f[SILT] = (1.0 - y[SILT]) / c.silt_time - y[SILT] * abs(f[PLAY]) / 2e-4
        x = y[PLAY]
    if c.spool_time > 0.0:
        w = y[SPOOL + 1]
        T = c.spool_time
        f[SPOOL] = w
        if abs(w) > 0.5 * c.spool_rate:  # the limit sets in at half of it, continuous with its slope
            over = abs(w) / c.spool_rate - 0.5
            f[SPOOL] = np.sign(w) * c.spool_rate * (0.5 + 0.5 * np.tanh(2.0 * over))
        f[SPOOL + 1] = (x - y[SPOOL] - 2.0 * c.spool_damping * T * w) / (T * T)
        x = min(max(y[SPOOL], -1.0), 1.0)
    return x


@kernel
def valve(c, eta0: float, x_v: float, p_a: float, p_b: float, p_t: float, p_relief: float, p_state: float):
    """Flows (m3/s) Qa out of port a, Qb into port b, Q_p from the pump, Q_t to the tank, Eqs. 6-12; and P_p (Pa).

    An ideal relief valve: the flow to the machine is the pump's at most, and P_p is the relief pressure. Of another
    supply P_p is a state of its own, `p_state`.
    """
    pa, at, pb, bt = lands(c, x_v)
    dynamic = c.moving > 0.0
    p_p = p_state if dynamic else p_relief
    most = 1e9 if dynamic else pump_flow(c, eta0, p_p, p_t)
    q_pa = min(land(c, eta0, pa, p_p, p_a), most) if pa > 0.0 else 0.0
    q_at = land(c, eta0, at, p_a, p_t) if at > 0.0 else 0.0
    q_pb = min(land(c, eta0, pb, p_p, p_b), most) if pb > 0.0 else 0.0
    q_bt = land(c, eta0, bt, p_b, p_t) if bt > 0.0 else 0.0
    q_a, q_b, q_p, q_t = q_pa - q_at, q_bt - q_pb, q_pa + q_pb, q_at + q_bt
    if c.valve_leak > 0.0:
        k = land_leak(c, x_v)
        if c.leaks_apart == 0.0:
            q_a += k * (p_p - p_a) - k * (p_a - p_t)
            q_b -= k * (p_p - p_b) - k * (p_b - p_t)
            q_p += k * (2.0 * p_p - p_a - p_b)
            q_t += k * (p_a + p_b - 2.0 * p_t)
        else:
            bent = c.leak_turbulent
            l_pa, l_at = leak(k * c.leak_pa, p_p - p_a, bent), leak(k * c.leak_at, p_a - p_t, bent)
            l_pb, l_bt = leak(k * c.leak_pb, p_p - p_b, bent), leak(k * c.leak_bt, p_b - p_t, bent)
            q_a, q_b, q_p, q_t = q_a + l_pa - l_at, q_b - l_pb + l_bt, q_p + l_pa + l_pb, q_t + l_at + l_bt
    return q_a, q_b, q_p, q_t, p_p


@kernel
def supply_pressure(c, eta0: float, x_v: float, p_a: float, p_b: float, p_t: float, p_relief: float) -> float:
    """Pump pressure (Pa): the relief pressure, or what drives the pump's flow through the land if that is less."""
    pa, _, pb, _ = lands(c, x_v)
    high = p_relief
    low = p_a if pa >= pb else p_b
    s = max(pa, pb)
    most = pump_flow(c, eta0, high, p_t)
    if land(c, eta0, s, high, low) <= most:
        return high
    p_to = low
    for _ in range(40):
        middle = 0.5 * (low + high)
        if land(c, eta0, s, middle, p_to) > most:
            high = middle
        else:
            low = middle
    return 0.5 * (low + high)


@kernel
def _tank(c, eta0: float, y, p_t: float, p_p: float, p_relief: float, q_p: float, q_t: float, f) -> None:
    """Rates of supply, tank and compensator, Eqs. 2, 3, 7."""
    x_c, v_c = y[0], y[1]
    q_relief = c.q_pump - q_p
    if c.moving > 0.0:
        q_relief, f[SUPPLY] = supply_flows(c, eta0, y, p_t, p_p, p_relief, q_p, f)
    volume = c.tank_volume + c.comp_area * (c.compensator_length - x_c)
    spring = c.compensator_stiffness * (c.compensator_precompression - x_c)
    if c.short_travel > 0.0 and x_c > c.travel:  # a stop that gives 0.1 mm at the force of 0.1 MPa
        spring -= 5e7 * (x_c - c.travel) * (1.0 + max(v_c, 0.0) / 1e-2)
    capacity = volume * oil_compliance(c, p_t)
    if c.tank_air > 0.0:  # isothermal
        capacity += c.tank_air * ATMOSPHERE / (p_t * p_t)
    f[0] = v_c
    f[1] = ((c.p_am - p_t) * c.comp_area + spring - c.compensator_damping * v_c) / c.compensator_mass
    f[2] = (c.comp_area * v_c - c.q_pump + q_t + q_relief) / capacity


@kernel
def _chambers(c, thicker: float, y, x_h: float, v_h: float, q_a: float, q_b: float, f) -> None:
    """Rates of the pressures in chambers and ports, Eqs. 23, 24."""
    p_v, n = c.vapour_pressure, 2 * SEGMENTS
    p_a, p_1 = physical(y[LINE_A], p_v), physical(y[LINE_A + n], p_v)
    p_2, p_b = physical(y[LINE_B], p_v), physical(y[LINE_B + n], p_v)
    half = c.half_volume
    past = piston_leak(c, p_1 - p_2) / thicker
    out = out_rod = 0.0
    if c.external_leak > 0.0:
        over = (p_2 if c.leak_at_rod > 0.0 else p_1) - c.p_am
        out = c.external_leak * over * (1.0 + (over / 5e6) ** 2) / thicker
        if c.leak_at_rod > 0.0:
            out, out_rod = 0.0, out
    k_a, k_b, k_1, k_2 = oil_compliance(c, p_a), oil_compliance(c, p_b), oil_compliance(c, p_1), oil_compliance(c, p_2)
    volume1 = max(c.dead_volume + c.area1 * x_h, 0.01 * c.dead_volume) + half
    volume2 = max(c.dead_volume + c.area2 * (c.stroke - x_h), 0.01 * c.dead_volume) + half
    f[LINE_A] = (q_a - y[LINE_A + 1]) / (half * (k_a + wall_compliance(c, p_a)))
    f[LINE_B + n] = (y[LINE_B + n - 1] - q_b) / (half * (k_b + wall_compliance(c, p_b)))
    capacity1 = volume1 * k_1 + half * wall_compliance(c, p_1)
    capacity2 = volume2 * k_2 + half * wall_compliance(c, p_2)
    f[LINE_A + n] = (y[LINE_A + n - 1] - c.area1 * v_h - past - out) / capacity1
    f[LINE_B] = (c.area2 * v_h + past - y[LINE_B + 1] - out_rod) / capacity2


@kernel
def _arm(c, t: float, y, lever: float, force: float, settle: bool, f) -> float:
    """Write the rates of the beam, which the cylinder moves with that force (N) on that lever (m); returns the torque
    of water and weight (N m), with that of a bent beam at rest."""
    theta, omega = y[3], y[4]
    v_sea, a_sea = current_at(c, t)
    torque_more = other_torque(c, t, theta, omega)
    if c.heave > 0.0 and not settle:
        torque_more += base_torque(c, t, theta, omega, v_sea)
    if c.flexibility > 0.0:
        inertia, torque = arm(c, theta, omega, v_sea, a_sea, 0.0)
        load_inertia = c.load / c.gravity * c.beam_length**2
        spring_torque = c.flex_k * y[BEND] + c.flex_d * y[BEND + 1]
        load_torque = -c.load * c.beam_length * np.cos(theta + y[BEND])
        alpha = (torque + torque_more + force * lever + spring_torque) / inertia
        load_alpha = (load_torque - spring_torque) / load_inertia
        if settle:
            alpha = 0.0
            f[BEND] = (load_torque - c.flex_k * y[BEND]) / c.flex_d
            torque += c.flex_k * y[BEND]
        else:
            f[BEND] = y[BEND + 1]
            f[BEND + 1] = load_alpha - alpha
    else:
        inertia, torque = arm(c, theta, omega, v_sea, a_sea, c.load)
        inertia_more, torque_uneven = uneven_arm(c, theta, omega, v_sea, a_sea)
        inertia += inertia_more
        torque += torque_uneven
        alpha = (torque + torque_more + force * lever) / inertia
    f[3], f[4] = omega, alpha
    return torque + torque_more


@kernel
def derivative(t: float, y, c, piece: int, mode: int, held: float, f) -> None:
    """Write the rate of change of the state y at t (s) into f. `held` (mA) replaces the controller's output, or NaN."""
    p_v, n = c.vapour_pressure, 2 * SEGMENTS
    p_t = physical(y[2], p_v)
    p_a, p_1 = physical(y[LINE_A], p_v), physical(y[LINE_A + n], p_v)
    p_2, p_b = physical(y[LINE_B], p_v), physical(y[LINE_B + n], p_v)
    settle = mode == SETTLE
    f[SPOOL:] = 0.0

    length, length1, _, _, _, _ = linkage(c, y[3])
    x_r, v_r = rod(c, y, length - c.length0, length1 * y[4])
    u, f[5] = controller(c, piece, t, x_r, v_r, y[5])
    if held == held:
        u = held
    x_v = spool_of(c, y, u, f, settle)
    eta0 = viscosity_now(c, t)
    p_relief = relief_pressure(c, t, p_t)
    q_a, q_b, q_p, q_t, p_p = valve(c, eta0, x_v, p_a, p_b, p_t, p_relief, y[SUPPLY])

    _tank(c, eta0, y, p_t, p_p, p_relief, q_p, q_t, f)
    line(c, eta0 * c.line_thinner, y, LINE_A, False, f)
    line(c, eta0 * c.line_thinner, y, LINE_B, True, f)
    thicker = eta0 / c.stated_eta if c.oil_varies > 0.0 else 1.0

    _chambers(c, thicker, y, x_r, v_r, q_a, q_b, f)

    on_rod = cylinder_force(c, p_1, p_2, x_r, v_r, y[BRISTLE])
    on_eye = eye_force(c, y[ROD], y[ROD + 1]) if c.clearance > 0.0 else on_rod
    if c.bristle > 0.0:
        f[BRISTLE] = v_r - abs(v_r) * y[BRISTLE] / c.bristle_length
    elif c.presliding > 0.0:
        f[BRISTLE] = bristle_rate(c, p_1, p_2, x_r, v_r, y[BRISTLE])
    torque = _arm(c, t, y, length1, on_eye, settle, f)
    if c.clearance > 0.0:
        if settle:
            f[ROD], f[ROD + 1] = 1e-6 * (on_rod - on_eye), -1e3 * y[ROD + 1]
        else:
            f[ROD] = y[ROD + 1]
            f[ROD + 1] = (on_rod - on_eye) / (c.rod_mass + c.piston_mass) - length1 * f[4]
    if settle:  # the integral of the controller finds the spool that holds the arm; the tank rests already
        needed = -torque / length1
        f[0], f[1], f[2], f[3], f[4] = 0.0, 0.0, 0.0, 0.0, 0.0
        f[5] = 1e-3 * (needed - on_rod)


@kernel
def outputs(t: float, y, c, piece: int, held: float, out) -> None:
    """Write the values of KEYS at one instant into out."""
    p_v = c.vapour_pressure
    n = 2 * SEGMENTS
    p_t = physical(y[2], p_v)
    p_a, p_1 = physical(y[LINE_A], p_v), physical(y[LINE_A + n], p_v)
    p_2, p_b = physical(y[LINE_B], p_v), physical(y[LINE_B + n], p_v)
    length, length1, _, _, _, _ = linkage(c, y[3])
    x_h, v_h = length - c.length0, length1 * y[4]
    x_r, v_r = rod(c, y, x_h, v_h)
    u, _ = controller(c, piece, t, x_r, v_r, y[5])
    if held == held:
        u = held
    unused = np.empty(STATES)
    x_v = spool_of(c, y, u, unused, False)
    p_relief = relief_pressure(c, t, p_t)
    if c.moving > 0.0:
        p_p = y[SUPPLY]
    else:
        p_p = supply_pressure(c, viscosity_now(c, t), x_v, p_a, p_b, p_t, p_relief)
    out[0], out[1], out[2] = x_h, v_h, y[3]
    if c.clearance > 0.0:
        out[3] = eye_force(c, y[ROD], y[ROD + 1])
    else:
        out[3] = cylinder_force(c, p_1, p_2, x_h, v_h, y[BRISTLE])
    out[4], out[5], out[6], out[7], out[8], out[9] = p_1, p_2, p_a, p_b, p_p, p_t
    out[10], out[11] = x_v, u
    out[12] = command_at(c, piece, t)[0]
