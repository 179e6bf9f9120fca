"""The cylinder: two chambers with internal leakage (Eqs. 23-25), the force on the arm (Eqs. 26, 27), end stops."""

from __future__ import annotations

from math import pi

from ..core.jit import kernel
from .oil import gap_flow, heavier, viscosity

CREEP = 0.05
"""Velocity [m/s] at which viscous friction is the same whatever its power."""

CUSHION_CQ = 0.7
"""Discharge coefficient of a cushion's orifice."""

EYE_STIFFNESS, EYE_DAMPING = 1e8, 2e4
"""Of the contact of rod and eye [N/m, N s/m]: a steel pin's, and some 30 % of what is critical for a rod of 10 kg."""


def areas(D_h: float, d_h: float) -> tuple[float, float]:
    """Piston-side and rod-side areas A_1, A_2 [m2] (Eq. 25)."""
    return pi * D_h**2 / 4.0, pi * (D_h**2 - d_h**2) / 4.0


@kernel
def leakage(
    P1: float, P2: float, c_l: float, further: float = 0.0, turbulent: float = 0.0, thinner: float = 1.0
) -> float:
    """Flow [m3/s] past the piston from the piston side to the rod side (Eqs. 23, 24), and what a worn seal lets through
    beyond that, a share of it turbulent (`oil.gap_flow`); of oil that is `thinner` more flows."""
    return gap_flow(P1 - P2, c_l, 0.0, thinner) + gap_flow(P1 - P2, further, turbulent, thinner)


@kernel
def chamber_volume(V_0: float, A: float, x: float) -> float:
    """Volume V_0 + A x [m3], kept above 1 % of V_0 for displacements that the end stops would not allow."""
    return max(V_0 + A * x, 0.01 * V_0)


@kernel
def end_stop_force(x: float, v: float, stroke: float, clearance: float, stiffness: float, damping: float) -> float:
    """Force [N] of the end stops on the rod, positive extends: stiffness times penetration plus damping.

    The damping term grows with the penetration over the first 0.1 mm, so that the force is continuous, and a stop
    never pulls.
    """
    under = -clearance - x
    over = x - stroke - clearance
    if under > 0.0:
        return max(stiffness * under - damping * min(under / 1e-4, 1.0) * v, 0.0)
    if over > 0.0:
        return -max(stiffness * over + damping * min(over / 1e-4, 1.0) * v, 0.0)
    return 0.0


@kernel
def rod_force(P1: float, P2: float, v: float, P_am: float, A_1: float, A_2: float, B_h: float) -> float:
    """Force [N] of the cylinder on the arm without the piston's inertia: P1 A_1 - P2 A_2 - F_am - B_h v (Eqs. 26, 27).

    Written with pressures above ambient, because the ambient parts cancel exactly with F_am = P_am (A_1 - A_2).
    """
    return (P1 - P_am) * A_1 - (P2 - P_am) * A_2 - B_h * v


@kernel
def piston_leak(P_1: float, P_2: float, c: object) -> float:
    """Flow [m3/s] past the piston of the machine with these constants."""
    cylinder, effect = c.cylinder, c.effect.piston_leakage
    further = cylinder.leak_further
    if effect.opening > 0.0:
        further *= 1.0 + effect.opening * abs(P_1 - P_2)
    return leakage(P_1, P_2, cylinder.leak, further, effect.turbulent, cylinder.thinner)


@kernel
def outward_leaks(P_1: float, P_2: float, c: object) -> tuple[float, float]:
    """Flows [m3/s] from both chambers into the sea: past the rod's seal, and past fittings of the piston side."""
    leaks = c.effect.external_leakage
    if leaks.c == 0.0:
        return 0.0, 0.0
    flow = leaks.c * c.cylinder.thinner
    return leaks.piston_side * flow * (P_1 - c.sea.p_am), flow * (P_2 - c.sea.p_am)


@kernel
def viscous(v: float, P_1: float, P_2: float, c: object) -> float:
    """Coefficient [N s/m] of the piston's viscous friction at v [m/s]: as stated, or growing with the oil's viscosity
    between the chambers, or with a power of the velocity other than one (alike at `CREEP`)."""
    B, form = c.cylinder.viscous, c.effect.cylinder_viscous_error
    if form.thickening != 0.0:
        eta = viscosity(0.5 * (P_1 + P_2), c.oil.eta0, c.oil.alpha, c.effect.viscosity_law.share)
        B *= 1.0 + form.thickening * (eta / c.oil.stated - 1.0)
    if form.power != 1.0:
        B *= (max(abs(v), CREEP * 1e-3) / CREEP) ** (form.power - 1.0)
    return B


@kernel
def eye_force(apart: float, speed: float, c: object) -> float:
    """Force [N] of a rod on the eye that is loose about it, positive extends; the rod is ahead by `apart` [m] and
    faster by `speed` [m/s].

    None within half the clearance to either side; beyond it a spring, and a damper that grows in over 10 um and does
    not pull.
    """
    deep = abs(apart) - 0.5 * c.effect.joint_clearance.gap
    if deep <= 0.0:
        return 0.0
    way = 1.0 if apart > 0.0 else -1.0
    return way * max(EYE_STIFFNESS * deep + EYE_DAMPING * min(deep / 1e-5, 1.0) * way * speed, 0.0)


@kernel
def cushion_loss(Q: float, way: float, P: float, c: object) -> float:
    """Loss [Pa] of a flow Q [m3/s] out of a chamber at P [Pa] whose end the piston has still `way` [m] to go to.

    Over the last `length` of the stroke an orifice closes through which the oil leaves the chamber, as its hyperbola,
    from wide open to `area` at the end: dp = rho/2 (Q/(C_q area/share))^2, share the part of the way that is done.
    Oil enters freely.
    """
    cushion = c.effect.end_cushion
    done = 1.0 - way / cushion.length
    if done <= 0.0:
        return 0.0
    jet = Q * min(done, 1.0) / (CUSHION_CQ * cushion.area)
    return 0.5 * c.oil.rho * heavier(P, c) * jet * jet
