"""Morison loads on the bars and balls of a moving model, and the water that moves along.

A bar is a slender cylinder of length L and diameter D about its middle; the water acts across it. With the velocity of
the water relative to a place on the bar and across it, u, the drag per length is rho/2 C_D D |u| u, and what is
accelerated along is rho C_M pi D^2/4 per length, as in `hydrodynamics`. A ball is acted on in all directions: rho/2 C_D
pi D^2/4 |u| u, and rho C_M times its volume. Both are lifted by the water they displace.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

import numpy as np

PLACES, WEIGHTS = np.polynomial.legendre.leggauss(12)
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


def drag(wet: Wet, axis: np.ndarray, u: np.ndarray, omega: np.ndarray, rho: float) -> tuple[np.ndarray, np.ndarray]:
    """Force [N] and torque about the middle [N m] (3,) of the drag; axis (3,): the bar's; u (3,): velocity of the water
    relative to the middle [m/s]; omega (3,): the geom's angular velocity [rad/s]."""
    if wet.ball:
        force = 0.5 * rho * wet.C_D * pi * wet.diameter**2 / 4.0 * np.linalg.norm(u) * u
        return force, np.zeros(3)
    half = 0.5 * wet.length
    turning = cross(omega, axis)
    flow = u - np.outer(PLACES * half, turning)
    flow -= np.outer(flow @ axis, axis)
    speed = np.sqrt((flow * flow).sum(axis=1))
    loads = (0.5 * rho * wet.C_D * wet.diameter * half * WEIGHTS * speed)[:, None] * flow
    return loads.sum(axis=0), cross(axis, (PLACES * half) @ loads)


def added(wet: Wet, axis: np.ndarray, rho: float) -> tuple[np.ndarray, np.ndarray]:
    """Mass [kg] and moment of inertia about the middle [kg m2] (3, 3) of the water that moves along."""
    mass = rho * wet.C_M * wet.volume
    if wet.ball:
        return mass * np.eye(3), np.zeros((3, 3))
    across = np.eye(3) - np.outer(axis, axis)
    return mass * across, mass * wet.length**2 / 12.0 * across


def carried(
    wet: Wet, axis: np.ndarray, motion: np.ndarray, rates: np.ndarray, rho: float
) -> tuple[np.ndarray, np.ndarray]:
    """Force [N] and torque [N m] (3,) of that water, whose momentum follows the geom's velocity (Kirchhoff 1869).

    motion, rates: the geom's angular and linear velocity (6,) [rad/s, m/s], and their rates. F = -d/dt(A v), T =
    -d/dt(B omega) - v x A v, with A and B that turn with the geom: without drag nothing is lost.
    """
    linear, angular = added(wet, axis, rho)
    omega, v = motion[:3], motion[3:]
    momentum = linear @ v
    force = -linear @ rates[3:] - cross(omega, momentum) + linear @ cross(omega, v)
    return force, -angular @ rates[:3] - cross(omega, angular @ omega) - cross(v, momentum)


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """a x b (3,), quicker than numpy's for one pair."""
    return np.array([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])
