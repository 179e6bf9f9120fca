"""The plant's own equations of components and effects: oil, friction, valve lands, delay.

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

    Bubbles follow P V^n = const; half of the air is dissolved at `air_half`. The modulus may stiffen with pressure.
    """
    compliance = 1.0 / (c.beta + c.stiffening * (P - ATMOSPHERE))
    if c.air > 0.0:
        free = c.air / (1.0 + max(P - ATMOSPHERE, 0.0) / c.air_half)
        compliance += free * (ATMOSPHERE / P) ** (1.0 / c.air_exponent) / (c.air_exponent * P)
    return compliance


@kernel
def denser(c, P: float) -> float:
    """Density at P (Pa) relative to that of the surface (Dowson & Higginson 1966, Elasto-Hydrodynamic Lubrication)."""
    return 1.0 if c.density == 0.0 else 1.0 + c.density * 0.6e-9 * P / (1.0 + 1.7e-9 * P)


@kernel
def wall_compliance(c, P: float) -> float:
    """Relative widening per pressure (1/Pa) of a hose: `hose` at 10 MPa above ambient, stiffer as it fills."""
    x = max(P - c.p_am, 0.0) / 10e6
    return c.hose * (1.0 + 0.5 * c.hose_fade - c.hose_fade * x / (1.0 + x))


@kernel
def turn(v: float, v_0: float) -> float:
    """Sign of v (m/s), regularised: sgn(v) (1 - exp(-|v|/v_0))."""
    return -np.expm1(-v / v_0) if v >= 0.0 else np.expm1(v / v_0)


@kernel
def friction_level(c, p1: float, p2: float, x: float, v: float) -> float:
    """Greatest friction (N) that resists sliding at v: Coulomb, Stribeck, of seals, of a scored place of the barrel.

    Stribeck with a Gaussian (Armstrong-Helouvry) or another exponent; seals pressed on by |p1 - p2|, rounded at
    0.03 MPa.
    """
    level = 0.0
    if c.coulomb != 0.0:
        level += c.coulomb
    if c.stribeck != 0.0:
        if c.stribeck_exponent == 2.0:
            level += c.stribeck * np.exp(-((v / c.stribeck_velocity) ** 2))
        else:
            level += c.stribeck * np.exp(-(((v / c.stribeck_velocity) ** 2 + 1e-8) ** (0.5 * c.stribeck_exponent)))
    if c.seal_friction != 0.0:
        level += c.seal_friction * (np.sqrt((p1 - p2) ** 2 + 1e9) - 3.2e4)
    if c.scoring != 0.0:
        level += c.scoring * np.exp(-(((x - c.scoring_place) / c.scoring_width) ** 2))
    return level


@kernel
def directed(c, level: float, v: float) -> float:
    """That friction (N) with its unevenness: greater extending, less retracting."""
    return level * (1.0 + c.friction_uneven * turn(v, c.friction_velocity))


@kernel
def bristle_rate(c, p1: float, p2: float, x: float, v: float, z: float) -> float:
    """Rate (m/s) of the deflection z (m) of the bristles of presliding (LuGre): they yield at the level of friction.

    z' = v - |v| z/z_s, with z_s = `presliding` times the level there relative to that near rest.
    """
    rest = max(friction_level(c, p1, p2, x, 0.0), 1.0)
    share = max(directed(c, friction_level(c, p1, p2, x, v), v) / rest, 1e-3)
    return v - abs(v) * z / (c.presliding * share)


@kernel
def bristle_force(c, p1: float, p2: float, x: float, v: float, z: float) -> float:
    """Friction (N) of the bristles: their stiffness, and a damping that fades with speed so that none is driven."""
    rest = max(friction_level(c, p1, p2, x, 0.0), 1.0)
    time = c.presliding_time * np.exp(-((v / 2e-3) ** 2))
    return rest / c.presliding * (z + time * bristle_rate(c, p1, p2, x, v, z))


