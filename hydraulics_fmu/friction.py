"""Friction of the piston beyond the viscous one: Coulomb, Stribeck, and what the seals add with pressure."""

from __future__ import annotations

from math import exp, tanh

from ..core.jit import kernel


@kernel
def piston_friction(
    v: float, P1: float, P2: float, F_c: float, v_0: float, F_extra: float, v_s: float, k_p: float
) -> float:
    """Friction force [N] against the velocity v [m/s]: [F_c + F_extra exp(-|v|/v_s) + k_p |P1 - P2|] tanh(v/v_0).

    F_c: Coulomb; F_extra = F_s - F_c: what Stribeck friction adds near standstill, falling with v_s; k_p [m2]: growth
    with the seal's pressure difference (Armstrong-Helouvry et al. 1994, Automatica 30(7)). tanh with v_0 regularises
    the sign. Zero exactly when F_c, F_extra and k_p are.
    """
    return (F_c + F_extra * exp(-abs(v) / v_s) + k_p * abs(P1 - P2)) * tanh(v / v_0)
