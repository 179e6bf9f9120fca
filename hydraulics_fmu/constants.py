"""The numbers that the kernels need, by name: every parameter of the variable table as it is, and what follows from
several of them beside those of its component."""

from __future__ import annotations

from collections.abc import Mapping
from math import pi, sqrt

import numpy as np

from ..core.errors import ParameterError
from ..core.jit import kernel
from ..core.records import record, row_of, size_of
from ..core.sea import ambient_pressure
from . import cylinder
from .curves import SIDE
from .oil import (
    effective_bulk_modulus,
    expansion,
    index_factor,
    stiffness_factor,
    temperature_factor,
    viscosity,
)
from .supply import pump_flow
from .valve import flow_gain, land_diameter
from .variables import HYDRAULICS

SHORTEST = 2.5e-4
"""Shortest delay or sampling period of the controller that is followed slice by slice [s], see `march`."""

LANDS = ("pa", "at", "pb", "bt")
"""Lands of the valve: from p to a, from a to t, from p to b, from b to t."""

DERIVED = (
    "sea.p_am", "oil.eta0", "oil.alpha", "oil.rho", "oil.beta", "oil.beta_e", "oil.thinner", "pump.flow",
    "relief.p_set",
    "valve.k_q", "valve.land_diameter", "valve.spool_time", "valve.retraction", "valve.curved",
    *(f"valve.overlap.{land}" for land in LANDS), *(f"valve.leak.{land}" for land in LANDS),
    f"valve.metering[{2 * SIDE}]",
    "line.resistance", "line.inertance", "line.stiffness", "line.half_segment", "line.half_at_chamber", "line.beta",
    "line.minor",
    "cylinder.area_1", "cylinder.area_2", "cylinder.viscous", "cylinder.leak", "cylinder.leak_further",
    "cylinder.curve_speed", f"cylinder.friction[{2 * SIDE}]",
    "compensator.area", "controller.delay", "controller.period",
)  # fmt: skip
"""What `constants` works out, under the components that it is of; the oil's are those at its temperature, in the place
of what is stated for 40 C."""

MACHINE = record(dict.fromkeys([*(name for name in HYDRAULICS.parameters({}) if not name.endswith(".T")), *DERIVED]))
"""The record of all constants; a T is under a longer name among those that are worked out."""

SIZE = size_of(MACHINE)
"""How many numbers they are."""


@kernel
def by_name(c: object) -> object:
    """The constants c (`SIZE`,) as a record, for kernels and for Python."""
    return c.view(MACHINE)[0]  # type: ignore[attr-defined]


def constants(p: Mapping[str, float]) -> np.ndarray:
    """The constants (`SIZE`,) of a machine with these parameters, by name as in the variable table.

    Raises `ParameterError` when parameters contradict each other.
    """
    if p["cylinder.d_h"] >= p["cylinder.D_h"]:
        raise ParameterError(
            f"parameter 'cylinder.d_h' = {p['cylinder.d_h']:g} m must be less than "
            f"'cylinder.D_h' = {p['cylinder.D_h']:g} m"
        )
    oil = _of_oil(p)
    warm = {**p, **oil}
    made = (_of_supply(warm, p), _of_valve(warm, p), _of_lines(warm), _of_cylinder(warm), _of_controller(warm))
    return row_of(MACHINE, warm | {name: value for part in made for name, value in part.items()})


def _of_oil(p: Mapping[str, float]) -> dict[str, float]:
    """The oil at its temperature; density, modulus and index are those that the parameters state for 40 C there."""
    T = p["effect.oil_temperature.T"]
    rho, beta = p["oil.rho"] / expansion(T), p["oil.beta"] * stiffness_factor(T)
    cold = p["oil.rho"] * p["oil.nu0"]
    eta0 = rho * (p["oil.nu0"] * temperature_factor(T))
    return {
        "oil.eta0": eta0, "oil.rho": rho, "oil.beta": beta, "oil.alpha": p["oil.alpha"] * index_factor(eta0, cold),
        "oil.beta_e": effective_bulk_modulus.py_func(beta, p["line.beta_wall"]), "oil.thinner": cold / eta0,
    }  # fmt: skip


