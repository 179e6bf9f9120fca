"""The plant's own equations of components and effects: oil, friction, valve lands, supply, delay.

Where the library regularises with tanh the plant uses exponentials, where it cuts sharply the plant bends smoothly, and
so on: the data are to come from other equations than those that are fitted to them. SI units; pressures are absolute.
"""

from __future__ import annotations

import numpy as np

from .compiled import kernel
from .machine import ATMOSPHERE, VOGEL_B, VOGEL_C

PADE = 4
"""States of the delay."""


@kernel
def physical(p: float, p_v: float) -> float:
    """Pressure (Pa) of a pressure state: the state itself, or a positive remainder below the vapour pressure."""
    return p if p >= p_v else p_v * np.exp(max((p - p_v) / p_v, -50.0))


@kernel
def viscosity_now(c, t: float) -> float:
    """Viscosity (Pa s) without pressure at time t (s): the oil may warm up during the run (Vogel's law)."""
    if c.warming == 0.0:
        return c.eta0
    T = c.temperature + c.warming * (1.0 - np.exp(-max(t, 0.0) / c.warming_time))
    return c.eta0 * np.exp(VOGEL_B / (T - VOGEL_C) - c.vogel0)


@kernel
def viscosity(c, eta0: float, P: float) -> float:
    """Viscosity (Pa s) at pressure P (Pa): Barus (Eq. 1), or between Barus and Roelands (1966)."""
    exponent = c.alpha * P
    if c.roelands > 0.0:
        other = (np.log(c.eta0) + 9.67) * ((1.0 + 5.1e-9 * P) ** c.roelands_z - 1.0)
        exponent = (1.0 - c.roelands) * exponent + c.roelands * other
    return eta0 * np.exp(exponent)


@kernel
def segment_viscosity(c, eta0: float, p_i: float, p_o: float) -> float:
    """Viscosity (Pa s) that makes Eq. 22 exact for Barus oil: the log-mean between both pressures."""
    mean = viscosity(c, eta0, 0.5 * (p_i + p_o))
    x = 0.5 * c.alpha * (p_i - p_o)
    return mean * (1.0 - x * x / 6.0) if abs(x) < 1e-4 else mean * x / np.sinh(x)


@kernel
def oil_compliance(c, P: float) -> float:
    """Relative volume change per pressure (1/Pa) of oil with free air, part of which dissolves (Henry's law).

    Bubbles follow P V^1.1 = const. Half of the air is dissolved at 40 MPa. The modulus may stiffen with pressure.
    """
    compliance = 1.0 / (c.beta + c.stiffening * (P - ATMOSPHERE))
    if c.air > 0.0:
        free = c.air / (1.0 + max(P - ATMOSPHERE, 0.0) / 40e6)
        compliance += free * (ATMOSPHERE / P) ** (1.0 / 1.1) / (1.1 * P)
    return compliance


@kernel
def wall_compliance(c, P: float) -> float:
    """Relative widening per pressure (1/Pa) of a hose: 10 % more without pressure, stiffer as it fills."""
    x = max(P - c.p_am, 0.0) / 10e6
    return c.hose * (1.1 - 0.2 * x / (1.0 + x))


@kernel
def turn(v: float, v_0: float) -> float:
    """Sign of v (m/s), regularised: sgn(v) (1 - exp(-|v|/v_0))."""
    return -np.expm1(-v / v_0) if v >= 0.0 else np.expm1(v / v_0)


@kernel
def friction(c, p1: float, p2: float, x: float, v: float, z: float) -> float:
    """Friction (N) of the piston beyond the plain viscous one, against v.

    Coulomb; Stribeck with a Gaussian (Armstrong-Helouvry); seals pressed on by |p1 - p2|, rounded at 0.03 MPa; a wrong
    viscous factor, thinning with speed; a scored place of the barrel; soft LuGre bristles deflected by z (m).
    """
    level = 0.0
    if c.coulomb != 0.0:
        level += c.coulomb
    if c.stribeck != 0.0:
        level += c.stribeck * np.exp(-((v / c.stribeck_velocity) ** 2))
    if c.seal_friction != 0.0:
        level += c.seal_friction * (np.sqrt((p1 - p2) ** 2 + 1e9) - 3.2e4)
    if c.scoring != 0.0:
        level += c.scoring * np.exp(-(((x - c.scoring_place) / c.scoring_width) ** 2))
    force = level * turn(v, c.friction_velocity) if level != 0.0 else 0.0
    if c.viscous_scale != 1.0:
        force += (c.viscous_scale - 1.0) * c.cylinder_damping * v / (1.0 + 0.5 * abs(v))
    if c.bristle > 0.0:
        force += c.bristle * z / c.bristle_length
    return force


