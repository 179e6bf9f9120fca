"""Morison loads on the bars and balls of a moving model, and the water that moves along.

A bar is a slender cylinder of length L and diameter D about its middle; the water acts across it. With the velocity of
the water relative to a place on the bar and across it, u, the drag per length is rho/2 C_D D |u| u, and the water that
moves along with the bar is rho (C_M - 1) pi D^2/4 per length: C_M, Morison's inertia coefficient, is what water that
moves itself does to a body that stands still, the displaced water's part of 1 included (DNV-RP-C205, section 6). A ball
is acted on in all directions: rho/2 C_D pi D^2/4 |u| u, and rho (C_M - 1) times its volume. Both are lifted by the
water they displace.

Vectors are three numbers (x, y, z); `axis` is the bar's, or (0, 0, 0) of a ball, which has none.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi, sqrt

import numpy as np

from ...core.jit import kernel

Vector = tuple[float, float, float]

PLACES, WEIGHTS = (tuple(x.tolist()) for x in np.polynomial.legendre.leggauss(12))
"""Places on a bar at which its drag is summed up, from -1 to 1: exact but for where the flow turns."""


@dataclass(frozen=True)
class Wet:
    """A geom in the water: bar along one of its axes, or ball, of this length and diameter [m], coefficients, and
    whether it is lifted."""

    geom: str
    ball: bool
    axis: int
    length: float
    diameter: float
    C_D: float
    C_M: float
    lifted: bool

    @property
    def volume(self) -> float:
        """Volume [m3] of the water that it displaces."""
        return pi * self.diameter**3 / 6.0 if self.ball else pi * self.diameter**2 / 4.0 * self.length

    @property
    def moved(self) -> float:
        """Volume [m3] of the water that moves along."""
        return (self.C_M - 1.0) * self.volume

    @property
    def turning(self) -> float:
        """Moment of inertia of the water that moves along, per its mass [m2]."""
        return 0.0 if self.ball else self.length**2 / 12.0


@kernel
def cross(a: Vector, b: Vector) -> Vector:
    """a x b."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@kernel
def dot(a: Vector, b: Vector) -> float:
    """a . b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@kernel
def plus(a: Vector, k: float, b: Vector) -> Vector:
    """a + k b."""
    return a[0] + k * b[0], a[1] + k * b[1], a[2] + k * b[2]


@kernel
def across(a: Vector, axis: Vector) -> Vector:
    """The part of a vector across an axis; all of it where there is none."""
    return plus(a, -dot(a, axis), axis)


@kernel
def drag_of_ball(diameter: float, C_D: float, u: Vector, rho: float) -> Vector:
    """Force [N] of the drag; u: velocity of the water relative to the ball [m/s]; rho [kg/m3]."""
    k = 0.5 * rho * C_D * pi * diameter**2 / 4.0 * sqrt(dot(u, u))
    return k * u[0], k * u[1], k * u[2]


@kernel
def drag_of_bar(
    length: float, diameter: float, C_D: float, axis: Vector, u: Vector, omega: Vector, rho: float
) -> tuple[Vector, Vector]:
    """Force [N] and torque about the middle [N m] of the drag; u: velocity of the water relative to the middle [m/s];
    omega: the bar's angular velocity [rad/s]."""
    half, turning = 0.5 * length, cross(omega, axis)
    force, moment = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    for i in range(len(PLACES)):
        s = PLACES[i] * half
        flow = across(plus(u, -s, turning), axis)
        k = 0.5 * rho * C_D * diameter * half * WEIGHTS[i] * sqrt(dot(flow, flow))
        force, moment = plus(force, k, flow), plus(moment, s * k, flow)
    return force, cross(axis, moment)


@kernel
def carried(
    mass: float, turning: float, axis: Vector, omega: Vector, v: Vector, alpha: Vector, a: Vector
) -> tuple[Vector, Vector]:
    """Force [N] and torque [N m] of the water that moves along, whose momentum follows the geom's velocity (Kirchhoff
    1869).

    mass, turning: the water's [kg], `Wet.turning`; omega, v: the geom's angular and linear velocity [rad/s, m/s];
    alpha, a: their rates. F = -d/dt(A v), T = -d/dt(B omega) - v x A v, with A and B that turn with the geom: without
    drag nothing is lost.
    """
    momentum, spin = across(v, axis), across(omega, axis)
    force = plus(plus(across(cross(omega, v), axis), -1.0, across(a, axis)), -1.0, cross(omega, momentum))
    torque = plus(across(alpha, axis), 1.0, cross(omega, spin))
    own, other = mass * turning, cross(v, momentum)
    return (
        (mass * force[0], mass * force[1], mass * force[2]),
        (-own * torque[0] - mass * other[0], -own * torque[1] - mass * other[1], -own * torque[2] - mass * other[2]),
    )
