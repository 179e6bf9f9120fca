"""Hydraulic oil: viscosity growing exponentially with pressure, and pressure that cannot fall below the vapour's."""

from __future__ import annotations

from math import exp

from ..core.jit import kernel


@kernel
def viscosity(P: float, eta0: float, alpha: float) -> float:
    """Dynamic viscosity [Pa s] at pressure P [Pa]: eta = eta0 exp(alpha P) (Eq. 1, Barus)."""
    return eta0 * exp(alpha * P)


@kernel
def effective_bulk_modulus(beta: float, beta_wall: float) -> float:
    """Modulus [Pa] of oil in an elastic wall: 1/beta_e = 1/beta + 1/beta_wall (Eq. 15)."""
    return 1.0 / (1.0 / beta + 1.0 / beta_wall)


@kernel
def pressure(p: float, p_vapour: float) -> float:
    """Absolute pressure P [Pa] of a volume whose content is known by its state p [Pa].

    The state obeys dp/dt = beta_e/V * (net inflow) without limit, so that volume is conserved. While the oil is
    liquid, P = p. Below the vapour pressure the volume holds oil and a void, whose size is V (p_vapour - p)/beta_e,
    and P = p_vapour^2/(2 p_vapour - p), the pressure of a gas that shares the void: positive always, continuous with
    its slope, reversible. Our choice; the paper says nothing of cavitation.
    """
    if p >= p_vapour:
        return p
    return p_vapour * p_vapour / (2.0 * p_vapour - p)
