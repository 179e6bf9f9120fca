"""A step of an instance, from all that it remembers: one row of numbers, so that compiled code finds everything by one
address.

The inputs are taken at the start of a step: x_h moves on with v_h, x_ref with the slope of its last change.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache

import numpy as np

from ..core.jit import array_at, kernel
from . import memory
from .circuit import OUTPUTS
from .constants import SIZE, by_name, constants, warmed, warming
from .integrator import OK, TOO_MANY, TOO_SMALL
from .march import step
from .memory import remembering
from .states import border, border_length, chain_length, further, lag_length, state_scales
from .steady import steady_state
from .supply import sunk
from .valve import settle
from .variables import HYDRAULICS
from .workspace import new_workspace, workspace_size

JUMP_RATE = 1.0
"""A commanded displacement that changes faster [m/s] from step to step is a jump and not continued as a slope."""

FAULTS = {
    TOO_SMALL: "the integration step fell below what time resolves",
    TOO_MANY: "the integration needs too many steps",
}
NOT_FOLLOWED, CAVITATES = 3, 4
"""What `advance` returns beside `OK` and the faults, each once, with the step not begun: x_ref changes but is not
followed; a pressure has fallen below that of the oil's vapour."""

T, REF, RATE, UNUSED, WHOLE, CONSTANTS = range(6)
"""Places in the row: start of the last step [s] (inf: there was none), x_ref then [m], its slope [m/s], whether x_ref
is unused and nothing was said of that, whether no void was told of; then constants, state, its scales, the memory, the
workspace, and the constants at the temperatures that a warm-up passes."""

X_H, V_H, X_REF, P_S, P_R = (HYDRAULICS.index(name) for name in ("x_h", "v_h", "x_ref", "P_s", "P_r"))
WETTED = ("P1", "P2", "Pa", "Pb", "Pt")
P_1, P_2, P_A, P_B, P_T = (HYDRAULICS.index(name) for name in WETTED)
FIRST = HYDRAULICS.index(OUTPUTS[0])
BEHIND = FIRST + len(OUTPUTS)
"""Places among the instance's values."""


def initial_row(
    p: Mapping[str, float], F_hold: float, P_s: float = 0.0, P_r: float = 0.0, x_h: float = 0.0
) -> tuple[np.ndarray, bool]:
    """The row of an instance at rest with parameters by name, and whether the supply holds the force F_hold [N].

    P_s, P_r: pressures [Pa] of supply and tank, where these are from outside; x_h: place [m] of the eye, by which a rod
    that is loose in it starts.
    """
    c = constants(p)
    named = by_name(c)
    outside = (P_s, P_r) if p["supply.from_outside"] else (0.0, 0.0)
    y, held = _rest(c.tobytes(), F_hold, *outside)
    if named.cylinder.loose != 0.0 and x_h != 0.0:
        y = y.copy()
        further.py_func(y, named).x_r += x_h
    head = np.array([np.inf, 0.0, 0.0, float(not p["command.use_input"]), 1.0])
    parts = (head, c, y, state_scales(named), _at_rest(y, named), new_workspace(named), warming(p))
    return np.concatenate(parts), held


def _at_rest(y: np.ndarray, c: np.record) -> np.ndarray:
    """What an instance remembers before its first step."""
    made = memory.new_memory()
    settle(border.py_func(y, c).integral, c, remembering.py_func(made))
    return made


@lru_cache(maxsize=8)
def _rest(c: bytes, F_hold: float, P_s: float, P_r: float) -> tuple[np.ndarray, bool]:
    """`steady_state`, which takes as long as a hundred steps: a run asks for it several times, and so does every state
    that is restored."""
    found: tuple[np.ndarray, bool] = steady_state(np.frombuffer(c).copy(), F_hold, P_s, P_r)
    return found


@kernel
def advance(values: int, n: int, row: int, length: int, t: float, h: float) -> int:
    """Advance from t by h [s] and write the outputs; with h = 0 only the outputs.

    values, row: addresses of the instance's values (n,) and of its row (length,).
    Returns `OK`, a fault, `NOT_FOLLOWED` or `CAVITATES`.
    """
    v, b = array_at(values, n), array_at(row, length)
    c = by_name(b[CONSTANTS : CONSTANTS + SIZE])
    states = chain_length(c) + border_length(c) + lag_length(c)
    a = CONSTANTS + SIZE
    y, scale = b[a : a + states], b[a + states : a + 2 * states]
    a += 2 * states
    m = remembering(b[a : a + memory.SIZE])
    a += memory.SIZE
    w = b[a : a + workspace_size(c)]
    if c.effect.oil_warm_up.rise != 0.0:
        warmed(t + h, b[CONSTANTS : CONSTANTS + SIZE], b[a + len(w) :], c)
    m.P_s, m.P_r = v[P_S], v[P_R]
    if c.effect.supply_droop.time > 0.0:
        c.relief.p_set = sunk(t + h, c)
    x_ref, rate = v[X_REF], b[RATE]
    if h > 0.0:
        lowest = min(v[P_1], v[P_2], v[P_A], v[P_B], v[P_T])  # of the step before; 0 where there was none
        if b[WHOLE] > 0.0 and 0.0 < lowest < c.oil.p_vapour:
            b[WHOLE] = 0.0
            return CAVITATES
        rate = 0.0
        if b[T] < t:
            rate = (x_ref - b[REF]) / (t - b[T])
            if b[UNUSED] > 0.0 and x_ref != b[REF]:
                b[UNUSED] = 0.0
                return NOT_FOLLOWED
            if abs(rate) > JUMP_RATE:
                rate = 0.0
    status = step(y, w, m, c, scale, t, h, v[X_H], v[V_H], x_ref, rate, v[FIRST:BEHIND])
    if status == OK and h > 0.0:
        b[T], b[REF], b[RATE] = t, x_ref, rate
    return status
