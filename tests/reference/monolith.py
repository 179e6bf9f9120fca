"""The whole deep-sea machine as one ordinary differential equation: the truth the co-simulation is compared with.

This file shares no code with the project; the arm in the sea is the blind benchmark's (`benchmarks/blind/water.py`). It
integrates oil, valve, lines, cylinder, controller, linkage and sea water together with an error-controlled solver, so
it has no coupling step and no coupling error. Equation numbers are those of Wu et al. (2022), J. Mar. Sci. Eng. 10(3),
362. SI units throughout; pressures are absolute.

Run ``python -m tests.reference.monolith`` for the extension and retraction times at 0 km and 11 km.

State vector, n segments per line, 4 n + 8 entries:

====================  =====  ================================================================================
index                 unit   meaning
====================  =====  ================================================================================
0, 1, 2               m m/s  compensator piston: position, velocity; tank pressure (Pa)
3, 4                  rad    beam angle above the horizontal, its rate (rad/s)
5                     mA     integral part of the controller
6 .. 6+n              Pa     line a-1: port a, inner nodes, chamber 1
7+n .. 6+2n           m3/s   line a-1: flows, positive from port a to chamber 1
7+2n .. 7+3n          Pa     line b-2: chamber 2, inner nodes, port b
8+3n .. 7+4n          m3/s   line b-2: flows, positive from chamber 2 to port b
====================  =====  ================================================================================

Pressure states follow the linear compressibility without limit; ``physical`` turns them into pressures.
"""

from __future__ import annotations

import time as clock
from dataclasses import dataclass, fields

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from benchmarks.blind.water import arm, linkage

Array = NDArray[np.float64]

KEYS = (
    "time", "x_h", "v_h", "theta", "omega", "F_h", "P1", "P2", "Pa", "Pb", "Pp", "Pt", "Q1", "Q2", "Qa", "Qb", "Qrv",
    "x_v", "u", "x_cmd",
)  # fmt: skip
FREE = np.nan  # spool argument that leaves the spool to the controller


@dataclass(frozen=True)
class Machine:
    """All parameters of the machine in SI units; the defaults are the reference machine at the surface."""

    depth: float = 0.0  # km
    variable_viscosity: bool = True  # Eq. 22 in the lines; False: Eq. 21
    n_segments: int = 5  # per line

    # Oil, Eq. 1
    rho: float = 850.0  # kg/m3
    nu0: float = 22e-6  # m2/s
    alpha: float = 2.2e-8  # 1/Pa
    beta: float = 1.4e9  # Pa
    vapour_pressure: float = 3000.0  # Pa

    # Tank and compensator, Eqs. 2, 3
    tank_volume: float = 0.1  # m3
    compensator_diameter: float = 0.25  # m
    compensator_length: float = 0.25  # m
    compensator_mass: float = 1.0  # kg
    compensator_damping: float = 1000.0  # N s/m
    compensator_stiffness: float = 3000.0  # N/m
    compensator_precompression: float = 0.3  # m

    # Pump and relief valve, Eqs. 4-7
    pump_displacement: float = 6e-6  # m3/rev
    pump_speed: float = 1450.0 / 60.0  # rev/s
    relief_pressure: float = 20e6  # Pa

    # Servo valve, Eqs. 8-12
    rated_flow: float = 5e-3 / 60.0  # m3/s through one land
    rated_drop: float = 3.5e6  # Pa, of one land
    rated_current: float = 10.0  # mA
    discharge_coefficient: float = 0.7
    lam_crit: float = 1000.0  # flow number of the laminar-turbulent transition; 0: always turbulent
    smoothing_pressure: float = 100.0  # Pa, only with lam_crit = 0

    # Lines, Eqs. 13-22
    line_length: float = 4.0  # m
    line_diameter: float = 4e-3  # m

    # Cylinder, Eqs. 23-27
    bore: float = 0.045  # m
    rod_diameter: float = 0.025  # m
    stroke: float = 0.25  # m
    dead_volume: float = 20e-6  # m3, each chamber
    leakage: float = 5e-12  # m3/s/Pa
    cylinder_damping: float = 1000.0  # N s/m
    stop_clearance: float = 1e-3  # m, beyond either end of the stroke
    stop_stiffness: float = 2e7  # N/m
    stop_damping: float = 1e5  # N s/m
    stop_damping_depth: float = 1e-4  # m, penetration of full damping

    # Controller and command
    sensor_gain: float = 1000.0  # 1/m
    gain_p: float = 2.5  # mA
    gain_i: float = 0.001  # mA/s
    gain_d: float = 0.001  # mA s
    command: float = 0.2  # m
    extend_start: float = 2.0  # s
    extend_end: float = 7.0  # s
    retract_start: float = 12.0  # s
    retract_end: float = 17.0  # s

    # Linkage
    gravity: float = 9.81  # m/s2
    beam_length: float = 1.605  # m
    beam_diameter: float = 0.10  # m
    beam_mass: float = 50.0  # kg
    load_weight: float = 800.0  # N
    eye_radius: float = 0.212  # m, rod eye on the beam axis
    base_x: float = 0.36  # m, cylinder base hinge
    base_y: float = -0.322  # m
    theta0: float = np.deg2rad(23.8)  # rad, beam angle at x_h = 0
    barrel_mass: float = 6.0  # kg
    barrel_length: float = 0.38  # m, from the base hinge
    barrel_diameter: float = 0.060  # m
    rod_mass: float = 2.0  # kg
    rod_length: float = 0.40  # m, from the eye backwards
    piston_mass: float = 5.0  # kg, at the rod's inner end

    # Sea water, Eqs. 28-31
    rho_sea: float = 1025.0  # kg/m3
    drag_coefficient: float = 1.2
    inertia_coefficient: float = 2.0
    current: float = 0.5  # m/s along +x
    current_amplitude: float = 0.0  # m/s
    current_frequency: float = 0.0  # Hz

    @property
    def ambient_pressure(self) -> float:
        """Pressure of the sea, Pa: 10 MPa per km, at least one atmosphere."""
        return max(1e7 * self.depth, 101300.0)

    @property
    def corners(self) -> tuple[float, float, float, float]:
        """Times at which the slope of the command jumps, s."""
        return self.extend_start, self.extend_end, self.retract_start, self.retract_end


