"""Buildable linkages as a box: every point of the unit cube is one, and a search needs no walls.

A linkage has five numbers. Besides the beam's length and its angle at x_h = 0 these are the cylinder's length then, how
far it can extend until the dead centre, and how far the folded dead centre is behind; so the conditions of
buildability are bounds. The sixth number is the valve's critical flow number, on a logarithmic scale.
"""

from __future__ import annotations

from dataclasses import astuple, dataclass
from math import acos, atan2, cos, exp, hypot, log, radians, sin

import numpy as np

from ...mechanics.variables import ARM

LOW = np.array([0.8, radians(-30.0), 0.44, 0.255, 0.01, log(200.0)])
HIGH = np.array([3.0, radians(60.0), 0.53, 0.80, 0.43, log(5000.0)])
"""Bounds of beam length [m], theta0 [rad], cylinder at x_h = 0 [m], reach [m], fold [m] and log(lam_crit).

0.44 m and the reach of 0.255 m are those of the shipped fit: a cylinder has to be longer than its stroke of 0.25 m, and
the dead centre lies beyond the stroke. Longer than 0.53 m and the piston, on its rod of 0.40 m, leaves the barrel of
0.38 m before 0.25 m. A fold of 0.01 m keeps the other dead centre 0.02 m away from x_h = 0. The rest is wide.
"""


@dataclass(frozen=True)
class Linkage:
    """Beam length [m], rod eye's radius [m], theta0 [rad], base hinge [m], the valve's critical flow number."""

    beam_length: float
    rod_eye_radius: float
    theta0: float
    base_x: float
    base_y: float
    lam_crit: float

    @property
    def parameters(self) -> dict[str, float]:
        """What sets it in the machine's package."""
        own = {f"arm.{name}": getattr(self, name) for name in NAMES}
        return {**own, "hydraulics.valve.lam_crit": self.lam_crit}

    @property
    def length(self) -> float:
        """Length of the cylinder at x_h = 0 [m]."""
        r, a = self.rod_eye_radius, self.theta0
        return hypot(r * cos(a) - self.base_x, r * sin(a) - self.base_y)

    @property
    def reach(self) -> float:
        """Displacement x_h of the dead centre [m]."""
        return self.rod_eye_radius + hypot(self.base_x, self.base_y) - self.length


NAMES = ("beam_length", "rod_eye_radius", "theta0", "base_x", "base_y")


def linkage(u: np.ndarray) -> Linkage:
    """The linkage at a point (6,) of the unit cube."""
    beam, theta0, length, reach, fold, log_lam = (LOW + (HIGH - LOW) * u).tolist()
    r = 0.5 * reach + fold
    d = 0.5 * reach + length - fold
    base = theta0 - acos((r * r + d * d - length * length) / (2.0 * r * d))  # below the beam: to extend is to raise it
    return Linkage(beam, r, theta0, d * cos(base), d * sin(base), exp(log_lam))


def point(of: Linkage) -> np.ndarray:
    """The point (6,) that `linkage` takes there; outside the cube where it is not buildable."""
    fold = of.rod_eye_radius - 0.5 * of.reach
    own = np.array([of.beam_length, of.theta0, of.length, of.reach, fold, log(of.lam_crit)])
    u: np.ndarray = (own - LOW) / (HIGH - LOW)
    return u


def is_buildable(of: Linkage) -> bool:
    """Inside the bounds, the base below the beam; the limits themselves count, up to rounding."""
    u = point(of)
    turned = of.theta0 - atan2(of.base_y, of.base_x)
    return bool((u > -1e-9).all() and (u < 1.0 + 1e-9).all() and sin(turned) > 0.0)


def shipped(lam_crit: float) -> Linkage:
    """The linkage that the FMU ships, with this critical flow number."""
    values = ARM.parameters({})
    return Linkage(**{name: float(values[name]) for name in NAMES}, lam_crit=lam_crit)


def as_values(of: Linkage) -> dict[str, float]:
    """The six numbers by name, for a file."""
    return dict(zip((*NAMES, "lam_crit"), astuple(of), strict=True))
