"""A beam that bends in its first mode: the load, with the inertia that it has about the pivot wherever it hangs, and a
part of the beam as a mass on a spring at the rigid beam's end.

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
def swung(
    begin: tuple[float, float, float, float], before: tuple[float, float, float], after: tuple[float, float, float],
    dt: float, parts: int, F_h: float, c: object,
) -> tuple[float, float, float, float]:  # fmt: skip
    """Angle [rad], angular velocity [rad/s], deflection [m] and its rate [m/s] after dt [s], from those at the start,
    by velocity Verlet in so many parts; before, after: J - m L^2 [kg m2], T without the cylinder's force F_h [N], and
    its lever [m], which change along straight lines."""
    theta, omega, w, rate = begin
    M, T, lever = before
    h = dt / parts
    held = held_by_spring(theta, w, rate, c)
    alpha = (T + c.beam_length * held + lever * F_h) / M
    bends = deflection_rate(alpha, held, c)
    for i in range(1, parts + 1):
        theta += h * (omega + 0.5 * h * alpha)
        w += h * (rate + 0.5 * h * bends)
        share = i / parts
        M, T = before[0] + share * (after[0] - before[0]), before[1] + share * (after[1] - before[1])
        lever = before[2] + share * (after[2] - before[2])
        held = held_by_spring(theta, w, rate + h * bends, c)
        alpha_end = (T + c.beam_length * held + lever * F_h) / M
        bends_end = deflection_rate(alpha_end, held, c)
        omega += 0.5 * h * (alpha + alpha_end)
        rate += 0.5 * h * (bends + bends_end)
        alpha, bends = alpha_end, bends_end
    return theta, omega, w, rate


@kernel
def sag(theta: float, c: object) -> float:
    """Deflection w [m] at rest."""
    return -c.bending.weight * cos(theta) / c.bending.stiffness if c.bending.rate > 0.0 else 0.0