@kernel
def friction(c, p1: float, p2: float, x: float, v: float, z: float) -> float:
    """Friction (N) of the piston beyond the plain viscous one, against v.

    What `friction_level` says, turning its sign with v or by bristles; a wrong viscous factor, thinning with speed or a
    power of it, right at 0.05 m/s; soft LuGre bristles deflected by z (m).
    """
    if c.presliding > 0.0:
        force = bristle_force(c, p1, p2, x, v, z)
    else:
        level = friction_level(c, p1, p2, x, v)
        if c.friction_uneven != 0.0:
            level = directed(c, level, v)
        force = level * turn(v, c.friction_velocity) if level != 0.0 else 0.0
    if c.viscous_scale != 1.0:
        if c.viscous_power == 1.0:
            force += (c.viscous_scale - 1.0) * c.cylinder_damping * v / (1.0 + 0.5 * abs(v))
        else:
            bent = ((v * v + 1e-8) / 0.05**2) ** (0.5 * (c.viscous_power - 1.0))
            force += (c.viscous_scale - 1.0) * c.cylinder_damping * v * bent
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
def edge(s: float, overlap: float) -> float:
    """Opening of one land, s (-1..1) towards opening, with an overlap of its own; negative: underlap."""
    bend = 0.1 * max(abs(overlap), 1e-3)
    gap = np.sqrt((s - overlap) ** 2 + bend**2)
    shut = 0.5 * (-overlap + np.sqrt(overlap**2 + bend**2)) if overlap > 0.0 else 0.0
    return max((0.5 * (s - overlap + gap) - shut) / (1.0 - overlap), 0.0)


@kernel
def notched(c, s: float) -> float:
    """Opening (0..1) that passes what notches do: the flow gain is wrong up to `notch`, its slope right beyond."""
    return s if s <= c.notch else c.notch + (s - c.notch) / c.flow_gain


@kernel
def lands(c, x_v: float) -> tuple[float, float, float, float]:
    """Openings (0..1) of the lands p-a, a-t, p-b, b-t at spool position x_v; in the plain form two of them."""
    if c.lands_apart != 0.0:
        o = c.overlap
        pa, at = edge(x_v, o * c.overlap_pa), edge(-x_v, o * c.overlap_at)
        pb, bt = edge(-x_v, o * c.overlap_pb), edge(x_v, o * c.overlap_bt)
    else:
        s = opening(c, x_v)
        pa = bt = max(s, 0.0)
        at = pb = max(-s, 0.0)
    if c.notch < 1.0:
        pa, at, pb, bt = notched(c, pa), notched(c, at), notched(c, pb), notched(c, bt)
    if c.gain_retract != 1.0:
        back = (1.0 + (c.flow_gain - 1.0) * c.gain_retract) / c.flow_gain
        at, pb = back * at, back * pb
    return pa, at, pb, bt


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
    if c.density != 0.0:  # turbulent oil feels it, laminar oil does not
        heavy, wall = np.sqrt(denser(c, 0.5 * (p_from + p_to))), 2.0 * lam / c.lam_crit
        flow *= np.tanh(heavy * wall) / max(heavy * np.tanh(wall), 1e-300) if lam > 0.0 else 1.0
    return flow if dp >= 0.0 else -flow


@kernel
def land_leak(c, s: float) -> float:
    """Laminar leakage (m3/s/Pa) past each land: greatest with the spool in the middle, as of a worn valve."""
    return c.valve_leak * (0.3 + 0.7 / (1.0 + (s / 0.15) ** 2))


@kernel
def leak(k: float, dp: float, turbulent: float) -> float:
    """Leakage (m3/s) at dp (Pa): k dp, of which a share is turbulent and grows with the root, the same at 10 MPa.

    The root is rounded below 0.05 MPa.
    """
    if turbulent == 0.0:
        return k * dp
    return k * dp * (1.0 - turbulent + turbulent * np.sqrt(10e6 / np.sqrt(dp * dp + 2.5e9)))


@kernel
def piston_leak(c, dp: float) -> float:
    """Leakage (m3/s) of the piston at dp (Pa); what it leaks beyond the data sheet may be turbulent or open with dp."""
    if c.piston_turbulent == 0.0 and c.piston_opening == 0.0:
        return c.leakage * c.leakage_scale * dp
    further = leak(c.leakage * (c.leakage_scale - 1.0), dp, c.piston_turbulent)
    return c.leakage * dp + further * (1.0 + c.piston_opening * abs(dp) / 10e6)


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