_DERIVED = (
    "p_am", "eta0", "comp_area", "q_pump", "k_q", "land_diameter", "area1", "area2", "line_area", "segment",
    "segment_loss", "half_volume", "length0", "beam_d", "barrel_d", "drag_factor", "buoyancy",
)  # fmt: skip
_RECORD = np.dtype([(f.name, np.float64) for f in fields(Machine)] + [(name, np.float64) for name in _DERIVED])


def _constants(m: Machine) -> np.void:
    """Parameters and derived constants in the form the compiled functions read."""
    c = np.zeros(1, _RECORD)[0]
    for f in fields(Machine):
        c[f.name] = getattr(m, f.name)
    c["p_am"] = m.ambient_pressure
    c["eta0"] = m.rho * m.nu0  # Pa s
    c["comp_area"] = np.pi * m.compensator_diameter**2 / 4
    c["q_pump"] = m.pump_displacement * m.pump_speed  # Eq. 4
    c["k_q"] = m.rated_flow / np.sqrt(m.rated_drop)
    full_area = m.rated_flow / (m.discharge_coefficient * np.sqrt(2 * m.rated_drop / m.rho))
    c["land_diameter"] = np.sqrt(4 * full_area / np.pi)
    c["area1"] = np.pi * m.bore**2 / 4  # Eq. 25
    c["area2"] = np.pi * (m.bore**2 - m.rod_diameter**2) / 4
    c["line_area"] = np.pi * m.line_diameter**2 / 4
    c["segment"] = m.line_length / m.n_segments
    c["segment_loss"] = 128 * c["segment"] / (np.pi * m.line_diameter**4)  # loss / (viscosity * flow), Eq. 21
    c["half_volume"] = c["line_area"] * c["segment"] / 2
    c["beam_d"], c["barrel_d"], c["drag_factor"] = m.beam_diameter, m.barrel_diameter, m.drag_coefficient
    c["length0"] = linkage(c, m.theta0)[0]
    return c


@njit
def physical(p: float, p_v: float) -> float:
    """Pressure (Pa) of a pressure state: the state itself, or a positive remainder below the vapour pressure."""
    return p if p >= p_v else p_v * np.exp((p - p_v) / p_v)


