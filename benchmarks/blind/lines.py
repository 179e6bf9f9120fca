"""The plant's lines, Eqs. 13-15, 21, 22, with losses of fittings, cushion and valves, turbulence and history."""

from __future__ import annotations

import numpy as np

from .compiled import kernel
from .forms import denser, oil_compliance, physical, segment_viscosity, viscosity, wall_compliance
from .machine import SEGMENTS, VOGEL_B, VOGEL_C
from .water import linkage

LINE_A, LINE_B, HISTORY = 6, 6 + 2 * SEGMENTS + 1, 47
"""Places among the states: both lines, and the lags of their flows (three each)."""

COOLED = (0.6, 0.9, 1.1, 1.2, 1.2)
"""How much of the oil's cooling its segments have, from the valve to the cylinder."""

WEIGHTS, RATES = (1.0, 8.1, 40.0), (26.4, 200.0, 8000.0)
"""Of unsteady laminar friction, rates in nu/R^2 (Trikha 1975, J. Fluids Eng. 97)."""


@kernel
def colder(c, share: float, P: float) -> float:
    """Viscosity of a line's oil at P (Pa) relative to the tank's, where it is colder by that share of `line_cooling`:
    Vogel's law, and the pressure index as in `machine.heated`."""
    T = c.temperature - share * c.line_cooling
    index = ((c.temperature - VOGEL_C) / (T - VOGEL_C)) ** 0.6
    return np.exp(VOGEL_B / (T - VOGEL_C) - c.vogel0 + c.alpha * (index - 1.0) * P)


@kernel
def rougher(c, eta: float, q: float) -> float:
    """Loss of a flow (m3/s) in a pipe relative to a laminar one's, by Churchill's formula for all Reynolds numbers
    (1977, Chem. Eng. 84(24)): f = 8 ((8/Re)^12 + (A + B)^-1.5)^(1/12)."""
    re = max(4.0 * c.rho * abs(q) / (np.pi * c.pipe_diameter * eta), 1.0)
    a = (2.457 * np.log(1.0 / ((7.0 / re) ** 0.9 + 0.27 * c.roughness))) ** 16
    b = (37530.0 / re) ** 16
    f = 8.0 * ((8.0 / re) ** 12 + (a + b) ** -1.5) ** (1.0 / 12.0)
    return 1.0 + c.turbulence * (f * re / 64.0 - 1.0)


@kernel
def held_back(c, p_1: float, p_2: float) -> float:
    """Loss coefficient (Pa s2/m6) of a valve that holds the load: shut but for a leak until p_1 and `hold_ratio` p_2
    above the sea's (Pa) are `hold_set`, wide open a fifth of that later, soft at both ends."""
    x = (p_1 - c.p_am + c.hold_ratio * (p_2 - c.p_am) - c.hold_set) / (0.2 * c.hold_set)
    x = min(max(x, 0.0), 1.0)
    wide = max(x * x * (3.0 - 2.0 * x), 2e-3)
    return 0.4e6 / (c.rated_flow * wide) ** 2


@kernel
def history(c, eta0: float, y, first: int, is_b: bool, f) -> float:
    """Write the rates of a line's lags of its mean flow; returns the loss (Pa) of each segment by that history."""
    mean = 0.0
    for i in range(SEGMENTS):
        mean += y[first + 2 * i + 1] / SEGMENTS
    eta = viscosity(c, eta0, physical(y[first + SEGMENTS - 1], c.vapour_pressure))
    at = HISTORY + 3 if is_b else HISTORY
    total = 0.0
    for i in range(3):
        f[at + i] = RATES[i] * eta / c.rho / (0.5 * c.pipe_diameter) ** 2 * (mean - y[at + i])
        total += WEIGHTS[i] * (mean - y[at + i])
    return c.history * 0.5 * c.segment_loss * eta * total


@kernel
def line(c, eta0: float, y, first: int, is_b: bool, f) -> None:
    """Rates of a line's flows and inner nodes."""
    inertance = c.rho * c.segment / c.line_area
    volume = 2.0 * c.half_volume
    past = history(c, eta0, y, first, is_b, f) if c.history > 0.0 else 0.0
    for i in range(SEGMENTS):
        k = first + 2 * i + 1
        q = y[k]
        p_i, p_o = physical(y[k - 1], c.vapour_pressure), physical(y[k + 1], c.vapour_pressure)
        eta = segment_viscosity(c, eta0, p_i, p_o)
        if c.line_cooling != 0.0:
            eta *= colder(c, COOLED[SEGMENTS - 1 - i if is_b else i], 0.5 * (p_i + p_o))
        loss = c.segment_loss * eta
        if c.diameter_scale != 1.0:  # not even along the line
            loss *= 1.0 + 0.05 * (i - 2)
        if c.turbulence > 0.0:
            loss *= rougher(c, eta, q)
        extra = 0.0
        if c.minor_loss > 0.0:  # at the valve, on the way, at the cylinder
            share = (0.5, 0.0, 0.2, 0.0, 0.3)[SEGMENTS - 1 - i if is_b else i]
            even = c.minor_b if is_b else 1.0
            extra += share * c.minor_loss * even * (c.minor_back if (q > 0.0) == is_b else 1.0)
        if is_b and i == 0 and q > 0.0:
            extra += c.one_way
        if not is_b and i == SEGMENTS - 1 and q < 0.0 and c.cushion > 0.0:
            x = linkage(c, y[3])[0] - c.length0
            extra += c.cushion * min(max(1.0 - x / c.cushion_length, 0.0), 1.0) ** 2
        head = c.velocity_head * denser(c, 0.5 * (p_i + p_o))
        lost = (loss + extra * head * abs(q)) * q
        if c.history > 0.0:
            lost += past
        if c.hold_set > 0.0 and not is_b and i == SEGMENTS - 1 and q < 0.0:
            lost += held_back(c, p_o, physical(y[LINE_B], c.vapour_pressure)) * abs(q) * q
        f[k] = (p_i - p_o - lost) / (inertance * denser(c, 0.5 * (p_i + p_o)))
        if i > 0:
            compliance = oil_compliance(c, p_i) + wall_compliance(c, p_i)
            capacity = volume * compliance
            if c.gas_pocket > 0.0 and not is_b and i == 2:
                reference = c.p_am + 5e6
                capacity += c.gas_pocket * (reference / p_i) ** (1.0 / 1.2) / (1.2 * p_i)
            f[k - 1] = (y[k - 2] - q) / capacity
