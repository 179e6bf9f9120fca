"""The servo valve: four lands of equal gain, each an orifice with a laminar-turbulent transition (Eqs. 8-12)."""

from __future__ import annotations

from math import exp, pi, sqrt, tanh

from ..core.jit import kernel
from .curves import on_curve
from .oil import heavier, viscosity

CQ_MAX = 0.7
"""Discharge coefficient of the fully turbulent land (usual value for sharp edges)."""

SMOOTHING = 100.0
"""Pressure drop [Pa] below which the printed square root is made linear, so that its slope stays finite."""

COUNTERBALANCE_RANGE, COUNTERBALANCE_LEAK = 0.2, 1e-3
"""Share of its pressure over which a counterbalance valve opens, and the opening that it keeps when it is shut."""

SILT_MOVES = 1e-6
"""Share of the stroke by which a spool has moved."""


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
def turbulent_share(x: float, transition: float) -> float:
    """Flow through an orifice over that of the printed equation, x = 2 lam/lam_crit; x itself where it is laminar.

    transition 0: tanh x (Amesim); -1: sharper, x/(1 + x^4)^(1/4), which is dp/(dp^2 + dp_crit^2)^(1/4) (Simscape);
    1: more gradual, x/(1 + x^2)^(1/2); between them a mean of two.
    """
    if transition == 0.0:
        return tanh(x)
    other = x / sqrt(1.0 + x * x) if transition > 0.0 else x / sqrt(sqrt(1.0 + x * x * x * x))
    return tanh(x) + abs(transition) * (other - tanh(x))


@kernel
def land_flow(
    opening: float, P_from: float, P_to: float,
    k_q: float, diameter: float, lam_crit: float, rho: float, eta0: float, alpha: float, law: float = 0.0,
    transition: float = 0.0,
) -> float:  # fmt: skip
    """Flow [m3/s] through one land of relative `opening` (0..1) from pressure P_from to P_to [Pa] (Eqs. 8, 9).

    Q = k_q opening sqrt(dp) tanh(2 lam/lam_crit), with the flow number lam = (d/nu) sqrt(2 dp/rho), nu at the mean
    of the two pressures and d = diameter sqrt(opening). lam_crit = 0 gives the printed equation, whose square root is
    made linear below 100 Pa. `transition` puts another law in tanh's place, see `turbulent_share`. Negative when P_to
    is the higher one.
    """
    dp = P_from - P_to
    size = abs(dp)
    if lam_crit > 0.0:
        root = sqrt(size)
        nu = viscosity(0.5 * (P_from + P_to), eta0, alpha, law) / rho
        lam = diameter * sqrt(opening) / nu * root * sqrt(2.0 / rho)
        flow = k_q * opening * root * turbulent_share(2.0 * lam / lam_crit, transition)
    else:
        flow = k_q * opening * size / sqrt(sqrt(dp * dp + SMOOTHING * SMOOTHING))
    return flow if dp >= 0.0 else -flow


@kernel
def spool_command(u: float, c: object) -> float:
    """Commanded spool position k_v u with k_v = 1/i_rated (Eq. 10), shifted by the null shift, in -1..1."""
    return min(max(u / c.valve.i_rated + c.effect.valve_null_shift.shift, -1.0), 1.0)


@kernel
def caught_command(u: float, c: object, m: object) -> float:
    """Where the spool is sent by the controller output u [mA], as far as play and silt let it."""
    x = spool_command(u, c)
    return x if m.play == 0.0 else held_back(x, m.spool, m.play)


@kernel
def spool_position(u: float, state: float, c: object, m: object) -> float:
    """Spool position x_v in -1..1: its command at once, or the spool's own state when it has dynamics."""
    if c.valve.spool_time == 0.0:
        return caught_command(u, c, m)
    return min(max(state, -1.0), 1.0)


@kernel
def counterbalance_loss(Q: float, P_load: float, P_pilot: float, c: object) -> float:
    """Loss [Pa] of a flow Q [m3/s] out of the cylinder's piston side through a counterbalance valve, (Q/(k o))^2.

    The load's pressure and, `ratio` times as much, the pilot's, which is that of the rod side, open it: from
    p_set above the sea on, wide over `COUNTERBALANCE_RANGE` of that. Into the cylinder a check valve lets all pass.
    """
    effect, p_am = c.effect.counterbalance_valve, c.sea.p_am
    over = (P_load - p_am) + effect.ratio * (P_pilot - p_am) - effect.p_set
    opening = min(max(over / (COUNTERBALANCE_RANGE * effect.p_set), COUNTERBALANCE_LEAK), 1.0)
    return (Q / (c.counterbalance.k_q * opening)) ** 2


@kernel
def sticks(c: object) -> bool:
    """Whether the spool has a play or silts up."""
    return c.effect.valve_hysteresis.width > 0.0 or c.effect.silt_lock.force > 0.0


@kernel
def settle(u: float, c: object, m: object) -> None:
    """The spool as it stands in the middle of its play after a long rest with the controller output u [mA]."""
    m.spool, m.play = spool_command(u, c), 0.5 * c.effect.valve_hysteresis.width + c.effect.silt_lock.force * m.silt


@kernel
def let_go(u: float, h: float, c: object, m: object) -> None:
    """Bring the memory of the spool up to date after a slice of h [s] that ended with the controller output u [mA].

    Silt settles as 1 - exp(-t/time) while the spool stands; what sends it further than the silt holds washes it out.
    """
    x, silt = spool_command(u, c), c.effect.silt_lock
    moved = abs(held_back(x, m.spool, m.play) - m.spool)
    if silt.force > 0.0:
        if moved > SILT_MOVES:
            m.silt = 0.0
        else:
            m.silt += (1.0 - m.silt) * (1.0 - exp(-h / silt.time))
    m.spool = held_back(x, m.spool, m.play)
    m.play = 0.5 * c.effect.valve_hysteresis.width + silt.force * m.silt


@kernel
def held_back(x: float, at: float, width: float) -> float:
    """Where a spool stands that stood at `at` and is wanted at x, with a play of so much to either side."""
    return min(max(at, x - width), x + width)


@kernel
def land(opening: float, P_from: float, P_to: float, c: object) -> float:
    """Flow [m3/s] through one land of the servo valve; oil that pressure makes heavier flows slower."""
    valve, oil = c.valve, c.oil
    k_q, rho = valve.k_q, oil.rho
    if c.effect.density_pressure.share > 0.0:
        more = heavier(0.5 * (P_from + P_to), c)
        k_q, rho = k_q / sqrt(more), rho * more
    return land_flow(
        opening, P_from, P_to, k_q, valve.land_diameter, valve.lam_crit, rho, oil.eta0, oil.alpha,
        c.effect.viscosity_law.share, c.effect.orifice_flow_number.transition,
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