@njit
def land(c, s: float, p_from: float, p_to: float) -> float:
    """Flow (m3/s) through a land of opening s in 0..1, Eqs. 8 and 9, with the transition to laminar flow."""
    dp = p_from - p_to
    if c.lam_crit == 0.0:
        return c.k_q * s * dp / (dp * dp + c.smoothing_pressure**2) ** 0.25
    nu = c.nu0 * np.exp(c.alpha * 0.5 * (p_from + p_to))
    lam = c.land_diameter * np.sqrt(s) / nu * np.sqrt(2.0 * abs(dp) / c.rho)
    return np.sign(dp) * c.k_q * s * np.sqrt(abs(dp)) * np.tanh(2.0 * lam / c.lam_crit)


@njit
def valve(c, x_v: float, p_a: float, p_b: float, p_t: float) -> tuple[float, float, float, float]:
    """Flows (m3/s) Qa out of port a, Qb into port b, Q_p from the pump, Q_t to the tank, Eqs. 6-12."""
    p_relief = p_t + c.relief_pressure
    if x_v >= 0.0:
        q_a = min(land(c, x_v, p_relief, p_a), c.q_pump)
        q_b = land(c, x_v, p_b, p_t)
        return q_a, q_b, q_a, q_b
    q_a = -land(c, -x_v, p_a, p_t)
    q_b = -min(land(c, -x_v, p_relief, p_b), c.q_pump)
    return q_a, q_b, -q_b, -q_a


@njit
def supply_pressure(c, x_v: float, p_a: float, p_b: float, p_t: float) -> float:
    """Pump pressure (Pa): the relief pressure, or what drives the pump's flow through the land if that is less."""
    high = p_t + c.relief_pressure
    p_to = p_a if x_v >= 0.0 else p_b
    if land(c, abs(x_v), high, p_to) <= c.q_pump:
        return high
    low = p_to
    while high - low > 1e-3:
        middle = 0.5 * (low + high)
        if land(c, abs(x_v), middle, p_to) > c.q_pump:
            high = middle
        else:
            low = middle
    return 0.5 * (low + high)


@njit
def segment_viscosity(c, p_i: float, p_o: float) -> float:
    """Viscosity (Pa s) that makes Eq. 22 exact: the log-mean of Eq. 1 between both pressures."""
    x = 0.5 * c.alpha * (p_i - p_o)
    mean = c.eta0 * np.exp(0.5 * c.alpha * (p_i + p_o))
    return mean * (1.0 - x * x / 6.0) if abs(x) < 1e-4 else mean * x / np.sinh(x)


@njit
def command_at(c, piece: int, t: float) -> tuple[float, float]:
    """Commanded position (m) and velocity (m/s) at t; piece 0..4 counts the corners passed."""
    if piece == 1:
        slope = c.command / (c.extend_end - c.extend_start)
        return slope * (t - c.extend_start), slope
    if piece == 2:
        return c.command, 0.0
    if piece == 3:
        slope = -c.command / (c.retract_end - c.retract_start)
        return c.command + slope * (t - c.retract_start), slope
    return 0.0, 0.0


@njit
def controller(c, x_cmd: float, v_cmd: float, x_h: float, v_h: float, integral: float) -> tuple[float, float]:
    """Valve current (mA, clipped) and the rate of the integral part (mA/s, held while saturated along the error)."""
    e = c.sensor_gain * (x_cmd - x_h)
    raw = c.gain_p * e + integral + c.gain_d * c.sensor_gain * (v_cmd - v_h)
    u = min(max(raw, -c.rated_current), c.rated_current)
    held = (raw >= c.rated_current and e > 0.0) or (raw <= -c.rated_current and e < 0.0)
    return u, 0.0 if held else c.gain_i * e


@njit
def current_at(c, t: float) -> tuple[float, float]:
    """Velocity (m/s) and acceleration (m/s2) of the sea water along +x."""
    w = 2.0 * np.pi * c.current_frequency
    return c.current + c.current_amplitude * np.sin(w * t), c.current_amplitude * w * np.cos(w * t)


@njit
def cylinder_force(c, p1: float, p2: float, x_h: float, v_h: float) -> float:
    """Force (N) of the cylinder on the arm, positive extending, Eqs. 26, 27; with end stops that only push."""
    force = (p1 - c.p_am) * c.area1 - (p2 - c.p_am) * c.area2 - c.cylinder_damping * v_h
    low, high = -c.stop_clearance - x_h, x_h - c.stroke - c.stop_clearance
    if low > 0.0:
        damping = c.stop_damping * min(low / c.stop_damping_depth, 1.0)
        force += max(c.stop_stiffness * low - damping * v_h, 0.0)
    if high > 0.0:
        damping = c.stop_damping * min(high / c.stop_damping_depth, 1.0)
        force -= max(c.stop_stiffness * high + damping * v_h, 0.0)
    return force


