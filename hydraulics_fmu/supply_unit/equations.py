"""Equations of the supply: five states, whose inputs are the flows of all valves together.

    C dP/dt = Q_pump - Q_rv - Q_p      C = V/beta + V_gas/(n P): manifold and accumulator
    T dQ_pump/dt = demand - Q_pump     of a compensated pump; one of fixed displacement gives what it does not slip
    tank and compensator               Eqs. 2 and 3 of the paper, as in `compensator`

The relief valve is at the pump, the filter between both and the manifold: P_pump = P + F (Q_pump - Q_rv), which the
compensator of the pump and the relief valve feel. No output depends on a flow without delay, so a valve and its supply
make no algebraic loop.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import pi

import numpy as np

from ...core.jit import kernel
from ...core.records import record, row_of, size_of
from ...core.sea import ambient_pressure
from ..compensator import tank_rates
from ..oil import viscosity
from ..supply import pump_flow
from .variables import SUPPLY

STATES = record(("P", "Q_pump", "p_t", "x_c", "v_c"))
"""The states."""

COUNT = size_of(STATES)
"""How many they are."""

CONSTANTS = record((*(name for name in SUPPLY.parameters({}) if not name.endswith(".T")),
                    "sea.p_am", "pump.flow", "pump.lag", "relief.R", "filter.R", "compensator.area"))  # fmt: skip
"""The parameters, and what follows from them."""

SIZE = size_of(CONSTANTS)
"""How many numbers these are."""


@kernel
def by_name(c: object) -> object:
    """The constants c (`SIZE`,) as a record."""
    return c.view(CONSTANTS)[0]  # type: ignore[attr-defined]


@kernel
def states(y: object) -> object:
    """The states y (`COUNT`,), or their rates, as a record."""
    return y.view(STATES)[0]  # type: ignore[attr-defined]


def constants(p: Mapping[str, float]) -> np.ndarray:
    """The constants (`SIZE`,) of a supply with these parameters."""
    p_am, ideal = ambient_pressure(p["depth"]), p["pump.displacement"] * p["pump.speed"]
    eta_0 = p["oil.nu0"]  # only the ratio counts
    thicker = viscosity.py_func(p_am + 0.5 * p["relief.p_crack"], eta_0, p["oil.alpha"]) / eta_0
    flow = pump_flow(ideal, p["pump.slip"], thicker)
    made = {
        "sea.p_am": p_am, "pump.flow": flow, "pump.lag": p["pump.T"],
        "relief.R": p["relief.override"] * p["relief.p_crack"] / max(flow, 1e-9),
        "filter.R": p["filter.dp"] * thicker / max(ideal, 1e-9),
        "compensator.area": pi * p["compensator.diameter"] ** 2 / 4.0,
    }  # fmt: skip
    return row_of(CONSTANTS, {**p, **made})


@kernel
def gas_volume(P: float, c: object) -> float:
    """Gas [m3] in the accumulator at the pressure P [Pa]: all of it below the precharge."""
    precharge = c.sea.p_am + c.accumulator.precharge
    if precharge >= P:
        return c.accumulator.volume
    return c.accumulator.volume * (precharge / P) ** (1.0 / c.accumulator.polytropic)


@kernel
def capacity(P: float, c: object) -> float:
    """Oil [m3/Pa] that manifold and accumulator take per pressure."""
    made = c.manifold.volume / c.oil.beta
    if c.accumulator.volume > 0.0 and c.sea.p_am + c.accumulator.precharge < P:
        made += gas_volume(P, c) / (c.accumulator.polytropic * P)
    return made


@kernel
def at_pump(s: object, c: object) -> tuple[float, float]:
    """Pressure [Pa] at the pump and flow [m3/s] through the relief valve beside it, with the states s.

    What the valve spills does not go through the filter: Q_rv = max(P_pump - P_t - p_crack, 0)/R.
    """
    blocked = s.P + c.filter.R * s.Q_pump
    Q_rv = max(blocked - s.p_t - c.relief.p_crack, 0.0) / (c.relief.R + c.filter.R)
    return blocked - c.filter.R * Q_rv, Q_rv


@kernel
def rates(y: object, Q_p: float, Q_t: float, c: object, f: object) -> None:
    """Write the states' rates into f (`COUNT`,) for flows Q_p taken by the valves and Q_t given back [m3/s]."""
    s, rate = states(y), states(f)
    P_pump, Q_rv = at_pump(s, c)
    rate.P = (s.Q_pump - Q_rv - Q_p) / capacity(s.P, c)
    rate.Q_pump = 0.0
    if c.pump.compensated != 0.0:
        over = (c.pump.p_set - (P_pump - s.p_t)) / (c.pump.droop * c.pump.p_set)
        rate.Q_pump = (c.pump.flow * min(max(over, 0.0), 1.0) - s.Q_pump) / c.pump.lag
    tank_rates(Q_t + Q_rv, s.Q_pump, s.p_t, s, rate, c)


def rest(c: np.record, Q_p: float) -> np.ndarray:
    """The states (`COUNT`,) while the valves take a steady flow Q_p [m3/s] and give it back."""
    y = np.zeros(COUNT)
    s = states.py_func(y)
    s.p_t = c.sea.p_am + c.compensator.k_c * c.compensator.precompression / c.compensator.area
    if c.pump.compensated:
        s.Q_pump = min(Q_p, c.pump.flow)
        share = s.Q_pump / c.pump.flow if c.pump.flow > 0.0 else 0.0
        P_pump = s.p_t + c.pump.p_set * (1.0 - c.pump.droop * share)
        s.P = P_pump - c.filter.R * s.Q_pump
    else:
        s.Q_pump = c.pump.flow
        P_pump = s.p_t + c.relief.p_crack + c.relief.R * (s.Q_pump - Q_p)
        s.P = P_pump - c.filter.R * Q_p
    return y
