"""Oil tank with pressure compensator (Eqs. 2, 3): ambient pressure and a spring push oil into the circuit."""

from __future__ import annotations

from ..core.jit import kernel

STOP = 1e8
"""Stiffness [N/m] of the stop that a compensator's piston meets."""

POLYTROPIC = 1.2
"""Exponent of the trapped air during a run; on its way down it has had time."""


@kernel
def gas_softening(P_t: float, volume: float, beta: float, gas: float) -> float:
    """Factor on the stiffness of a tank of that volume [m3] in which air is trapped, gas: its p V [J]; P_t [Pa]."""
    if gas == 0.0:
        return 1.0
    return 1.0 / (1.0 + gas / (POLYTROPIC * P_t * P_t) * beta / volume)


@kernel
def tank_rates(Q_in: float, Q_out: float, P_t: float, s: object, rate: object, c: object) -> None:
    """Write the rates of tank and compensator, of states s, into `rate` for flows [m3/s] into and out of the tank."""
    compensator = c.compensator
    rate.p_t = tank_pressure_rate(
        Q_in, Q_out, s.v_c, s.x_c, compensator.area, c.tank.volume, compensator.length, c.oil.beta
    )
    rate.x_c = s.v_c
    rate.v_c = piston_acceleration(
        P_t, s.x_c, s.v_c, c.sea.p_am, compensator.area, compensator.m_c, compensator.B_c, compensator.k_c,
        compensator.precompression,
    )  # fmt: skip


@kernel
def stop_acceleration(x_c: float, c: object) -> float:
    """What the stop adds [m/s2] to the compensator's piston, when its travel is short and at an end."""
    over = x_c - c.compensator.travel
    return -STOP * over / c.compensator.m_c if c.compensator.travel > 0.0 and over > 0.0 else 0.0


@kernel
def oil_volume(x_c: float, area: float, V_t: float, length: float) -> float:
    """Oil [m3] in tank and compensator, V_t + V_c with V_c = A_c (length - x_c)."""
    return V_t + area * max(length - x_c, 1e-3 * length)


@kernel
def tank_pressure_rate(
    Q_in: float, Q_out: float, v_c: float, x_c: float, area: float, V_t: float, length: float, beta: float
) -> float:
    """dP_t/dt [Pa/s] from A_c v_c = Q_out - Q_in + (V_t + V_c)/beta dP_t/dt, V_t + V_c as of `oil_volume` (Eq. 2)."""
    return beta / oil_volume(x_c, area, V_t, length) * (area * v_c - Q_out + Q_in)


@kernel
def piston_acceleration(
    P_t: float, x_c: float, v_c: float, P_am: float,
    area: float, m_c: float, B_c: float, k_c: float, precompression: float,
) -> float:  # fmt: skip
    """Acceleration [m/s2] of the compensator piston, positive into the oil (Eq. 3).

    m_c a = (P_am - P_t) A_c + k_c (precompression - x_c) - B_c v_c: the spring pushes the same way as the sea and so
    holds the tank k_c precompression/A_c above ambient.
    """
    return ((P_am - P_t) * area + k_c * (precompression - x_c) - B_c * v_c) / m_c