def _of_supply(warm: Mapping[str, float], p: Mapping[str, float]) -> dict[str, float]:
    p_am = ambient_pressure(p["depth"]) * p["effect.ambient_pressure_error.scale"]
    eta = viscosity.py_func(
        p_am + 0.5 * p["relief.p_crack"], warm["oil.eta0"], warm["oil.alpha"], p["effect.viscosity_law.share"]
    )
    thicker = eta / (p["oil.rho"] * p["oil.nu0"])
    return {
        "sea.p_am": p_am,
        "pump.flow": pump_flow(p["pump.displacement"] * p["pump.speed"], p["effect.pump_slip.slip"], thicker),
        "relief.p_set": p["relief.p_crack"] * (1.0 - p["effect.supply_droop.droop"]),
        "compensator.area": pi * p["compensator.diameter"] ** 2 / 4.0,
    }


def _of_valve(warm: Mapping[str, float], p: Mapping[str, float]) -> dict[str, float | list[float]]:
    """The rated flow is that of oil at 40 C; lighter oil flows faster through the same land."""
    q_rated = p["valve.q_rated"] * p["effect.valve_flow_gain.scale"]
    gain, retraction = p["effect.valve_flow_gain.scale"], p["effect.valve_flow_gain.retraction"]
    overlap, leak = p["effect.valve_dead_zone.overlap"], p["effect.valve_leakage.c"]
    laps = {land: overlap * p[f"effect.valve_dead_zone.{land}"] for land in LANDS}
    if max(laps.values()) >= 1.0:
        raise ParameterError(
            f"parameter 'effect.valve_dead_zone.overlap' = {overlap:g} makes a land's overlap {max(laps.values()):g} "
            "of the stroke, which has to be less than 1"
        )
    opens = _curve(p, "valve_metering_curve")
    return {
        "valve.k_q": flow_gain(q_rated, p["valve.dp_rated"]) * sqrt(p["oil.rho"] / warm["oil.rho"]),
        "valve.land_diameter": land_diameter(q_rated, p["valve.dp_rated"], p["oil.rho"]),
        "valve.spool_time": p["effect.valve_dynamics.T"],
        "valve.retraction": 1.0 if retraction == 1.0 else (1.0 + (gain - 1.0) * retraction) / gain,
        **{f"valve.overlap.{land}": lap for land, lap in laps.items()},
        **{f"valve.leak.{land}": leak * p[f"effect.valve_leakage.{land}"] for land in LANDS},
        "valve.curved": float(any(opens)), "valve.metering": opens,
    }  # fmt: skip


def _of_lines(p: Mapping[str, float]) -> dict[str, float]:
    n = int(p["line.segments"])
    diameter = p["line.diameter"] * p["effect.line_diameter_error.scale"]
    bore = pi * diameter**2 / 4.0
    dx = p["line.length"] / n
    beta_e = p["oil.beta_e"]
    softer = 1.0 + beta_e * p["effect.hose_compliance.compliance"]
    return {
        "line.resistance": 128.0 * dx / (pi * diameter**4), "line.inertance": p["oil.rho"] * dx / bore,
        "line.stiffness": beta_e / softer / (bore * dx), "line.beta": beta_e / softer,
        "line.half_segment": 0.5 * bore * dx, "line.half_at_chamber": 0.5 * bore * dx * softer,
        "line.minor": p["effect.line_minor_losses.K"] * p["oil.rho"] / (2.0 * bore**2 * n),
    }  # fmt: skip


def _of_cylinder(p: Mapping[str, float]) -> dict[str, float | list[float]]:
    area_1, area_2 = cylinder.areas(p["cylinder.D_h"], p["cylinder.d_h"])
    worn, bent = p["effect.piston_leakage.scale"], p["effect.piston_leakage.turbulent"]
    rubs = _curve(p, "cylinder_friction_curve")
    return {
        "cylinder.area_1": area_1, "cylinder.area_2": area_2,
        "cylinder.viscous": p["cylinder.B_h"] * p["effect.cylinder_viscous_error.scale"],
        "cylinder.leak": p["cylinder.c_l"] * (worn if bent == 0.0 else 1.0),
        "cylinder.leak_further": p["cylinder.c_l"] * (worn - 1.0) if bent != 0.0 else 0.0,
        "cylinder.curve_speed": p["effect.cylinder_friction_curve.v_max"] if any(rubs) else 0.0,
        "cylinder.friction": rubs,
    }  # fmt: skip


def _of_controller(p: Mapping[str, float]) -> dict[str, float]:
    delay, period = p["effect.command_delay.tau"], p["effect.controller_sampling.period"]
    if period < SHORTEST:  # sampling so fast is the delay of half a period that it amounts to
        delay, period = delay + 0.5 * period, 0.0
    return {"controller.delay": delay, "controller.period": period}


def _curve(p: Mapping[str, float], effect: str) -> list[float]:
    return [p[f"effect.{effect}.y{k}"] for k in range(1, 2 * SIDE + 1)]
