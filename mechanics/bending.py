"""A beam that bends in its first mode: the load and a part of the beam as a mass on a spring at the rigid beam's end.

With the deflection w of that mass m across the beam of length L and its spring k, the kinetic energy of rotation,
J alpha for the stiff beam, and of w give

    (J - m L^2) alpha = T + L s        m w'' = -s - m L alpha        s = k w + b w' + W cos(theta)

where T is the torque on the stiff beam, and W the weight of m, which s takes over from T.
"""

from __future__ import annotations

from math import cos

from ..core.jit import kernel


@kernel
def held_by_spring(theta: float, w: float, w_rate: float, c: object) -> float:
    """s [N], see above."""
    bending = c.bending
    return bending.stiffness * w + bending.damping * w_rate + bending.weight * cos(theta)


@kernel
def deflection_rate(alpha: float, held: float, c: object) -> float:
    """Acceleration w'' [m/s2] of the mass at the angular acceleration alpha [rad/s2]."""
    return -held / c.bending.mass - c.beam_length * alpha


@kernel
def sag(theta: float, c: object) -> float:
    """Deflection w [m] at rest."""
    return -c.bending.weight * cos(theta) / c.bending.stiffness if c.bending.rate > 0.0 else 0.0