@njit
def derivative(t: float, y: Array, c, piece: int, spool: float) -> Array:
    """Rate of change of the state. A spool position (-1..1) given as ``spool`` replaces the controller's."""
    n = (y.size - 8) // 4
    flow_a, node_b, flow_b = 7 + n, 7 + 2 * n, 8 + 3 * n
    dy = np.empty_like(y)
    x_c, v_c, theta, omega = y[0], y[1], y[3], y[4]
    p_t = physical(y[2], c.vapour_pressure)
    node_pressure = np.empty(2 * n + 2)
    for i in range(n + 1):
        node_pressure[i] = physical(y[6 + i], c.vapour_pressure)
        node_pressure[n + 1 + i] = physical(y[node_b + i], c.vapour_pressure)
    p_a, p_1, p_2, p_b = node_pressure[0], node_pressure[n], node_pressure[n + 1], node_pressure[2 * n + 1]

    length, length1, _, _, _, _ = linkage(c, theta)
    x_h, v_h = length - c.length0, length1 * omega
    x_cmd, v_cmd = command_at(c, piece, t)
    u, dy[5] = controller(c, x_cmd, v_cmd, x_h, v_h, y[5])
    x_v = u / c.rated_current if np.isnan(spool) else spool
    q_a, q_b, q_p, q_t = valve(c, x_v, p_a, p_b, p_t)

    # Tank and compensator, Eqs. 2, 3, 7
    volume = c.tank_volume + c.comp_area * (c.compensator_length - x_c)
    q_in = q_t + c.q_pump - q_p
    spring = c.compensator_stiffness * (c.compensator_precompression - x_c)
    dy[0] = v_c
    dy[1] = ((c.p_am - p_t) * c.comp_area + spring - c.compensator_damping * v_c) / c.compensator_mass
    dy[2] = c.beta / volume * (c.comp_area * v_c - c.q_pump + q_in)

    # Arm
    v_sea, a_sea = current_at(c, t)
    inertia, torque = arm(c, theta, omega, v_sea, a_sea, c.load_weight)
    dy[3] = omega
    dy[4] = (torque + cylinder_force(c, p_1, p_2, x_h, v_h) * length1) / inertia

    # Lines, Eqs. 13-15, 21, 22
    inertance = c.rho * c.segment / c.line_area
    capacity = 2.0 * c.half_volume / c.beta
    for line in range(2):
        node, flow, first = (6, flow_a, 0) if line == 0 else (node_b, flow_b, n + 1)
        constant = c.eta0 * np.exp(c.alpha * min(node_pressure[first], node_pressure[first + n]))
        for i in range(n):
            p_i, p_o = node_pressure[first + i], node_pressure[first + i + 1]
            eta = segment_viscosity(c, p_i, p_o) if c.variable_viscosity != 0.0 else constant
            dy[flow + i] = (p_i - p_o - c.segment_loss * eta * y[flow + i]) / inertance
        for i in range(1, n):
            dy[node + i] = (y[flow + i - 1] - y[flow + i]) / capacity
    dy[6] = c.beta / c.half_volume * (q_a - y[flow_a])
    dy[node_b + n] = c.beta / c.half_volume * (y[flow_b + n - 1] - q_b)

    # Chambers, Eqs. 23, 24
    leak = c.leakage * (p_1 - p_2)
    volume1 = c.dead_volume + c.area1 * x_h + c.half_volume
    volume2 = c.dead_volume + c.area2 * (c.stroke - x_h) + c.half_volume
    dy[6 + n] = c.beta / volume1 * (y[flow_a + n - 1] - c.area1 * v_h - leak)
    dy[node_b] = c.beta / volume2 * (c.area2 * v_h + leak - y[flow_b])
    return dy


@njit
def jacobian(t: float, y: Array, c, piece: int, spool: float, step: Array) -> Array:
    """Central-difference derivative of ``derivative`` by the state; ``step`` is the half-width of each state."""
    result = np.empty((y.size, y.size))
    z = y.copy()
    for j in range(y.size):
        z[j] = y[j] + step[j]
        above, width = derivative(t, z, c, piece, spool), z[j]
        z[j] = y[j] - step[j]
        result[:, j] = (above - derivative(t, z, c, piece, spool)) / (width - z[j])
        z[j] = y[j]
    return result


