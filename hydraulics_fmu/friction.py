"""Friction of the piston beyond the viscous one: Coulomb, Stribeck, and what the seals add with pressure."""

from __future__ import annotations

from math import exp, tanh

from ..core.jit import kernel
from .curves import on_curve

STRIBECK_TURN = 0.1
"""Share of v_s within which Stribeck friction has come up."""


@kernel
def sign_of(v: float, v_0: float) -> float:
    """The sign of a velocity v [m/s], regularised: tanh(v/v_0)."""
    return tanh(v / v_0)


@kernel
def turn(v: float, width: float) -> float:
    """The sign of a velocity v [m/s], exactly from |v| = width on and a cubic in between."""
    x = v / width
    if abs(x) >= 1.0:
        return 1.0 if v > 0.0 else -1.0
    return 0.5 * x * (3.0 - x * x)


@kernel
def piston_friction(
    v: float, P1: float, P2: float, F_c: float, v_0: float, F_extra: float, v_s: float, k_p: float,
    uneven_c: float = 0.0, uneven_s: float = 0.0, uneven_p: float = 0.0, exponent: float = 1.0,
) -> float:  # fmt: skip
    """Friction force [N] against the velocity v [m/s]: with regularised signs s and r of v (`sign_of`, `turn`),

        s [F_c (1 + uneven_c s) + k_p |P1 - P2| (1 + uneven_p s)] + r F_extra (1 + uneven_s r) exp(-(|v|/v_s)^exponent).

    F_c: Coulomb; F_extra = F_s - F_c: what Stribeck friction adds near standstill, falling with v_s; k_p [m2]: growth
    with the seal's pressure difference (Armstrong-Helouvry et al. 1994, Automatica 30(7)). uneven: share by which each
    is greater extending and less retracting. Zero exactly when F_c, F_extra and k_p are.

    s turns over v_0. r has to be quicker where F_extra falls quickly, or it falls before it has come up (over 2 mm/s,
    39 % of a F_extra with v_s = 3 mm/s came up): it turns within a tenth of v_s, so that 90 % come up.
    """
    s, r = sign_of(v, v_0), turn(v, min(v_0, STRIBECK_TURN * v_s))
    fall = abs(v) / v_s
    if exponent != 1.0:
        fall = fall**exponent
    even = F_c * (1.0 + uneven_c * s) + k_p * (1.0 + uneven_p * s) * abs(P1 - P2)
    return even * s + F_extra * (1.0 + uneven_s * r) * exp(-fall) * r


@kernel
def friction(v_h: float, P_1: float, P_2: float, c: object) -> float:
    """Friction of the piston [N] against its velocity v_h [m/s]."""
    coulomb, stribeck = c.effect.cylinder_coulomb_friction, c.effect.cylinder_stribeck_friction
    seal = c.effect.seal_pressure_friction
    F = piston_friction(
        v_h, P_1, P_2, coulomb.F_c, coulomb.v_0, stribeck.F_extra, stribeck.v_s, seal.k_p,
        coulomb.uneven, stribeck.uneven, seal.uneven, stribeck.exponent,
    )  # fmt: skip
    if c.cylinder.curve_speed > 0.0:
        F += on_curve(v_h / c.cylinder.curve_speed, c.cylinder.friction, 1.0) * sign_of(v_h, coulomb.v_0)
    return F
