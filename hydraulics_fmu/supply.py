"""Pump and ideal relief valve (Eqs. 4-7): constant pressure above the tank as long as the pump's flow suffices."""

from __future__ import annotations

from math import exp

from ..core.jit import kernel
from .oil import gap_flow
from .valve import land, supplied_opening

CLOSE = 1e-5
"""How far a pressure may be from where it balances [Pa]: what the integrator's differences see is a million times as
much."""

ENOUGH = 1e-12
"""Share of the pump's flow that a port's may be off: of 10 MPa, that is `CLOSE`, too."""

MOST_LOOKS = 60
"""Looks for it; most take six."""


def pump_flow(ideal: float, slip: float, thicker: float, turbulent: float = 0.0) -> float:
    """Flow [m3/s] that a pump delivers: Q = n v_p - c dp/eta (Wilson 1950), with dp that of the relief valve.

    slip: share of the ideal flow n v_p lost with oil as thin as at the surface; thicker: viscosity in the pump over
    that; turbulent: share of the slip that the viscosity does not lessen. What slips runs back inside the pump: of oil
    so thin that all of it does, the pump delivers nothing.
    """
    if turbulent != 0.0:
        return max(0.0, ideal * (1.0 - slip * ((1.0 - turbulent) / thicker + turbulent)))
    return max(0.0, ideal * (1.0 - slip / thicker))


@kernel
def sunk(t: float, c: object) -> float:
    """The relief valve's set pressure [Pa] at t [s], lowered at once or from the start of the run on."""
    droop = c.effect.supply_droop
    return c.relief.p_crack * (1.0 - droop.droop * (1.0 - exp(-max(t, 0.0) / droop.time)))


@kernel
def limited_by_pump(demand: float, Q_pump: float) -> float:
    """Flow [m3/s] into the valve: what it demands at the relief pressure, but never more than the pump delivers."""
    return min(demand, Q_pump)


@kernel
def relief_flow(Q: float, c: object) -> float:
    """Flow [m3/s] that a relief valve's pressure rises with: Q, or Q_pump (Q/Q_pump)^power."""
    power = c.effect.relief_override.power
    return Q if power == 1.0 or Q <= 0.0 or c.pump.flow <= 0.0 else c.pump.flow * (Q / c.pump.flow) ** power


@kernel
def narrowed(
    P: float, excess: float, low: float, over: float, high: float, under: float, kept: float
) -> tuple[float, float, float, float, float]:
    """A bracket [Pa] of a falling function's zero with the place P, and `excess` there, for one of its ends; `over` and
    `under` are at the ends, at one that stays twice by half (Illinois), and `kept` says which stayed last."""
    if excess > 0.0:
        return P, excess, high, under * (0.5 if kept > 0.0 else 1.0), 1.0
    return low, over * (0.5 if kept < 0.0 else 1.0), P, excess, -1.0


@kernel
def demanded(P: float, s: float, Pa: float, Pb: float, c: object) -> float:
    """Flow [m3/s] that the supplied land and the leakage to both ports would take at P [Pa] at port p."""
    leak, bent, thinner = c.valve.leak, c.effect.valve_leakage.turbulent, c.oil.thinner
    demand = land(abs(s), P, Pa if s >= 0.0 else Pb, c)
    demand += gap_flow(P - Pa, leak.pa, bent, thinner) + gap_flow(P - Pb, leak.pb, bent, thinner)
    return demand


@kernel
def _relief_excess(P: float, s: float, Pa: float, Pb: float, P_set: float, c: object) -> float:
    """What the relief valve's pressure [Pa] with its override, less what the filter takes, is beyond P; it falls as P
    rises, by at least as much."""
    demand = demanded(P, s, Pa, Pb, c)
    return P_set + c.effect.relief_override.R * relief_flow(c.pump.flow - demand, c) - c.supply.filter * demand - P


