"""The plant: a run of the machine, from rest, with its own equations and its own solver."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .lines import HISTORY, LINE_A, LINE_B
from .machine import SEGMENTS, Machine, constants
from .solver import ATOL, DIFFERENCE, OK, integrate, rest
from .supply import HOSE, PUMPED
from .system import BEND, BRISTLE, DELAY, KEYS, PLAY, ROD, SILT, SPOOL, STATES, SUPPLY

Array = NDArray[np.float64]


class PlantError(RuntimeError):
    """The plant has no state at rest, or its integration came to no end."""


def active_states(m: Machine) -> NDArray[np.int64]:
    """Indices of the states that move with the machine's effects."""
    c, extra = constants(m), []
    if m.spool_time > 0.0:
        extra += [SPOOL, SPOOL + 1]
    if m.delay > 0.0:
        extra += range(DELAY, DELAY + 4)
    if c["moving"] > 0.0:
        extra.append(SUPPLY)
    if m.play > 0.0 or m.silt > 0.0:
        extra.append(PLAY)
    if m.bristle > 0.0 or c["presliding"] > 0.0:
        extra.append(BRISTLE)
    if m.flexibility > 0.0:
        extra += [BEND, BEND + 1]
    later = {
        range(SILT, SILT + 1): m.silt, range(ROD, ROD + 2): m.clearance, range(PUMPED, PUMPED + 2): m.pump_time,
        range(HOSE, HOSE + 3): m.hose_length, range(HISTORY, HISTORY + 6): m.history,
    }  # fmt: skip
    extra += [state for states, strength in later.items() if strength > 0.0 for state in states]
    return np.array([*range(SPOOL), *extra], np.int64)


def rest_state(m: Machine) -> Array:
    """State at rest at x_h = 0 with zero position error, whatever effects there are.

    A null shift that shows is not at rest: the controller is switched on with the integral of a valve without it.
    """
    if m.null_shows > 0.0:
        m = replace(m, null_shift=0.0)
    c = constants(m)
    y = np.zeros(STATES)
    p_t = c["p_am"] + c["compensator_stiffness"] * c["compensator_precompression"] / c["comp_area"]
    y[2], y[3], y[5], y[SUPPLY] = p_t, m.theta0, 0.05 * m.rated_current, p_t + m.relief_pressure
    y[LINE_A : LINE_A + 2 * SEGMENTS + 1 : 2] = p_t + 0.6 * m.relief_pressure
    y[LINE_B : LINE_B + 2 * SEGMENTS + 1 : 2] = p_t + 0.4 * m.relief_pressure
    y[SILT] = 1.0
    y[HOSE + 1] = y[SUPPLY]
    if m.clearance > 0.0:  # the rod lies against its eye
        y[ROD] = 0.5 * m.clearance + 1e-5
    if not rest(y, c, DIFFERENCE, active_states(m)):
        raise PlantError("no state at rest")
    return y


def simulate(m: Machine, times: ArrayLike, rtol: float = 2e-7, atol_scale: float = 0.3, most: int = 200_000) -> Array:
    """Outputs, one row per time (s, ascending from >= 0) and one column per name of `KEYS`, in SI units."""
    if 0.0 < m.sampling < 2e-3:  # a delay of half the period; nothing else can be seen of it
        m = replace(m, sampling=0.0, delay=m.delay + 0.5 * m.sampling)
    times = np.ascontiguousarray(times, float)
    y = rest_state(m)
    out = np.empty((times.size, len(KEYS)))
    status, _ = integrate(
        constants(m), y, times, m.corners, DIFFERENCE, active_states(m), rtol, atol_scale * ATOL, most, out
    )
    if status != OK or not np.isfinite(out).all():
        raise PlantError("the integration came to no end")
    return out


def column(out: Array, key: str) -> Array:
    """The column of that name."""
    return out[:, KEYS.index(key)]
