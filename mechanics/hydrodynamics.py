"""Morison loads on slender cylinders (Eqs. 28-31), as exact integrals of the strip force.

A cylinder turns about one end with angular velocity w; u is the current's component normal to it, positive in the
sense of rotation, so the water moves past the strip at distance l with r = u - w l. The drag of the strip is
1/2 rho C_D D r|r| dl. The printed Eq. 29 is the case u = 0, Eq. 30 (with 1/4 for its 1/2, see docs/errata.md)
the case w = 0; with both the relative velocity makes the sum of the two only an approximation, so it is integrated.
"""

from __future__ import annotations

from math import cos, pi, sin

from ..core.jit import kernel


@kernel
def _drag_piece(u: float, w: float, a: float, b: float) -> tuple[float, float]:
    """Integrals of r|r| and l r|r| over [a, b], where r = u - w l keeps its sign."""
    force = u * u * (b - a) - u * w * (b**2 - a**2) + w * w * (b**3 - a**3) / 3.0
    torque = u * u * (b**2 - a**2) / 2.0 - 2.0 * u * w * (b**3 - a**3) / 3.0 + w * w * (b**4 - a**4) / 4.0
    if u - w * 0.5 * (a + b) < 0.0:
        return -force, -torque
    return force, torque


@kernel
def drag(u: float, w: float, l1: float, l2: float, diameter: float, rho: float, C_D: float) -> tuple[float, float]:
    """Normal force [N] and torque [N m] about the hinge of the drag between distances l1 and l2 [m] from it."""
    zero = u / w if w != 0.0 else l1
    if l1 < zero < l2:
        f1, t1 = _drag_piece(u, w, l1, zero)
        f2, t2 = _drag_piece(u, w, zero, l2)
        force, torque = f1 + f2, t1 + t2
    else:
        force, torque = _drag_piece(u, w, l1, l2)
    k = 0.5 * rho * C_D * diameter
    return k * force, k * torque


@kernel
def printed_torque(u: float, w: float, l1: float, l2: float, diameter: float, rho: float, C_D: float) -> float:
    """Torque [N m] of the drag as the paper prints it: Eq. 29, and Eq. 30 with its factor 1/2, added up."""
    _, turning = drag(0.0, w, l1, l2, diameter, rho, C_D)
    return turning + 0.5 * rho * C_D * diameter * u * abs(u) * (l2**2 - l1**2)


@kernel
def inertia_per_length(diameter: float, rho: float, C_M: float) -> float:
    """Inertia coefficient rho C_M pi D^2/4 of a strip [kg/m]: force per length and relative acceleration."""
    return rho * C_M * pi * diameter**2 / 4.0


@kernel
def added_inertia(l1: float, l2: float, diameter: float, rho: float, C_M: float) -> float:
    """Moment of inertia [kg m2] of the entrained water: 1/12 rho C_M pi D^2 (l2^3 - l1^3) (second term of Eq. 29)."""
    return inertia_per_length(diameter, rho, C_M) * (l2**3 - l1**3) / 3.0


@kernel
def wave(t: float, amplitude: float, frequency: float, phase: float) -> tuple[float, float]:
    """Velocity [m/s] and acceleration [m/s2] of a sinusoidal current, amplitude sin(2 pi frequency t + phase)."""
    angle = 2.0 * pi * frequency * t + phase
    return amplitude * sin(angle), 2.0 * pi * frequency * amplitude * cos(angle)
