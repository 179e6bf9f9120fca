"""A supply that does not hold its pressure at once: a pressure-compensated pump, a hose between pump and valve."""

from __future__ import annotations

from math import exp, log1p, nan

from ..core.jit import kernel
from .oil import modulus_factor, pressure, viscosity
from .states import further

SPILLS_AT, SPILLS_OVER = 1.1, 0.05
"""Pressure at which the relief valve beside a compensated pump opens, and over which it opens wide, as shares of the
pump's."""


@kernel
def hose_pressures(y: object, Pt: float, c: object, m: object) -> tuple[float, float]:
    """Pressures [Pa] of port p and of the pump's outlet, whose states are in y, or NaN where the supply has none."""
    if c.supply.from_outside != 0.0:
        return m.P_s, m.P_s
    if c.supply.moves == 0.0:
        return nan, nan
    z = further(y, c)
    P_p = pressure(z.p_p, c.oil.p_vapour)
    if c.supply.lag == 0.0:
        return P_p, Pt + c.relief.p_set
    return P_p, P_p if c.supply.inertance == 0.0 else pressure(z.p_pump, c.oil.p_vapour)


@kernel
def spilled(y: object, P_pump: float, Pt: float, c: object) -> float:
    """Flow [m3/s] through the relief valve of a supply that moves."""
    if c.supply.lag == 0.0:
        return c.pump.flow - further(y, c).Q_hose
    over = P_pump - Pt - SPILLS_AT * c.relief.p_set
    return max(over, 0.0) * c.pump.flow / (SPILLS_OVER * c.relief.p_set)


@kernel
def delivered(y: object, c: object) -> float:
    """Flow [m3/s] of the pump of a supply that moves."""
    return c.pump.flow if c.supply.lag == 0.0 else further(y, c).Q_pump


@kernel
def hose_loss(flow: float, P_p: float, c: object) -> float:
    """Pressure [Pa] that laminar flow [m3/s] loses between pump and port p, whose pressure is P_p [Pa]."""
    return c.supply.resistance * viscosity(P_p, c.oil.eta0, c.oil.alpha, c.effect.viscosity_law.share) * flow


@kernel
def characteristic(x: float, power: float, roundness: float) -> float:
    """The share of its flow that a compensated pump is set to where its pressure is x of its droop below what is set:
    min(max(x, 0), 1)^(1/power), or with knees that are rounded over so much of the droop."""
    if roundness > 0.0:
        share = roundness * (softplus(x / roundness) - softplus((x - 1.0) / roundness))
    else:
        share = min(max(x, 0.0), 1.0)
    return share if power == 1.0 else share ** (1.0 / power)


@kernel
def pressure_at_rest(taken: float, c: object) -> float:
    """Pressure [Pa] above the tank's at which the pump gives so much [m3/s]; a compensated one gives no more, but
    for what its relief valve takes."""
    if c.supply.lag == 0.0:
        return c.relief.p_set
    pump, low, high = c.effect.pump_dynamics, 0.0, 2.0
    for _ in range(60):
        share = 0.5 * (low + high)
        given = characteristic((1.0 - share) / pump.droop, pump.power, pump.roundness)
        if given - max(share - SPILLS_AT, 0.0) / SPILLS_OVER > taken / c.pump.flow:
            low = share
        else:
            high = share
    return high * c.relief.p_set


@kernel
def softplus(z: float) -> float:
    """ln(1 + e^z)."""
    return max(z, 0.0) + log1p(exp(-abs(z)))


@kernel
def supply_rates(y: object, Q_p: float, P_p: float, P_pump: float, Pt: float, c: object, f: object) -> None:
    """Write the rates of the supply's states into f.

    A pressure-compensated pump follows, with a lag, a demand that falls from all it can to nothing over the last
    `droop` of its pressure, which falls with a power of the flow; a relief valve opens 10 % above that. Without one the
    pump is that of the plain machine, which holds the relief pressure and gives at most its flow. The hose in between
    is one lump: inertia, laminar friction, and its oil at port p.
    """
    z, rate, supply, p_set, beta = further(y, c), further(f, c), c.supply, c.relief.p_set, c.oil.beta
    soft = modulus_factor(P_p, beta, c) * beta / supply.volume
    taken = Q_p
    if supply.inertance > 0.0:
        taken = z.Q_hose
        rate.Q_hose = (P_pump - P_p - hose_loss(z.Q_hose, P_p, c)) / supply.inertance
        rate.p_p = soft * (z.Q_hose - Q_p)
    if supply.lag == 0.0:
        if z.Q_hose >= c.pump.flow and rate.Q_hose > 0.0:
            rate.Q_hose = 0.0
        return
    pump = c.effect.pump_dynamics
    asked = c.pump.flow * characteristic((p_set - (P_pump - Pt)) / (pump.droop * p_set), pump.power, pump.roundness)
    back = spilled(y, P_pump, Pt, c)
    rate.Q_pump = (asked - z.Q_pump) / supply.lag
    at_pump = c.oil.beta / pump.volume * modulus_factor(P_pump, beta, c) * (z.Q_pump - back - taken)
    if supply.inertance > 0.0:
        rate.p_pump = at_pump
    else:
        rate.p_p = at_pump
