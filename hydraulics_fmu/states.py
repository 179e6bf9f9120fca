"""The states of the circuit, and where they stand: for n segments a line (pressures as of `oil.pressure`, SI units)

    chain    line a-1: [Q_0, p_1, Q_1, ..., Q_(n-1)], then line b-2 likewise          2 (2n - 1)
    border   `STATES`, and behind them `FURTHER` where an effect needs them           10 or 16
    lags     `line.LAGS` of each flow Q in the order of the chain, where the lines' friction is unsteady

with p_a, p_b the valve ports, p_1, p_2 the chambers, each joined with the half segment of line next to it. Spool and
its rate move only when the valve has dynamics.
"""

from __future__ import annotations

import numpy as np

from ..core.jit import kernel, record_in
from ..core.records import record, size_of
from .line import LAGS

STATES = record(("p_a", "p_1", "p_2", "p_b", "p_t", "x_c", "v_c", "integral", "spool", "spool_rate"))
"""The border's states."""

FURTHER = record(("p_p", "p_pump", "Q_hose", "Q_pump", "x_r", "v_r"))
"""Those that only some effects need: port p, the pump's outlet, the flow between them, the pump's; a rod loose in the
eye."""

BORDER, MORE = size_of(STATES), size_of(FURTHER)
"""How many these are."""

PUMPLESS = 1e-3
"""Share of the valve's rated flow below which a pump is none."""


@kernel
def typical_flow(c: object) -> float:
    """Flow [m3/s] by which others are large or small: the pump's. A supply from outside comes with another pump, and
    where there is none here it is the valve's rated flow."""
    if c.supply.from_outside != 0.0 and c.pump.flow < PUMPLESS * c.valve.q_rated:
        return c.valve.q_rated
    return c.pump.flow


def state_scales(c: np.record) -> np.ndarray:
    """Typical size of each state, (ny,), by which the integration's errors are made dimensionless."""
    nc, m = chain_length(c), border_length(c)
    flow, p = max(typical_flow(c), 1e-9), c.relief.p_set
    scales = np.full(nc + m + lag_length(c), flow)
    for first in (0, nc // 2):
        scales[first + 1 : first + nc // 2 : 2] = p
    rate = 1.0 / c.valve.spool_time if c.valve.spool_time > 0.0 else 1.0
    further = p, p, flow, flow, 0.1, 1.0  # a rod in its eye rings for a millisecond after every step
    scales[nc : nc + m] = (p, p, p, p, p, 0.1, 0.1, c.valve.i_rated, 1.0, rate, *further)[:m]
    return scales


@kernel
def chain_length(c: object) -> int:
    """How many states the insides of both lines have; the border's come behind them."""
    return 2 * (2 * int(c.line.segments) - 1)


@kernel
def border_length(c: object) -> int:
    """How many states the border has."""
    return BORDER + MORE if c.states.further != 0.0 else BORDER


@kernel
def lag_length(c: object) -> int:
    """How many lags there are."""
    return 2 * LAGS * int(c.line.segments) if c.states.lags != 0.0 else 0


@kernel
def border(y: object, c: object) -> object:
    """The border's states of y (ny,), or their rates, by name."""
    b = chain_length(c)
    return record_in(y, b, STATES)


@kernel
def further(y: object, c: object) -> object:
    """The further states of the border, where there are any."""
    b = chain_length(c) + BORDER
    return record_in(y, b, FURTHER)