@kernel
def relief_pressure(s: float, Pa: float, Pb: float, Pt: float, c: object) -> float:
    """Pressure [Pa] at port p, as long as the pump suffices; s: signed opening of the supplied land.

    The relief valve's rises with its flow, by R Q_rv or with another power of it, and a filter takes F Q_p away;
    Q_rv = Q_pump - Q_p, and the demand Q_p (land and leakage to both ports) grows with the pressure, so that
    P = P_set + R Q_rv - F Q_p between two pressures, to within `CLOSE`.
    """
    P_set, R, F, Q_pump = Pt + c.relief.p_set, c.effect.relief_override.R, c.supply.filter, c.pump.flow
    if R == 0.0 and F == 0.0:
        return P_set
    low, high = max(P_set - F * Q_pump, 0.0), P_set + R * Q_pump
    over, under = _relief_excess(low, s, Pa, Pb, P_set, c), _relief_excess(high, s, Pa, Pb, P_set, c)
    if over <= 0.0 or under >= 0.0:
        return low if over <= 0.0 else high
    P, kept = high, 0.0
    for _ in range(MOST_LOOKS):
        P = low + (high - low) * over / (over - under)
        excess = _relief_excess(P, s, Pa, Pb, P_set, c)
        if abs(excess) <= CLOSE:
            break
        low, over, high, under, kept = narrowed(P, excess, low, over, high, under, kept)
    return P


@kernel
def port_pressure(x_v: float, Pa: float, Pb: float, Pt: float, c: object) -> float:
    """Pressure [Pa] at port p with the spool at x_v and these pressures at the other ports.

    What `relief_pressure` says while the pump suffices (Eq. 6), else what drives Q_pump through land and leakage: their
    flow grows with the supply pressure, so it lies between the ports and that pressure.
    """
    s, Q_pump = supplied_opening(x_v, c), c.pump.flow
    if c.valve.leak.pa + c.valve.leak.pb > 0.0:
        return _starved_with_leaks(s, Pa, Pb, relief_pressure(s, Pa, Pb, Pt, c), c)
    P_port, P_relief = Pa if s >= 0.0 else Pb, relief_pressure(s, Pa, Pb, Pt, c)
    under = Q_pump - land(abs(s), P_relief, P_port, c)
    if under >= 0.0:
        return P_relief
    low, high, over = P_port, P_relief, Q_pump
    P, kept = high, 0.0
    for _ in range(MOST_LOOKS):
        P = low + (high - low) * over / (over - under)
        missing = Q_pump - land(abs(s), P, P_port, c)
        if abs(missing) <= ENOUGH * Q_pump:
            break
        low, over, high, under, kept = narrowed(P, missing, low, over, high, under, kept)
    return P


@kernel
def _starved_with_leaks(s: float, Pa: float, Pb: float, P_relief: float, c: object) -> float:
    """`port_pressure` where the lands leak: below both ports nothing is taken."""
    Q_pump = c.pump.flow
    under = Q_pump - demanded(P_relief, s, Pa, Pb, c)
    if under >= 0.0:
        return P_relief
    low, high = min(Pa, Pb), P_relief
    over = Q_pump - demanded(low, s, Pa, Pb, c)
    P, kept = high, 0.0
    for _ in range(MOST_LOOKS):
        P = low + (high - low) * over / (over - under)
        missing = Q_pump - demanded(P, s, Pa, Pb, c)
        if abs(missing) <= ENOUGH * Q_pump:
            break
        low, over, high, under, kept = narrowed(P, missing, low, over, high, under, kept)
    return P


@kernel
def return_pressure(a_t: float, b_t: float, Pa: float, Pb: float, Pt: float, c: object) -> float:
    """Pressure [Pa] at port t: that of the tank, and what a clogged filter holds back of the lands' flow."""
    if c.supply.filter_back == 0.0:
        return Pt
    low, high = Pt, max(Pa, Pb, Pt)
    over = _held_back(low, a_t, b_t, Pa, Pb, Pt, c)
    under = _held_back(high, a_t, b_t, Pa, Pb, Pt, c)
    if over <= 0.0 or under >= 0.0:
        return low if over <= 0.0 else high
    P, kept = low, 0.0
    for _ in range(MOST_LOOKS):
        P = low + (high - low) * over / (over - under)
        excess = _held_back(P, a_t, b_t, Pa, Pb, Pt, c)
        if abs(excess) <= CLOSE:
            break
        low, over, high, under, kept = narrowed(P, excess, low, over, high, under, kept)
    return P


@kernel
def _held_back(P: float, a_t: float, b_t: float, Pa: float, Pb: float, Pt: float, c: object) -> float:
    """What a filter in the return holds back [Pa] with P before it, less the difference P - Pt."""
    return c.supply.filter_back * (land(a_t, Pa, P, c) + land(b_t, Pb, P, c)) - (P - Pt)
