"""The numbers that the kernels need, by name: every parameter of the variable table as it is, and what follows from
several of them beside those of its component."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from math import exp, pi, sqrt

import numpy as np

from ..core.errors import ParameterError
from ..core.jit import kernel
from ..core.records import record, row_of, size_of
from ..core.sea import ATMOSPHERE, ambient_pressure
from . import cylinder
from .curves import SIDE
from .oil import (
    STATED_AT,
    effective_bulk_modulus,
    emulsion,
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

COLDEST, HOTTEST = 200.0, 500.0
"""Temperatures [K] between which the laws of the oil are numbers; what an oil is used at lies far within."""

LEAST_FLOW = 1e-9
"""Least flow [m3/s] of a pump that a filter's loss is stated at."""

WARM_STEPS = 64
"""Steps of temperature between which a warm-up's constants are straight lines."""

SMALLEST_VOLUME = 1e-5
"""Smallest volume [m3] of a supply hose's oil."""

NO_TRAVEL = 1e-9
"""Travel [m] of a compensator that has none: 0 is one without end."""

COUNTERBALANCE_LOSS = 0.5e6
"""Loss [Pa] of a wide open counterbalance valve at the servo valve's rated flow."""

LANDS = ("pa", "at", "pb", "bt")
"""Lands of the valve: from p to a, from a to t, from p to b, from b to t."""

DERIVED = (
    "sea.p_am", "oil.eta0", "oil.alpha", "oil.rho", "oil.beta", "oil.beta_e", "oil.thinner", "oil.stated",
    "oil.softens", "states.further", "states.lags", "pump.flow", "relief.p_set", "supply.filter", "supply.filter_back",
    "supply.moves", "supply.lag", "supply.volume", "supply.inertance", "supply.resistance",
    "counterbalance.k_q",
    "valve.k_q", "valve.land_diameter", "valve.spool_time", "valve.retraction", "valve.curved",
    *(f"valve.overlap.{land}" for land in LANDS), *(f"valve.leak.{land}" for land in LANDS),
    f"valve.metering[{2 * SIDE}]",
    "line.resistance", "line.inertance", "line.stiffness", "line.half_segment", "line.half_at_chamber", "line.beta",
    "line.minor", "line.eta0", "line.alpha", "line.reynolds", "line.relaxation",
    "cylinder.loose", "cylinder.rod_mass", "cylinder.thinner",
    "cylinder.area_1", "cylinder.area_2", "cylinder.viscous", "cylinder.leak", "cylinder.leak_further",
    "cylinder.curve_speed", f"cylinder.friction[{2 * SIDE}]",
    "compensator.area", "compensator.gas", "compensator.travel", "controller.delay", "controller.period",
)  # fmt: skip
"""What `constants` works out, under the components that it is of; the oil's are those at its temperature, in the place
of what is stated for 40 C. oil.softens: whether the modulus of oil and walls depends on the pressure."""

SOFTENING = (
    "effect.entrained_air.fraction", "effect.bulk_modulus_pressure.m", "effect.hose_compliance.stiffening"
)  # fmt: skip
"""What makes it so."""

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
    oil = _of_oil(p, p["effect.oil_temperature.T"])
    warm = {**p, **oil}
    made = (
        _of_supply(warm, p), _of_valve(warm, p), _of_lines(warm, p), _of_cylinder(warm, p), _of_compensator(p),
        _of_controller(p),
    )  # fmt: skip
    named = warm | {name: value for part in made for name, value in part.items()}
    named["states.further"] = float(named["supply.moves"] != 0.0 or named["cylinder.loose"] != 0.0)
    named["oil.softens"] = float(any(p[name] != 0.0 for name in SOFTENING))
    named["states.lags"] = float(p["effect.unsteady_line_friction.share"] > 0.0)
    return row_of(MACHINE, named)


def warming(p: Mapping[str, float]) -> np.ndarray:
    """The constants at temperatures from that at the start to what the oil warms up to, in equal steps, one behind the
    other (`WARM_STEPS` + 1 times `SIZE`); nothing where it stays as it is."""
    return _warming(tuple(p.items())) if p["effect.oil_warm_up.rise"] != 0.0 else np.empty(0)


@lru_cache(maxsize=4)
def _warming(parameters: tuple[tuple[str, float], ...]) -> np.ndarray:
    """The same; a run asks for it several times."""
    p = dict(parameters)
    T, rise = p["effect.oil_temperature.T"], p["effect.oil_warm_up.rise"]
    shares = np.arange(WARM_STEPS + 1) / WARM_STEPS
    return np.concatenate([constants({**p, "effect.oil_temperature.T": T + rise * share}) for share in shares])


