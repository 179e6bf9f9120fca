"""The servo valve: four lands of equal gain, each an orifice with a laminar-turbulent transition (Eqs. 8-12)."""

from __future__ import annotations

from math import pi, sqrt, tanh

from ..core.jit import kernel
from .curves import on_curve
from .oil import viscosity

CQ_MAX = 0.7
"""Discharge coefficient of the fully turbulent land (usual value for sharp edges)."""

SMOOTHING = 100.0
"""Pressure drop [Pa] below which the printed square root is made linear, so that its slope stays finite."""


def flow_gain(q_rated: float, dp_rated: float) -> float:
    """Gain k_q [m3/(s sqrt(Pa))] of one land at full opening, from its rated point."""
    return q_rated / sqrt(dp_rated)


def land_diameter(q_rated: float, dp_rated: float, rho: float) -> float:
    """Hydraulic diameter [m] of one land at full opening: that of the circle with area q/(CQ_MAX sqrt(2 dp/rho))."""
    area = q_rated / (CQ_MAX * sqrt(2.0 * dp_rated / rho))
    return sqrt(4.0 * area / pi)


@kernel
def land_opening(x: float, overlap: float) -> float:
    """Opening (0..1) of a land that the spool opens by moving so far, x in -1..1: with an overlap the first part of the
    stroke opens nothing; a land with underlap, a negative one, is open already when the spool is centred."""
    if x <= overlap:
        return 0.0
    if overlap == 0.0:
        return x
    return (x - overlap) / (1.0 - overlap)


@kernel
def notched(opening: float, gain: float, notch: float) -> float:
    """Opening (0..1) of a land whose flow gain is wrong by the factor `gain` up to the opening `notch` only: beyond it
    the slope is that of a right one."""
    if opening <= notch:
        return opening
    return notch + (opening - notch) / gain


@kernel
def limited(w: float, stroke_time: float) -> float:
    """Speed [1/s] at which a spool moves that would at w but takes a `stroke_time` [s] for its stroke at the least.

    w / (1 + (w stroke_time)^4)^(1/4); 0: no limit.
    """
    return w / sqrt(sqrt(1.0 + (w * stroke_time) ** 4))


@kernel
def spool_acceleration(x_v: float, w: float, x_c: float, T: float, damping: float) -> float:
    """Acceleration [1/s2] of a spool that follows its command x_c: T^2 x'' + 2 damping T x' + x = x_c."""
    return (x_c - x_v - 2.0 * damping * T * w) / (T * T)


@kernel
def land_flow(
    opening: float, P_from: float, P_to: float,
    k_q: float, diameter: float, lam_crit: float, rho: float, eta0: float, alpha: float, law: float = 0.0,
) -> float:  # fmt: skip
    """Flow [m3/s] through one land of relative `opening` (0..1) from pressure P_from to P_to [Pa] (Eqs. 8, 9).

    Q = k_q opening sqrt(dp) tanh(2 lam/lam_crit), with the flow number lam = (d/nu) sqrt(2 dp/rho), nu at the mean
    of the two pressures and d = diameter sqrt(opening). lam_crit = 0 gives the printed equation, whose square root is
    made linear below 100 Pa. Negative when P_to is the higher one.
    """
    dp = P_from - P_to
    size = abs(dp)
    if lam_crit > 0.0:
        root = sqrt(size)
        nu = viscosity(0.5 * (P_from + P_to), eta0, alpha, law) / rho
        lam = diameter * sqrt(opening) / nu * root * sqrt(2.0 / rho)
        flow = k_q * opening * root * tanh(2.0 * lam / lam_crit)
    else:
        flow = k_q * opening * size / sqrt(sqrt(dp * dp + SMOOTHING * SMOOTHING))
    return flow if dp >= 0.0 else -flow


@kernel
def spool_command(u: float, c: object) -> float:
    """Commanded spool position k_v u with k_v = 1/i_rated (Eq. 10), shifted by the null shift, in -1..1."""
    return min(max(u / c.valve.i_rated + c.effect.valve_null_shift.shift, -1.0), 1.0)


@kernel
def spool_position(u: float, state: float, c: object) -> float:
    """Spool position x_v in -1..1: its command at once, or the spool's own state when it has dynamics."""
    if c.valve.spool_time == 0.0:
        return spool_command(u, c)
    return min(max(state, -1.0), 1.0)


@kernel
def land(opening: float, P_from: float, P_to: float, c: object) -> float:
    """Flow [m3/s] through one land of the servo valve."""
    valve, oil = c.valve, c.oil
    return land_flow(
        opening, P_from, P_to, valve.k_q, valve.land_diameter, valve.lam_crit, oil.rho, oil.eta0, oil.alpha,
        c.effect.viscosity_law.share,
    )  # fmt: skip


@kernel
def land_of(x: float, overlap: float, c: object) -> float:
    """Opening (0..1) of a land that the spool opens by moving so far."""
    opening, gain = land_opening(x, overlap), c.effect.valve_flow_gain
    return opening if gain.notch == 1.0 else notched(opening, gain.scale, gain.notch)


@kernel
def metered(opening: float, x_v: float, c: object) -> float:
    """Opening (0..1) of a land that the spool opens by where it is, with what the metering curve adds."""
    if c.valve.curved == 0.0:
        return opening
    return max(0.0, opening + on_curve(x_v, c.valve.metering, 0.0))


@kernel
def supplied_opening(x_v: float, c: object) -> float:
    """Opening of the land p-a, or that of the land p-b with a negative sign; of two at most one is open."""
    if x_v >= 0.0:
        return metered(land_of(x_v, c.valve.overlap.pa, c), x_v, c)
    return -metered(c.valve.retraction * land_of(-x_v, c.valve.overlap.pb, c), x_v, c)
