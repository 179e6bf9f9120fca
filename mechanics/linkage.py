"""Kinematics of the linkage: cylinder length L and angle phi as functions of the beam's angle theta, exactly."""

from __future__ import annotations

from math import atan2, cos, hypot, sin

from ..core.errors import ParameterError
from ..core.jit import kernel


@kernel
def linkage(theta: float, r: float, base_x: float, base_y: float) -> tuple[float, float, float, float, float, float]:
    """L [m], dL/dtheta [m/rad], d2L/dtheta2, phi [rad], dphi/dtheta, d2phi/dtheta2.

    The rod's eye is at r (cos theta, sin theta), the base hinge at (base_x, base_y); L and phi are length and direction
    of the line from the base to the eye.
    """
    c, s = r * cos(theta), r * sin(theta)
    ex, ey = c - base_x, s - base_y
    L = hypot(ex, ey)
    dL = (-ex * s + ey * c) / L
    ddL = (r * r - (ex * c + ey * s) - dL * dL) / L
    dphi = (ex * c + ey * s) / L**2
    ddphi = (-ex * s + ey * c) / L**2 - 2.0 * dphi * dL / L
    return L, dL, ddL, atan2(ey, ex), dphi, ddphi


def check_buildable(theta0: float, r: float, base_x: float, base_y: float) -> None:
    """Raise `ParameterError` when the cylinder has no length or no lever at theta0."""
    L, dL, *_ = linkage.py_func(theta0, r, base_x, base_y)
    if L < 1e-3 or abs(dL) < 1e-3 * r:
        raise ParameterError(
            f"'theta0' = {theta0:g} rad, 'rod_eye_radius' = {r:g} m and the base hinge ({base_x:g}, {base_y:g}) m "
            f"leave the cylinder {L:g} m long with a lever of {abs(dL):g} m: it cannot move the beam"
        )
