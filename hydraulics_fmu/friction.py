"""Friction of the piston beyond the viscous one: Coulomb, Stribeck, what the seals add with pressure, and the bristles
that give before they slide."""

from __future__ import annotations

from math import exp, tanh

from ..core.jit import kernel
from .curves import on_curve

STRIBECK_TURN = 0.1
"""Share of v_s within which Stribeck friction has come up."""

REST_WAY = 1e-3
"""Way [m] over which friction loses what it has gained in rest."""


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
def friction(v_h: float, P_1: float, P_2: float, c: object, m: object) -> float:
    """Friction of the piston [N] against its velocity v_h [m/s]."""
    coulomb, stribeck = c.effect.cylinder_coulomb_friction, c.effect.cylinder_stribeck_friction
    seal, presliding = c.effect.seal_pressure_friction, c.effect.cylinder_presliding
    F_c, F_extra = coulomb.F_c, stribeck.F_extra
    if coulomb.sigma0 > 0.0:
        F_c = 0.0
    if stribeck.rest_time > 0.0:
        F_extra *= m.rest
    F = piston_friction(
        v_h, P_1, P_2, F_c, coulomb.v_0, F_extra, stribeck.v_s, seal.k_p,
        coulomb.uneven, stribeck.uneven, seal.uneven, stribeck.exponent,
    )  # fmt: skip
    if coulomb.sigma0 > 0.0:
        F += coulomb.sigma0 * m.bristle_coulomb
    if presliding.F_c > 0.0:
        F += presliding.sigma0 * m.bristle
    if c.cylinder.curve_speed > 0.0:
        F += on_curve(v_h / c.cylinder.curve_speed, c.cylinder.friction, 1.0) * sign_of(v_h, coulomb.v_0)
    return F


@kernel
def bristle(z: float, v: float, h: float, F_c: float, stiffness: float) -> float:
    """Deflection [m] of the bristles after h [s] at the velocity v [m/s], from z: dz/dt = v - stiffness |v| z/F_c.

    That of Dahl (1968) and of LuGre (Canudas de Wit et al. 1995, IEEE Trans. Autom. Control 40(3)), exact for a
    velocity that is held; at rest it stays. The force is stiffness times z: a spring over F_c/stiffness, then F_c.
    """
    slid = F_c / stiffness if v > 0.0 else -F_c / stiffness
    return slid + (z - slid) * exp(-stiffness * abs(v) * h / F_c)


@kernel
def rub(v: float, h: float, c: object, m: object) -> None:
    """Bring the memory of the piston's friction up to date after h [s] at the velocity v [m/s]."""
    coulomb, stribeck, presliding = (
        c.effect.cylinder_coulomb_friction, c.effect.cylinder_stribeck_friction, c.effect.cylinder_presliding
    )  # fmt: skip
    if coulomb.sigma0 > 0.0 and coulomb.F_c > 0.0:
        level = coulomb.F_c * (1.0 + coulomb.uneven * (1.0 if v > 0.0 else -1.0))
        m.bristle_coulomb = bristle(m.bristle_coulomb, v, h, max(level, 1e-3 * coulomb.F_c), coulomb.sigma0)
    if presliding.F_c > 0.0:
        m.bristle = bristle(m.bristle, v, h, presliding.F_c, presliding.sigma0)
    if stribeck.rest_time > 0.0:  # grown with rest, lost over a way
        rate = 1.0 / stribeck.rest_time + abs(v) / REST_WAY
        rested = 1.0 / (stribeck.rest_time * rate)
        m.rest = rested + (m.rest - rested) * exp(-rate * h)
