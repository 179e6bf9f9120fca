"""Pump and ideal relief valve (Eqs. 4-7): constant pressure above the tank as long as the pump's flow suffices."""

from __future__ import annotations

from ..core.jit import kernel
from .oil import gap_flow
from .valve import land_flow, supplied_opening


def pump_flow(ideal: float, slip: float, thicker: float) -> float:
    """Flow [m3/s] that a pump delivers: Q = n v_p - c dp/eta (Wilson 1950), with dp that of the relief valve.

    slip: share of the ideal flow n v_p lost with oil as thin as at the surface; thicker: viscosity in the pump over
    that. What slips runs back inside the pump.
    """
    return ideal * (1.0 - slip / thicker)


@kernel
def limited_by_pump(demand: float, Q_pump: float) -> float:
    """Flow [m3/s] into the valve: what it demands at the relief pressure, but never more than the pump delivers."""
    return min(demand, Q_pump)


@kernel
def override_pressure(
    P_set: float, R: float, Q_pump: float, leak_a: float, leak_b: float, turbulent: float, Pa: float, Pb: float,
    opening: float, P_port: float,
    k_q: float, diameter: float, lam_crit: float, rho: float, eta0: float, alpha: float, law: float = 0.0,
    thinner: float = 1.0,
) -> float:  # fmt: skip
    """Supply pressure [Pa] of a relief valve whose pressure rises with its flow: P_p = P_set + R Q_rv.

    Q_rv = Q_pump - demand(P_p), and the demand (land and leakage to both ports) grows with P_p, so bisection closes it.
    P_set when the demand takes all the pump gives.
    """
    low, high = P_set, P_set + R * Q_pump
    for _ in range(40):
        P = 0.5 * (low + high)
        demand = land_flow(opening, P, P_port, k_q, diameter, lam_crit, rho, eta0, alpha, law)
        demand += gap_flow(P - Pa, leak_a, turbulent, thinner) + gap_flow(P - Pb, leak_b, turbulent, thinner)
        if P_set + R * (Q_pump - demand) > P:
            low = P
        else:
            high = P
    return 0.5 * (low + high)


@kernel
def supply_pressure(
    opening: float, P_port: float, P_relief: float, Q_pump: float,
    k_q: float, diameter: float, lam_crit: float, rho: float, eta0: float, alpha: float, law: float = 0.0,
) -> float:  # fmt: skip
    """Pressure [Pa] at port p: the relief valve's while the pump suffices (Eq. 6), else what drives Q_pump.

    The land's flow grows with its supply pressure, so the second case is solved by bisection between the port and
    the relief pressure.
    """
    if land_flow(opening, P_relief, P_port, k_q, diameter, lam_crit, rho, eta0, alpha, law) <= Q_pump:
        return P_relief
    low, high = P_port, P_relief
    for _ in range(60):
        middle = 0.5 * (low + high)
        if land_flow(opening, middle, P_port, k_q, diameter, lam_crit, rho, eta0, alpha, law) > Q_pump:
            high = middle
        else:
            low = middle
    return 0.5 * (low + high)


@kernel
def relief_pressure(s: float, Pa: float, Pb: float, Pt: float, c: object) -> float:
    """Pressure [Pa] that the relief valve holds at port p, as long as the pump suffices; s: signed opening."""
    P, valve, oil = Pt + c.relief.p_set, c.valve, c.oil
    if c.effect.relief_override.R == 0.0:
        return P
    return override_pressure(
        P, c.effect.relief_override.R, c.pump.flow, valve.leak.pa, valve.leak.pb, c.effect.valve_leakage.turbulent,
        Pa, Pb, abs(s), Pa if s >= 0.0 else Pb, valve.k_q, valve.land_diameter, valve.lam_crit, oil.rho, oil.eta0,
        oil.alpha, c.effect.viscosity_law.share, oil.thinner,
    )  # fmt: skip


@kernel
def port_pressure(x_v: float, Pa: float, Pb: float, Pt: float, c: object) -> float:
    """Pressure [Pa] at port p with the spool at x_v and these pressures at the other ports."""
    s, valve, oil = supplied_opening(x_v, c), c.valve, c.oil
    return supply_pressure(
        abs(s), Pa if s >= 0.0 else Pb, relief_pressure(s, Pa, Pb, Pt, c), c.pump.flow,
        valve.k_q, valve.land_diameter, valve.lam_crit, oil.rho, oil.eta0, oil.alpha, c.effect.viscosity_law.share,
    )  # fmt: skip