@njit
def outputs(t: float, y: Array, c, piece: int) -> tuple:
    """Values of KEYS, in that order, at one instant."""
    n = (y.size - 8) // 4
    p_v = c.vapour_pressure
    p_t, p_a, p_1 = physical(y[2], p_v), physical(y[6], p_v), physical(y[6 + n], p_v)
    p_2, p_b = physical(y[7 + 2 * n], p_v), physical(y[7 + 3 * n], p_v)
    length, length1, _, _, _, _ = linkage(c, y[3])
    x_h, v_h = length - c.length0, length1 * y[4]
    x_cmd, v_cmd = command_at(c, piece, t)
    u, _ = controller(c, x_cmd, v_cmd, x_h, v_h, y[5])
    x_v = u / c.rated_current
    q_a, q_b, q_p, _ = valve(c, x_v, p_a, p_b, p_t)
    p_p = supply_pressure(c, x_v, p_a, p_b, p_t)
    force = cylinder_force(c, p_1, p_2, x_h, v_h)
    return (t, x_h, v_h, y[3], y[4], force, p_1, p_2, p_a, p_b, p_p, p_t, y[6 + 2 * n], y[8 + 3 * n], q_a, q_b,
            c.q_pump - q_p, x_v, u, x_cmd)  # fmt: skip


def _per_state(n: int, position: float, velocity: float, pressure: float, angle: float, rate: float, integral: float,
               flow: float) -> Array:  # fmt: skip
    """One number per state from one number per kind of state."""
    tank_arm_control = [position, velocity, pressure, angle, rate, integral]
    return np.array(tank_arm_control + 2 * ((n + 1) * [pressure] + n * [flow]))


def _difference_steps(n: int) -> Array:
    """Half-widths of the numerical derivative."""
    return _per_state(n, position=1e-7, velocity=1e-5, pressure=100.0, angle=1e-7, rate=1e-6, integral=1e-4, flow=1e-9)


def holding_force(machine: Machine) -> float:
    """Force (N) of the cylinder that holds the arm at x_h = 0 at rest, in the current of t = 0."""
    c = _constants(machine)
    _, torque = arm(c, machine.theta0, 0.0, current_at(c, 0.0)[0], 0.0, machine.load_weight)
    return -torque / linkage(c, machine.theta0)[1]


def _line_at_rest(machine: Machine, c: np.void, end: float, flow: float) -> Array:
    """Pressures (Pa) of all nodes of a line, from the end with the given pressure towards the source of the flow.

    The flow (m3/s) is positive towards that end. Eq. 22 or Eq. 21, the latter with the lower end's viscosity.
    """
    index = np.arange(machine.n_segments + 1)
    drop = c["segment_loss"] * c["eta0"] * flow
    if machine.variable_viscosity and machine.alpha > 0.0:
        return end - np.log1p(-index * machine.alpha * drop * np.exp(machine.alpha * end)) / machine.alpha

    def far(viscosity_pressure: float) -> float:
        return end + machine.n_segments * drop * np.exp(machine.alpha * viscosity_pressure)

    other = far(end) if flow >= 0.0 else brentq(lambda p: far(p) - p, 2 * far(end) - end - 1.0, end, xtol=1e-6)
    return np.linspace(end, other, machine.n_segments + 1)