@kernel
def warmed(t: float, row: object, table: object, c: object) -> None:
    """Write into the row of c the constants at the oil's temperature at t [s], from those that `warming` gave."""
    at = WARM_STEPS * (1.0 - exp(-max(t, 0.0) / c.effect.oil_warm_up.time))
    k = min(int(at), WARM_STEPS - 1)
    for i in range(SIZE):
        low, high = table[k * SIZE + i], table[(k + 1) * SIZE + i]
        row[i] = low + (high - low) * (at - k)


def _of_oil(p: Mapping[str, float], T: float, place: str = "tank") -> dict[str, float]:
    """The oil at T [K]; density, modulus and index are those that the parameters state for 40 C there.

    place: where it is, for the `ParameterError` of a temperature that no oil is used at.
    """
    if not COLDEST <= T <= HOTTEST:
        raise ParameterError(
            f"'effect.oil_temperature', 'effect.oil_warm_up' and 'effect.line_thermal' give the oil of the {place} "
            f"{T:g} K, which has to be between {COLDEST:g} and {HOTTEST:g} K"
        )
    cold = p["oil.rho"] * p["oil.nu0"]
    dry = p["oil.rho"] / expansion(T)
    thin = dry * (p["oil.nu0"] * temperature_factor(T, p["oil.nu0"]))
    eta0, rho, beta = emulsion(thin, dry, p["oil.beta"] * stiffness_factor(T), p["effect.water_in_oil.share"])
    return {
        "oil.eta0": eta0, "oil.rho": rho, "oil.beta": beta, "oil.alpha": p["oil.alpha"] * index_factor(thin, cold),
        "oil.beta_e": effective_bulk_modulus.py_func(beta, p["line.beta_wall"]), "oil.thinner": cold / eta0,
        "oil.stated": cold,
    }  # fmt: skip


def _of_oil_in(
    place: str, colder: float, warm: Mapping[str, float], p: Mapping[str, float]
) -> Mapping[str, float]:
    """The oil in the lines or in the cylinder, which has a share of the tank's deviation from 40 C and is colder."""
    share = p[f"effect.oil_temperature.{place}"]
    if share == 1.0 and colder == 0.0:
        return warm
    return _of_oil(p, STATED_AT + (p["effect.oil_temperature.T"] - STATED_AT) * share - colder, place)


def _of_supply(warm: Mapping[str, float], p: Mapping[str, float]) -> dict[str, float]:
    p_am = ambient_pressure(p["depth"]) * p["effect.ambient_pressure_error.scale"]
    eta = viscosity.py_func(
        p_am + 0.5 * p["relief.p_crack"], warm["oil.eta0"], warm["oil.alpha"], p["effect.viscosity_law.share"]
    )
    thicker, ideal = eta / (p["oil.rho"] * p["oil.nu0"]), p["pump.displacement"] * p["pump.speed"]
    clogged = 0.0
    if p["effect.filter_clogging.dp"] > 0.0:
        clogged = p["effect.filter_clogging.dp"] * thicker / max(ideal, LEAST_FLOW)
    length, diameter = p["effect.umbilical_supply.length"], p["effect.umbilical_supply.diameter"]
    droop = p["effect.supply_droop.droop"]
    bore, lag = pi * diameter**2 / 4.0, p["effect.pump_dynamics.T"]
    return {
        "sea.p_am": p_am,
        "pump.flow": pump_flow(ideal, p["effect.pump_slip.slip"], thicker, p["effect.pump_slip.turbulent"]),
        "relief.p_set": p["relief.p_crack"] * (1.0 - (0.0 if p["effect.supply_droop.time"] else droop)),
        "supply.filter": clogged * (1.0 - p["effect.filter_clogging.back"]),
        "supply.filter_back": clogged * p["effect.filter_clogging.back"],
        "supply.moves": float((length > 0.0 or lag > 0.0) and not p["supply.from_outside"]), "supply.lag": lag,
        "supply.inertance": warm["oil.rho"] * length / bore, "supply.resistance": 128.0 * length / (pi * diameter**4),
        "supply.volume": max(bore * length, SMALLEST_VOLUME) if length > 0.0 else p["effect.pump_dynamics.volume"],
    }  # fmt: skip


