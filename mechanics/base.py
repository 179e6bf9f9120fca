"""A base that moves: heave of the vessel or vehicle, and its pitch about the arm's pivot.

All is written in the frame of the base. There gravity turns with the pitch, everything that has mass feels the heave's
acceleration and the pitch's (Euler), and the water comes towards the arm. Left out are the centrifugal and Coriolis
terms of the pitch, which go with the square of its rate.
"""

from __future__ import annotations

from math import cos, pi, sin

from ..core.jit import kernel
from ..core.sea import GRAVITY

HEAVE_RATE, HEAVE_ACC, PITCH, PITCH_RATE, PITCH_ACC, PARTS = range(6)
"""Places in the motion: heave velocity [m/s], acceleration [m/s2], pitch [rad], rate, acceleration; how many."""


@kernel
def base_motion(t: float, s: float, given: object, c: object, motion: object) -> None:
    """Write the base's motion at t [s] into `motion`: what is given, s [s] ago, moved on, and the effect's swell."""
    heave, pitch = c.effect.base_motion.heave, c.effect.base_motion.pitch
    rate = 2.0 * pi * c.effect.base_motion.frequency
    angle = rate * t + c.effect.base_motion.phase
    up, ahead = sin(angle), rate * cos(angle)
    motion[HEAVE_RATE] = given[HEAVE_RATE] + s * given[HEAVE_ACC] + heave * ahead
    motion[HEAVE_ACC] = given[HEAVE_ACC] - heave * rate * rate * up
    motion[PITCH] = given[PITCH] + s * (given[PITCH_RATE] + 0.5 * s * given[PITCH_ACC]) + pitch * up
    motion[PITCH_RATE] = given[PITCH_RATE] + s * given[PITCH_ACC] + pitch * ahead
    motion[PITCH_ACC] = given[PITCH_ACC] - pitch * rate * rate * up


@kernel
def seen_from_base(x: float, heave: float, pitch: float) -> tuple[float, float]:
    """Components along the base's axes of what is x along the world's horizontal, less the heave."""
    return x * cos(pitch) - heave * sin(pitch), -x * sin(pitch) - heave * cos(pitch)


@kernel
def inertial_loads(
    theta: float, phi: float, L: float, motion: object, m_beam: float, m_cylinder: float, c: object
) -> tuple[float, float, float]:
    """Torques on beam and cylinder [N m] and force along the rod [N] of gravity that turns and of the accelerations.

    m_beam, m_cylinder: moments of inertia [kg m2] of beam with load and of the cylinder about its base hinge.
    """
    pitch, turn = motion[PITCH], motion[PITCH_ACC]
    g_x, g_y = -GRAVITY * sin(pitch), GRAVITY * (1.0 - cos(pitch))
    f_x, f_y = -motion[HEAVE_ACC] * sin(pitch), -motion[HEAVE_ACC] * cos(pitch)
    b_x, b_y = f_x + turn * c.base_y, f_y - turn * c.base_x  # of the cylinder's base hinge
    across = -sin(theta), cos(theta)
    beam = c.mass.moment * (f_x * across[0] + f_y * across[1]) - turn * m_beam
    beam += c.weight.moment / GRAVITY * (g_x * across[0] + g_y * across[1])
    normal = -sin(phi), cos(phi)
    reach = c.rod.mass * (L + c.rod.centre)
    cylinder = (c.barrel.moment + reach) * (b_x * normal[0] + b_y * normal[1]) - turn * m_cylinder
    cylinder += (c.barrel.net + reach) * (g_x * normal[0] + g_y * normal[1])
    rod = c.rod.mass * ((b_x + g_x) * cos(phi) + (b_y + g_y) * sin(phi))
    return beam, cylinder, rod