def rest_state(machine: Machine) -> Array:
    """State at rest at x_h = 0 with zero position error: the spool replaces the piston's leakage.

    One unknown, the pressure of chamber 2. The holding force gives the pressure of chamber 1, both give the leakage,
    Eqs. 21 or 22 the pressures at the ports; the lands then need the same opening for the same flow.
    """
    c = _constants(machine)
    n, p_am = machine.n_segments, machine.ambient_pressure
    force = holding_force(machine)
    p_t = p_am + machine.compensator_stiffness * machine.compensator_precompression / c["comp_area"]
    p_p = p_t + machine.relief_pressure

    def opening(p_from: float, p_to: float, flow: float) -> float:
        if p_from <= p_to:
            return np.nan
        high = 1.0
        while land(c, high, p_from, p_to) < flow:
            high *= 2.0
        return brentq(lambda s: land(c, s, p_from, p_to) - flow, 0.0, high, xtol=1e-16, rtol=1e-14)

    def pressures(p_2: float) -> tuple[Array, Array, float]:
        p_1 = p_am + (force + (p_2 - p_am) * c["area2"]) / c["area1"]
        flow = machine.leakage * (p_1 - p_2)
        return _line_at_rest(machine, c, p_1, flow)[::-1], _line_at_rest(machine, c, p_2, -flow), flow

    def openings(p_2: float) -> tuple[float, float]:
        line_a, line_b, flow = pressures(p_2)
        if flow >= 0.0:
            return opening(p_p, line_a[0], flow), opening(line_b[-1], p_t, flow)
        return opening(p_p, line_b[-1], -flow), opening(line_a[0], p_t, -flow)

    def mismatch(p_2: float) -> float:
        supply, back = openings(p_2)
        return np.log(supply / back)

    if machine.leakage > 0.0:
        trial = np.linspace(p_t, p_p, 402)[1:-1]
        value = np.array([mismatch(p) for p in trial])
        change = np.flatnonzero(value[:-1] * value[1:] <= 0.0)  # false where not defined
        if change.size == 0:
            raise ValueError("no rest state: the supply cannot hold the load")
        p_2 = brentq(mismatch, trial[change[0]], trial[change[0] + 1], xtol=1e-6, rtol=1e-15)
        line_a, line_b, flow = pressures(p_2)
        x_v = np.sign(flow) * openings(p_2)[0]
    else:  # any pair of pressures holds with a closed spool; take the one with equal drops at both lands
        p_2 = (p_p + p_t - p_am - (force - p_am * c["area2"]) / c["area1"]) / (1 + c["area2"] / c["area1"])
        line_a, line_b, flow = pressures(p_2)
        x_v = 0.0
    y = np.zeros(4 * n + 8)
    y[2], y[3], y[5] = p_t, machine.theta0, x_v * machine.rated_current
    y[6 : 7 + n], y[7 + n : 7 + 2 * n] = line_a, flow
    y[7 + 2 * n : 8 + 3 * n], y[8 + 3 * n :] = line_b, flow
    return y


def solve_states(
    machine: Machine,
    t_eval: ArrayLike,
    rtol: float = 1e-9,
    atol_scale: float = 1.0,
    method: str = "Radau",
    max_step: float = np.inf,
    y0: Array | None = None,
) -> tuple[Array, NDArray[np.int64]]:
    """Integrate from rest at t = 0 (or from ``y0``) over ``t_eval`` (s, ascending, >= 0).

    Returns the states, one row per time, and the piece of the command (0..4) each row belongs to. A time on a corner
    belongs to the piece that starts there. ``atol_scale`` multiplies the absolute tolerances: 10 Pa, 1e-10 m3/s,
    1e-10 rad and the like. ``max_step`` is in s. Methods: Radau, BDF or LSODA.
    """
    times = np.asarray(t_eval, float)
    if times.size == 0 or times[0] < 0.0 or np.any(np.diff(times) <= 0.0):
        raise ValueError("t_eval must ascend from a time >= 0")
    for corner in machine.corners:  # k * 0.001 need not hit a corner exactly
        times = np.where(np.abs(times - corner) < 1e-9, corner, times)
    c, n = _constants(machine), machine.n_segments
    atol = atol_scale * _per_state(
        n, position=1e-10, velocity=1e-9, pressure=10.0, angle=1e-10, rate=1e-9, integral=1e-8, flow=1e-10
    )
    step = _difference_steps(n)
    y = rest_state(machine) if y0 is None else np.array(y0, float)
    states = np.empty((times.size, y.size))
    pieces = np.searchsorted(machine.corners, times, side="right")
    bounds = [0.0, *machine.corners, np.inf]
    for piece in range(5):
        start, end = bounds[piece], min(bounds[piece + 1], times[-1])
        rows = np.flatnonzero(pieces == piece)
        if end > start:
            result = solve_ivp(
                lambda t, z, k=piece: derivative(t, z, c, k, FREE),
                (start, end),
                y,
                method=method,
                t_eval=np.union1d(times[rows], [end]),
                rtol=rtol,
                atol=atol,
                max_step=max_step,
                jac=lambda t, z, k=piece: jacobian(t, z, c, k, FREE, step),
            )
            if not result.success:
                raise RuntimeError(f"{method} stopped at {result.t[-1]:.6f} s: {result.message}")
            states[rows] = result.y.T[: rows.size]
            y = result.y[:, -1]
        elif rows.size:  # the last time is this piece's own start
            states[rows] = y
    return states, pieces


