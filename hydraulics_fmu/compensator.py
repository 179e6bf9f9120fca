"""Oil tank with pressure compensator (Eqs. 2, 3): ambient pressure and a spring push oil into the circuit."""

from __future__ import annotations

from ..core.jit import kernel


@kernel
def tank_pressure_rate(
    Q_in: float, Q_out: float, v_c: float, x_c: float, area: float, V_t: float, length: float, beta: float
) -> float:
    """dP_t/dt [Pa/s] from A_c v_c = Q_out - Q_in + (V_t + V_c)/beta dP_t/dt, V_c = A_c (length - x_c) (Eq. 2)."""
    volume = V_t + area * max(length - x_c, 1e-3 * length)
    return beta / volume * (area * v_c - Q_out + Q_in)


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