@kernel
def opening(c, x_v: float) -> float:
    """Signed opening of the lands at spool position x_v: a rounded dead zone of half-width `overlap`."""
    if c.overlap == 0.0:
        return x_v
    bend = 0.1 * c.overlap
    s = abs(x_v)
    gap = np.sqrt((s - c.overlap) ** 2 + bend**2)
    shut = 0.5 * (-c.overlap + np.sqrt(c.overlap**2 + bend**2))
    value = (0.5 * (s - c.overlap + gap) - shut) / (1.0 - c.overlap)
    return value if x_v >= 0.0 else -value


@kernel
def land(c, eta0: float, s: float, p_from: float, p_to: float) -> float:
    """Flow (m3/s) through a land of opening s in 0..1, Eqs. 8 and 9, with the transition to laminar flow.

    The plain machine's transition is tanh(2 lam/lam_crit). Lands with another transition differ from it by the ratio of
    x/sqrt(1 + x^2), x = 2 lam/lam_crit, between the two.
    """
    dp = p_from - p_to
    nu = viscosity(c, eta0, 0.5 * (p_from + p_to)) / c.rho
    lam = c.land_diameter * np.sqrt(s) / nu * np.sqrt(2.0 * abs(dp) / c.rho)
    flow = c.k_q * s * np.sqrt(abs(dp)) * np.tanh(2.0 * lam / c.lam_crit)
    if c.lam_shift != c.lam_crit:
        x, y = 2.0 * lam / c.lam_crit, 2.0 * lam / max(c.lam_shift, 1.0)
        flow *= y / max(x, 1e-300) * np.sqrt((1.0 + x * x) / (1.0 + y * y)) if lam > 0.0 else 1.0
    return flow if dp >= 0.0 else -flow


@kernel
def land_leak(c, s: float) -> float:
    """Laminar leakage (m3/s/Pa) past each land: greatest with the spool in the middle, as of a worn valve."""
    return c.valve_leak * (0.3 + 0.7 / (1.0 + (s / 0.15) ** 2))


@kernel
def relief_pressure(c, t: float, p_t: float) -> float:
    """Pressure (Pa) at which the relief valve opens: set pressure, droop, hunting of the valve, a dip of the supply."""
    share = 1.0 - c.droop
    if c.hunting != 0.0:
        share += c.hunting * np.sin(2.0 * np.pi * c.hunting_frequency * t)
    if c.dip != 0.0:
        share -= c.dip * np.exp(-(((t - c.dip_time) / c.dip_width) ** 2))
    return p_t + c.relief_pressure * share


@kernel
def pump_flow(c, eta0: float, p_p: float, p_t: float) -> float:
    """Flow (m3/s) that the pump delivers against p_p (Pa): what slips is laminar, Q = n v_p - k dp/eta (Wilson 1950).

    The viscosity is that in the middle between both pressures.
    """
    if c.slip == 0.0:
        return c.q_pump
    thicker = viscosity(c, eta0, 0.5 * (p_p + p_t)) / (c.rho * c.nu0)
    return c.q_pump * max(1.0 - c.slip * (p_p - p_t) / c.relief_pressure / thicker, 0.05)


@kernel
def relief_flow(c, over: float) -> float:
    """Flow (m3/s) of a relief valve with override, `over` (Pa) above its opening pressure.

    Slightly bent, through R Q at the pump's full flow, with a dead band of 1 %.
    """
    x = over / (c.override * c.q_pump) - 0.01
    soft = 0.5 * (x + np.sqrt(x * x + 1e-5))
    return c.q_pump * soft * (1.0 + 0.08 * (1.0 - soft) / (1.0 + soft)) / 0.99


@kernel
def delayed(c, u: float, q, rate) -> float:
    """Value of u delayed by c.delay, and the rates of the four states q: Pade's approximation [3/4] of exp(-s tau).

    Good to about omega tau = 5.
    """
    rate[0] = q[1] / c.delay
    rate[1] = q[2] / c.delay
    rate[2] = q[3] / c.delay
    # D(x) = 1 + 4/7 x + 1/7 x^2 + 2/105 x^3 + 1/840 x^4, N(x) = 1 - 3/7 x + 1/14 x^2 - 1/210 x^3
    rate[3] = 840.0 * (u - q[0] - 4.0 / 7.0 * q[1] - q[2] / 7.0 - 2.0 / 105.0 * q[3]) / c.delay
    return q[0] - 3.0 / 7.0 * q[1] + q[2] / 14.0 - q[3] / 210.0