def solve(
    machine: Machine,
    t_eval: ArrayLike,
    rtol: float = 1e-9,
    atol_scale: float = 1.0,
    method: str = "Radau",
    max_step: float = np.inf,
    y0: Array | None = None,
) -> dict[str, Array]:
    """The machine's signals at ``t_eval``; arguments as for ``solve_states``.

    Keys and units: time s; x_h, x_cmd m; v_h m/s; theta rad; omega rad/s; F_h N; P1, P2, Pa, Pb, Pp, Pt Pa;
    Q1 (into chamber 1), Q2 (out of chamber 2), Qa (out of port a), Qb (into port b), Qrv (relief valve) m3/s;
    x_v -1..1; u mA. On a corner of the command u and x_v hold the value just after it.
    """
    times = np.asarray(t_eval, float)
    states, pieces = solve_states(machine, times, rtol, atol_scale, method, max_step, y0)
    c = _constants(machine)
    rows = [outputs(t, y, c, piece) for t, y, piece in zip(times, states, pieces, strict=True)]
    return dict(zip(KEYS, np.array(rows).T.copy(), strict=True))


def mode(machine: Machine, state: Array | None = None, spool_fixed: bool = False, t: float = 0.0) -> NDArray:
    """Eigenvalues (1/s, complex, slowest first) of the whole equation linearised about a state.

    ``state`` is a row of ``solve_states`` or, by default, the state at rest; ``t`` (s) sets command and current.
    With ``spool_fixed`` the spool stays where the controller has it in that state: the open loop.
    """
    c = _constants(machine)
    y = rest_state(machine) if state is None else np.asarray(state, float)
    piece = int(np.searchsorted(machine.corners, t, side="right"))
    spool = outputs(t, y, c, piece)[KEYS.index("x_v")] if spool_fixed else FREE
    eigenvalues = np.linalg.eigvals(jacobian(t, y, c, piece, spool, _difference_steps(machine.n_segments)))
    return eigenvalues[np.argsort(np.abs(eigenvalues))]


def slowest_oscillation(eigenvalues: NDArray, floor: float = 1.0) -> tuple[float, float]:
    """Frequency |s|/2pi (Hz) and damping ratio of the slowest oscillating mode above ``floor`` (Hz), or nan."""
    s = eigenvalues[(eigenvalues.imag > 0.0) & (np.abs(eigenvalues) > 2 * np.pi * floor)]
    if s.size == 0:
        return np.nan, np.nan
    lowest = s[np.argmin(np.abs(s))]
    return float(np.abs(lowest) / (2 * np.pi)), float(-lowest.real / np.abs(lowest))


def travel_times(machine: Machine, result: dict[str, Array], tolerance: float = 1e-3) -> tuple[float, float]:
    """Extension and retraction time (s): from the start of each ramp until x_h is within ``tolerance`` (m) of its end.

    Interpolated linearly between the samples; nan if not reached.
    """
    t, x = result["time"], result["x_h"]

    def first(after: float, gap: Array) -> float:
        hit = np.flatnonzero((t >= after) & (gap <= 0.0))
        if hit.size == 0:
            return np.nan
        i = hit[0]
        if i == 0 or t[i] == after:
            return t[i] - after
        return t[i - 1] + (t[i] - t[i - 1]) * gap[i - 1] / (gap[i - 1] - gap[i]) - after

    extend = first(machine.extend_start, machine.command - tolerance - x)
    return float(extend), float(first(machine.retract_start, x - tolerance))


def main() -> None:
    """Print the travel times and wall times at the surface and at 11 km."""
    times = np.linspace(0.0, 22.0, 22001)
    solve(Machine(), times[:100])  # compile
    for depth, variable in ((0.0, True), (11.0, True), (11.0, False)):
        machine = Machine(depth=depth, variable_viscosity=variable)
        start = clock.perf_counter()
        result = solve(machine, times)
        wall = clock.perf_counter() - start
        extend, retract = travel_times(machine, result)
        viscosity = "variable" if variable else "constant"
        print(f"{depth:4.0f} km, {viscosity} viscosity: {extend:.4f} s out, {retract:.4f} s back; wall {wall:.1f} s")


if __name__ == "__main__":
    main()
