"""The plant's supply: pump and relief valve, and what may lie between them and the valve.

The plain machine's relief valve is ideal. With an override, a filter, a pump that needs time or a long hose the
pressure at the valve is a state of its own, in the volume of oil there. A machine has one of these four at most.
"""

from __future__ import annotations

import numpy as np

from .compiled import kernel
from .forms import oil_compliance, viscosity

PUMPED, HOSE = 42, 44
"""Places among the states: flow of a pump on its way (two), hose (flow, pressure in its middle, flow)."""


@kernel
def relief_pressure(c, t: float, p_t: float) -> float:
    """Pressure (Pa) at which the relief valve opens: set pressure, droop, hunting of the valve, a dip of the supply."""
    share = 1.0 - c.droop
    if c.droop_time > 0.0:
        share = 1.0 + c.droop * np.expm1(-max(t, 0.0) / c.droop_time)
    if c.hunting != 0.0:
        share += c.hunting * np.sin(2.0 * np.pi * c.hunting_frequency * t)
    if c.dip != 0.0:
        share -= c.dip * np.exp(-(((t - c.dip_time) / c.dip_width) ** 2))
    return p_t + c.relief_pressure * share


@kernel
def pump_flow(c, eta0: float, p_p: float, p_t: float) -> float:
    """Flow (m3/s) that the pump delivers against p_p (Pa): what slips is laminar, Q = n v_p - k dp/eta (Wilson 1950);
    a share of it may be turbulent and grow with the root of the pressure.

    The viscosity is that in the middle between both pressures.
    """
    if c.slip == 0.0:
        return c.q_pump
    thicker = viscosity(c, eta0, 0.5 * (p_p + p_t)) / (c.rho * c.nu0)
    if c.slip_turbulent > 0.0:
        x = max((p_p - p_t) / c.relief_pressure, 0.0)
        bent = (1.0 - c.slip_turbulent) * x / thicker + c.slip_turbulent * x / np.sqrt(x + 1e-3)
        return c.q_pump * max(1.0 - c.slip * bent, 0.05)
    return c.q_pump * max(1.0 - c.slip * (p_p - p_t) / c.relief_pressure / thicker, 0.05)


@kernel
def relief_flow(c, over: float) -> float:
    """Flow (m3/s) of a relief valve with override, `over` (Pa) above its opening pressure.

    Slightly bent, through R Q at the pump's full flow, with a dead band of 1 %.
    """
    x = over / (c.override * c.q_pump) - 0.01
    soft = 0.5 * (x + np.sqrt(x * x + 1e-5))
    return c.q_pump * soft * (1.0 + c.override_bend * (1.0 - soft) / (1.0 + soft)) / 0.99


@kernel
def filtered(c, eta: float, drop: float) -> float:
    """Flow (m3/s) of oil of that viscosity (Pa s) through a filter under `drop` (Pa): four fifths of its loss at the
    pump's flow, with the oil of the surface, are laminar (Darcy), one fifth goes with its square (Forchheimer)."""
    a, b = 0.2, 0.8 * eta / (c.rho * c.nu0)
    x = abs(drop) / c.filter
    flow = c.q_pump * 2.0 * x / (b + np.sqrt(b * b + 4.0 * a * x))
    return flow if drop >= 0.0 else -flow


@kernel
def compensated(c, over: float) -> float:
    """Flow (m3/s) that a pressure-compensated pump is set to, `over` (Pa) above the tank: from all it can to nothing
    over about the last `pump_band` of its pressure, bent softly."""
    middle = (1.0 - 0.5 * c.pump_band) * c.relief_pressure
    return c.q_pump * 0.5 * (1.0 - np.tanh(2.0 * (over - middle) / (c.pump_band * c.relief_pressure)))


@kernel
def hose(c, eta0: float, y, p_p: float, p_relief: float, f) -> float:
    """Write the rates of a long hose in two lengths, with oil in its middle; returns the flow (m3/s) into it.

    A pump that cannot keep the pressure lets it fall by the whole within 2 % more than its flow.
    """
    q_1, p_m, q_2 = y[HOSE], y[HOSE + 1], y[HOSE + 2]
    over = max(q_1 / c.q_pump - 1.0, 0.0)
    inertance = c.rho * 0.5 * c.hose_length / c.hose_area
    loss = 128.0 * 0.5 * c.hose_length / (np.pi * c.hose_diameter**4)
    f[HOSE] = (p_relief * (1.0 - over / 0.02) - p_m - loss * viscosity(c, eta0, p_m) * q_1) / inertance
    f[HOSE + 1] = (q_1 - q_2) / (0.5 * c.hose_area * c.hose_length * oil_compliance(c, p_m))
    f[HOSE + 2] = (p_m - p_p - loss * viscosity(c, eta0, p_p) * q_2) / inertance
    return q_1


@kernel
def supply_flows(c, eta0: float, y, p_t: float, p_p: float, p_relief: float, q_p: float, f) -> tuple[float, float]:
    """Flow (m3/s) that the pump could give and that stays in the tank or comes back to it, and rate (Pa/s) of the
    pressure at the valve, p_p (Pa), where q_p (m3/s) goes into the machine; writes the rates of further states."""
    volume = c.supply_volume
    if c.override > 0.0:
        back = relief_flow(c, p_p - p_relief)
        pump = pump_flow(c, eta0, p_p, p_t)
        return back + (c.q_pump - pump), (pump - q_p - back) / (volume * oil_compliance(c, p_p))
    if c.filter > 0.0:
        come = min(filtered(c, viscosity(c, eta0, p_p), p_relief - p_p), c.q_pump)
    elif c.pump_time > 0.0:
        lag = 0.5 * c.pump_time
        f[PUMPED] = (compensated(c, p_p - p_t) - y[PUMPED]) / lag
        f[PUMPED + 1] = (y[PUMPED] - y[PUMPED + 1]) / lag
        over = (p_p - p_t) / c.relief_pressure - 1.1  # a relief valve beside it, 10 % higher, soft
        come = y[PUMPED + 1] - c.q_pump * max(over + np.sqrt(over * over + 1e-6), 0.0) / 0.08
        volume = 20.0 * c.supply_volume
    else:
        taken = hose(c, eta0, y, p_p, p_relief, f)
        volume += 0.25 * c.hose_area * c.hose_length
        return c.q_pump - taken, (y[HOSE + 2] - q_p) / (volume * oil_compliance(c, p_p))
    return c.q_pump - come, (come - q_p) / (volume * oil_compliance(c, p_p))
