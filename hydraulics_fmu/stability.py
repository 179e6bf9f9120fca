"""Small motions of the machine at rest: the circuit and the mass on its rod, linearised, and the gain they bear.

At rest the valve is all but shut and damps least, so a loop that is stable there is so in motion.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import inf, nan, sqrt

import numpy as np

from .circuit import derivatives, node_pressures, piston_force
from .constants import by_name, constants
from .memory import new_memory, remembering
from .states import border, state_scales
from .steady import steady_state
from .valve import settle

NUDGE = 1e-7
"""Change of a state, in its typical sizes, from which a derivative is taken."""

GROWS = 1e-3
"""Rate [1/s] from which a mode counts as growing: slower ones are rounding."""

SOUGHT = 1e-4, 1e4
"""Gains between which the critical one is sought, in those of the machine."""


def motion_matrix(p: Mapping[str, float], x: float, F_hold: float, mass: float) -> np.ndarray:
    """Jacobian (n, n) of the states of the circuit, then place [m] and velocity [m/s] of the rod.

    The rod is at rest at x [m], as commanded, under a load of F_hold [N] with a mass [kg]; p: parameters by name.
    """
    c = constants(p)
    named, m = by_name(c), remembering.py_func(new_memory())
    y, _ = steady_state(c, F_hold)
    settle(border.py_func(y, named).integral, named, m)
    n = len(y)

    def rates(z: np.ndarray) -> np.ndarray:
        made, (place, v) = np.zeros(n + 2), z[n:]
        derivatives(z[:n], named, place, v, x, 0.0, nan, m, made[:n])
        _, P_1, P_2, _, _ = node_pressures(border.py_func(z[:n], named), named, m)
        made[n:] = v, (piston_force(place, v, P_1, P_2, named, m) - F_hold) / mass
        return made

    rest, scales = np.append(y, (x, 0.0)), np.append(state_scales(named), (0.1, 1.0))
    A = np.empty((n + 2, n + 2))
    for j, size in enumerate(NUDGE * scales):
        change = np.zeros(n + 2)
        change[j] = size
        A[:, j] = (rates(rest + change) - rates(rest - change)) / (2.0 * size)
    return A


def critical_gain(p: Mapping[str, float], x: float, F_hold: float, mass: float) -> float:
    """Proportional gain [mA] of the controller beyond which the machine at rest swings up; infinite if none does.

    See `motion_matrix`; the machine's own gain is where the search begins.
    """
    own = p["controller.kp"]
    with_own, without = (motion_matrix({**p, "controller.kp": kp}, x, F_hold, mass) for kp in (own, 0.0))
    slope = (with_own - without) / own

    def grows(kp: float) -> bool:
        return bool(np.linalg.eigvals(without + kp * slope).real.max() > GROWS)

    low, high = (own * factor for factor in SOUGHT)
    if not grows(high):
        return inf
    while high > 1.001 * low:
        middle = sqrt(low * high)
        low, high = (low, middle) if grows(middle) else (middle, high)
    return low
