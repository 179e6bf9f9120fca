"""The cylinder: two chambers with internal leakage (Eqs. 23-25), the force on the arm (Eqs. 26, 27), end stops."""

from __future__ import annotations

from math import pi

from ..core.jit import kernel
from .oil import gap_flow


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
def end_stop_force(
    x: float, v: float, stroke: float, clearance: float, stiffness: float, damping: float
) -> float:
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
    cylinder = c.cylinder
    return leakage(
        P_1, P_2, cylinder.leak, cylinder.leak_further, c.effect.piston_leakage.turbulent, c.oil.thinner
    )