def _of_compensator(p: Mapping[str, float]) -> dict[str, float]:
    """A travel is that of a compensator made for the whole stroke, less what is missing of it; 0: without end."""
    area_1, area_2 = cylinder.areas(p["cylinder.D_h"], p["cylinder.d_h"])
    area, missing = pi * p["compensator.diameter"] ** 2 / 4.0, p["effect.compensator_travel.missing"]
    whole = (area_1 - area_2) * p["cylinder.stroke"] / area
    return {
        "compensator.area": area,
        "compensator.gas": ATMOSPHERE * p["effect.compensator_trapped_air.volume"],
        "compensator.travel": max((1.0 - missing) * whole, NO_TRAVEL) if missing else 0.0,
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
    if retraction != 1.0 and 1.0 + (gain - 1.0) * retraction <= 0.0:
        raise ParameterError(
            f"parameters 'effect.valve_flow_gain.scale' = {gain:g} and 'effect.valve_flow_gain.retraction' = "
            f"{retraction:g} leave a factor of {1.0 + (gain - 1.0) * retraction:g} on the flow of retraction, which "
            "has to be positive"
        )
    opens = _curve(p, "valve_metering_curve")
    return {
        "counterbalance.k_q": flow_gain(p["valve.q_rated"], COUNTERBALANCE_LOSS),
        "valve.k_q": flow_gain(q_rated, p["valve.dp_rated"]) * sqrt(p["oil.rho"] / warm["oil.rho"]),
        "valve.land_diameter": land_diameter(q_rated, p["valve.dp_rated"], p["oil.rho"]),
        "valve.spool_time": p["effect.valve_dynamics.T"],
        "valve.retraction": 1.0 if retraction == 1.0 else (1.0 + (gain - 1.0) * retraction) / gain,
        **{f"valve.overlap.{land}": lap for land, lap in laps.items()},
        **{f"valve.leak.{land}": leak * p[f"effect.valve_leakage.{land}"] for land in LANDS},
        "valve.curved": float(any(opens)), "valve.metering": opens,
    }  # fmt: skip


def _of_lines(warm: Mapping[str, float], p: Mapping[str, float]) -> dict[str, float]:
    """The modulus is that of the oil in the tank, whatever the lines' temperature."""
    n, oil = int(p["line.segments"]), _of_oil_in("lines", p["effect.line_thermal.colder"], warm, p)
    diameter = p["line.diameter"] * p["effect.line_diameter_error.scale"]
    bore = pi * diameter**2 / 4.0
    dx = p["line.length"] / n
    beta_e = warm["oil.beta_e"]
    softer = 1.0 + beta_e * p["effect.hose_compliance.compliance"]
    return {
        "line.resistance": 128.0 * dx / (pi * diameter**4), "line.inertance": oil["oil.rho"] * dx / bore,
        "line.stiffness": beta_e / softer / (bore * dx), "line.beta": beta_e / softer,
        "line.half_segment": 0.5 * bore * dx, "line.half_at_chamber": 0.5 * bore * dx * softer,
        "line.minor": p["effect.line_minor_losses.K"] * oil["oil.rho"] / (2.0 * bore**2 * n),
        "line.eta0": oil["oil.eta0"], "line.alpha": oil["oil.alpha"],
        "line.reynolds": 4.0 * oil["oil.rho"] / (pi * diameter),
        "line.relaxation": 4.0 / (oil["oil.rho"] * diameter**2),
    }  # fmt: skip


def _of_cylinder(warm: Mapping[str, float], p: Mapping[str, float]) -> dict[str, float | list[float]]:
    oil = _of_oil_in("cylinder", 0.0, warm, p)
    area_1, area_2 = cylinder.areas(p["cylinder.D_h"], p["cylinder.d_h"])
    worn = p["effect.piston_leakage.scale"]
    bent = p["effect.piston_leakage.turbulent"] != 0.0 or p["effect.piston_leakage.opening"] != 0.0
    rubs = _curve(p, "cylinder_friction_curve")
    return {
        "cylinder.area_1": area_1, "cylinder.area_2": area_2,
        "cylinder.viscous": p["cylinder.B_h"] * p["effect.cylinder_viscous_error.scale"],
        "cylinder.loose": float(p["effect.joint_clearance.gap"] > 0.0),
        "cylinder.rod_mass": p["effect.joint_clearance.rod_mass"], "cylinder.thinner": oil["oil.thinner"],
        "cylinder.leak": p["cylinder.c_l"] * (1.0 if bent else worn),
        "cylinder.leak_further": p["cylinder.c_l"] * (worn - 1.0) if bent else 0.0,
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
