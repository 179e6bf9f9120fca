"""What can be wrong with the blind machines: effects of the catalogue, of its sensors, and effects it does not know.

An effect has one knob, the plant's parameter that says how strong it is, and shapes drawn at random. `library` says
which value of the library's parameter means exactly the same, where there is one.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from math import log10
from typing import Any

import numpy as np

from .machine import vogel

Shapes = Mapping[str, tuple[float, float]]


def walther_temperature(factor: float) -> float:
    """Temperature (K) at which Walther's law through 22 cSt at 40 C and 4.3 cSt at 100 C gives this viscosity factor.

    log10 log10(nu/cSt + 0.7) = A - B log10 T (ASTM D341).
    """

    def double_log(nu: float) -> float:
        return log10(log10(nu + 0.7))

    slope = (double_log(22.0) - double_log(4.3)) / (log10(373.15) - log10(313.15))
    return 10.0 ** (log10(313.15) + (double_log(22.0) - double_log(22.0 * factor)) / slope)


@dataclass(frozen=True)
class Effect:
    """An effect of the plant; amplitudes are distances of the knob from its neutral value, greatest ones per sign."""

    id: str
    group: str
    knob: str
    usual: float
    most_up: float
    neutral: float = 0.0
    most_down: float = 0.0
    shapes: Shapes = field(default_factory=dict)
    """Uniform ranges of further parameters."""
    address: str | None = None
    """The library's parameter that means the same as the knob; None: there is none that means exactly the same."""
    convert: Callable[[float], float] = float
    also: Mapping[str, str] = field(default_factory=dict)
    """Addresses of shapes that mean the same in the library."""
    drawn: bool = True
    """Whether the generator uses it."""

    def most(self, sign: float) -> float:
        """Greatest amplitude with this sign."""
        return self.most_up if sign > 0 else self.most_down

    def draw_sign(self, rng: np.random.Generator) -> float:
        """Direction of the change."""
        sign = 1.0 if rng.random() < 0.5 else -1.0
        return sign if self.most(sign) > 0.0 else -sign

    def draw_shapes(self, rng: np.random.Generator) -> dict[str, float]:
        """Values of the further parameters."""
        return {name: float(rng.uniform(low, high)) for name, (low, high) in self.shapes.items()}

    def plant(self, sign: float, amplitude: float, shapes: Mapping[str, float]) -> dict[str, float]:
        """Parameters of the plant."""
        return {self.knob: self.neutral + sign * amplitude, **shapes}

    def library(self, plant: Mapping[str, float]) -> dict[str, float | None]:
        """Values of the library's parameters that mean exactly the same."""
        if self.address is None:
            return {}
        values: dict[str, float | None] = {self.address: self.convert(plant[self.knob])}
        return values | {address: plant[shape] for shape, address in self.also.items()}


def _h(name: str) -> str:
    return f"hydraulics.effect.{name}"


def _a(name: str) -> str:
    return f"arm.effect.{name}"


_SWING = "current_unsteady"

CATALOGUE = (
    Effect("cylinder_coulomb_friction", "friction", "coulomb", 300, 2500, address=_h("cylinder_coulomb_friction.F_c")),
    Effect("cylinder_stribeck_friction", "friction", "stribeck", 300, 1900, shapes={"stribeck_velocity": (8e-3, 0.05)}),
    Effect("seal_pressure_friction", "friction", "seal_friction", 2e-5, 9e-4, address=_h("seal_pressure_friction.k_p")),
    Effect("cylinder_viscous_error", "friction", "viscous_scale", 3, 18, 1.0, 0.85,
           address=_h("cylinder_viscous_error.scale")),
    Effect("entrained_air", "stiffness", "air", 0.01, 0.04),
    Effect("hose_compliance", "stiffness", "hose", 1.5e-9, 9e-9),
    Effect("valve_dynamics", "timing", "spool_time", 5e-3, 0.028, address=_h("valve_dynamics.T")),
    Effect("command_delay", "timing", "delay", 8e-3, 0.048, address=_h("command_delay.tau")),
    Effect("valve_dead_zone", "valve_small", "overlap", 0.05, 0.28, address=_h("valve_dead_zone.overlap")),
    Effect("valve_null_shift", "valve_small", "null_shift", 0.03, 0.14, 0.0, 0.14,
           address=_h("valve_null_shift.shift")),
    Effect("valve_leakage", "leakage", "valve_leak", 1e-13, 9e-13),
    Effect("valve_flow_gain", "capacity", "flow_gain", 0.15, 0.45, 1.0, 0.55, address=_h("valve_flow_gain.scale")),
    Effect("orifice_flow_number", "viscosity", "lam_shift", 300, 1900, 1000.0, 900.0),
    Effect("piston_leakage", "leakage", "leakage_scale", 1, 18, 1.0, 0.9, address=_h("piston_leakage.scale")),
    Effect("oil_temperature", "viscosity", "temperature", 8, 28, 313.15, 36.0, address=_h("oil_temperature.T"),
           convert=lambda T: walther_temperature(vogel(T))),
    Effect("viscosity_law", "viscosity", "roelands", 0.5, 1.4, address=_h("viscosity_law.share")),
    Effect("pump_slip", "supply", "slip", 0.2, 0.57, address=_h("pump_slip.slip")),
    Effect("relief_override", "supply", "override", 1e10, 4.8e10),
    Effect("supply_droop", "supply", "droop", 0.06, 0.38, address=_h("supply_droop.droop")),
    Effect("line_minor_losses", "capacity", "minor_loss", 50, 480, address=_h("line_minor_losses.K")),
    Effect("line_diameter_error", "viscosity", "diameter_scale", 0.04, 0.24, 1.0, 0.19,
           address=_h("line_diameter_error.scale")),
    Effect("joint_friction", "friction_arm", "joint_friction", 40, 480, address=_a("joint_friction.tau_c")),
    Effect("payload_error", "weight", "payload_scale", 0.15, 0.9, 1.0, 0.55, address=_a("payload_error.scale")),
    Effect("buoyancy_error", "weight", "buoyancy", 40, 380, 0.0, 380.0, address=_a("buoyancy_error.force")),
    Effect("marine_growth", "current", "growth", 0.02, 0.095),
    Effect("drag_coefficient", "current", "drag_scale", 0.8, 3.8, 1.0, 0.85, address=_a("drag_coefficient.scale")),
    Effect("current_error", "current", "current_offset", 0.3, 1.4, 0.0, 1.4, address=_a("current_error.offset")),
    Effect(_SWING, _SWING, "swing_amplitude", 0.2, 0.95,
           shapes={"swing_frequency": (0.05, 0.5), "swing_phase": (-3.1, 3.1)}, address=_a(f"{_SWING}.amplitude"),
           also={"swing_frequency": _a(f"{_SWING}.frequency"), "swing_phase": _a(f"{_SWING}.phase")}),
    Effect("ambient_pressure_error", "viscosity", "ambient_scale", 0.03, 0.14, 1.0, 0.14,
           address=_h("ambient_pressure_error.scale")),
    Effect("controller_sampling", "timing", "sampling", 0.01, 0.058, address=_h("controller_sampling.period")),
)  # fmt: skip

SENSORS = (
    Effect("sensor_bias", "sensor", "bias", 0.004, 0.048, 0.0, 0.048),
    Effect("sensor_scale", "sensor", "scale", 0.02, 0.095, 1.0, 0.095),
    Effect("sensor_lag", "timing", "lag", 0.015, 0.095),
    Effect("sensor_delay", "timing", "delay", 0.015, 0.095),
)
"""Errors of one channel; the bias is a share of the channel's span."""

UNKNOWN = (
    Effect("local_scoring", "unknown", "scoring", 300, 5000,
           shapes={"scoring_place": (0.03, 0.09), "scoring_width": (0.006, 0.015)}),
    Effect("oil_warming", "unknown", "warming", 6, 28, 0.0, 20.0, shapes={"warming_time": (4.0, 12.0)}),
    Effect("tether_spring", "unknown", "tether", 200, 3000, shapes={"tether_angle": (0.55, 0.8)}),
    Effect("load_impacts", "unknown", "impact", 100, 4000,
           shapes={"impact_start": (2.5, 4.5), "impact_period": (2.7, 5.0), "impact_time": (0.04, 0.12)}),
    Effect("beam_flexibility", "unknown", "flexibility", 8e-6, 1.2e-4),
    Effect("valve_hysteresis", "unknown", "play", 0.02, 0.1),
    Effect("one_way_restriction", "unknown", "one_way", 50, 4000),
    Effect("viv", "unknown", "viv", 20, 800, shapes={"viv_strouhal": (0.16, 0.24)}),
    Effect("relief_hunting", "unknown", "hunting", 0.03, 0.3, shapes={"hunting_frequency": (1.0, 6.0)}),
    Effect("supply_dip", "unknown", "dip", 0.1, 0.6, shapes={"dip_time": (4.0, 9.0), "dip_width": (0.3, 1.0)}),
    Effect("end_cushion", "unknown", "cushion", 300, 2e5, shapes={"cushion_length": (0.02, 0.04)}),
    Effect("gas_pocket", "unknown", "gas_pocket", 3e-6, 1e-4),
    Effect("bulk_modulus_pressure", "unknown", "stiffening", 10, 16),
    Effect("cylinder_presliding", "unknown", "bristle", 300, 4000, shapes={"bristle_length": (1e-3, 3e-3)}),
    Effect("sensor_nonlinearity", "unknown", "wave", 2e-4, 4e-3, shapes={"wave_length": (0.02, 0.06)}),
    Effect("external_leakage", "unknown", "external_leak", 1e-14, 1e-12, drawn=False),
)  # fmt: skip
"""Effects that the catalogue did not know up to edition 2. The last one is not drawn: effects of the catalogue can take
it up. `wave` is of the displacement sensor: x + wave sin(2 pi x/wave_length)."""

_LEARNT = {
    "oil_warming": ("oil_warm_up", "viscosity"), "tether_spring": ("tether", "weight"),
    "beam_flexibility": ("beam_flexibility", "stiffness"), "valve_hysteresis": ("valve_hysteresis", "valve_small"),
    "viv": ("viv", "current_unsteady"), "end_cushion": ("end_cushion", "ends"),
    "bulk_modulus_pressure": ("bulk_modulus_pressure", "stiffness"),
    "cylinder_presliding": ("cylinder_presliding", "friction"), "external_leakage": ("external_leakage", "leakage"),
}  # fmt: skip
"""What the catalogue has learnt since, by its id and group there."""

_ALWAYS = (1.0, 1.0)
"""Range of a switch of the plant that an effect has turned on in every case."""

_QUICK = {"play_rate": (1500.0, 1500.0)}
"""Without this what has a play had a lag of 3 ms, too: two effects in one."""

_AS_SINCE_3: Mapping[str, Shapes] = {
    "valve_hysteresis": _QUICK,
    "oil_temperature": {"oil_varies": _ALWAYS}, "oil_warm_up": {"oil_varies": _ALWAYS},
    "valve_null_shift": {"null_shows": _ALWAYS}, "external_leakage": {"leak_at_rod": _ALWAYS},
}  # fmt: skip
"""What effects have had besides since edition 3."""


def _since_3(effect: Effect) -> Effect:
    more = _AS_SINCE_3.get(effect.id)
    return effect if more is None else replace(effect, shapes={**effect.shapes, **more})


LEARNT = tuple(
    _since_3(replace(e, id=_LEARNT[e.id][0], group=_LEARNT[e.id][1], drawn=True)) for e in UNKNOWN if e.id in _LEARNT
)
STRANGE = tuple(
    replace(e, id="sensor_wave") if e.knob == "wave" else e for e in UNKNOWN if e.id not in _LEARNT
)
"""Of the unknown ones, since edition 3: those that the catalogue has learnt, and those that it does not know still."""


NEW = (
    Effect("silt_lock", "valve_small", "silt", 0.03, 0.18, shapes={"silt_time": (3.0, 20.0), **_QUICK}),
    Effect("joint_clearance", "clearance", "clearance", 2e-4, 1.9e-3, address=_h("joint_clearance.gap")),
    Effect("density_pressure", "capacity", "density", 0.8, 2.0),
    Effect("water_in_oil", "viscosity", "water", 0.04, 0.28, shapes={"oil_varies": _ALWAYS},
           address=_h("water_in_oil.share")),
    Effect("line_turbulence", "capacity", "turbulence", 0.7, 1.9, shapes={"roughness": (0.0, 0.01)},
           drawn=False),
    Effect("unsteady_line_friction", "friction", "history", 0.8, 2.8, address=_h("unsteady_line_friction.share")),
    Effect("line_thermal", "viscosity", "line_cooling", 8.0, 28.0, 0.0, 23.0, address=_h("line_thermal.colder")),
    Effect("counterbalance_valve", "capacity", "hold_set", 5e6, 3.9e7, shapes={"hold_ratio": (1.0, 5.0)}),
    Effect("filter_clogging", "supply", "filter", 2e5, 4.5e6, address=_h("filter_clogging.dp")),
    Effect("pump_dynamics", "supply", "pump_time", 0.05, 0.45, shapes={"pump_band": (0.02, 0.15)}),
    Effect("umbilical_supply", "supply", "hose_length", 50.0, 1500.0, shapes={"hose_diameter": (8e-3, 16e-3)},
           address=_h("umbilical_supply.length"), also={"hose_diameter": _h("umbilical_supply.diameter")}),
    Effect("compensator_trapped_air", "tank", "tank_air", 2e-3, 0.019,
           address=_h("compensator_trapped_air.volume"), drawn=False),
    Effect("compensator_travel", "tank", "short_travel", 0.3, 0.98, address=_h("compensator_travel.missing")),
    Effect("base_motion", "base_motion", "heave", 0.3, 3.5,
           shapes={"heave_frequency": (0.06, 0.3), "heave_phase": (-3.1, 3.1), "pitch_per_heave": (0.0, 0.06)},
           address=_a("base_motion.heave"),
           also={"heave_frequency": _a("base_motion.frequency"), "heave_phase": _a("base_motion.phase")}),
)  # fmt: skip
"""Effects of the catalogue that were in no edition before the third. Two are not drawn, for nothing is seen of them in
any case: the flow in the lines has a Reynolds number of 1,300 at most, and trapped air moves the tank's pressure alone,
which no case measures."""

NEW_SENSORS = (
    Effect("sensor_drift", "sensor", "drift", 0.01, 0.09, 0.0, 0.09, shapes={"drift_time": (10.0, 60.0)}),
    Effect("sensor_nonlinearity", "sensor", "bow", 5e-3, 0.09, 0.0, 0.09, shapes={"bow_phase": (-1.5, 1.5)}),
)
"""The same of sensors: `drift` is a share of the channel's span after 20 s, `bow` one of half a wave over its span."""


def known(edition: int) -> tuple[Effect, ...]:
    """The effects of the catalogue, those of sensors included, as an edition has them."""
    if edition < 3:
        return (*CATALOGUE, *SENSORS)
    return (*(_since_3(e) for e in CATALOGUE), *NEW, *LEARNT, *sensors(edition))


def sensors(edition: int) -> tuple[Effect, ...]:
    """Errors of one channel, as an edition has them."""
    return SENSORS if edition < 3 else (*SENSORS, *NEW_SENSORS)


def unknown(edition: int) -> tuple[Effect, ...]:
    """The effects outside it that an edition draws."""
    return tuple(e for e in (UNKNOWN if edition < 3 else STRANGE) if e.drawn)


EXTRA_GROUPS = (
    {"oil_temperature", "viscosity_law", "ambient_pressure_error", "line_diameter_error"},
    {"valve_dynamics", "command_delay", "sensor_lag", "sensor_delay", "controller_sampling"},
    {"entrained_air", "hose_compliance", "beam_flexibility"},
    {"payload_error", "buoyancy_error"},
    {"current_error", "drag_coefficient", "marine_growth"},
)
"""Effects that a single run can hardly tell apart, beyond those with the same group in the catalogue."""


EXTRA_SINCE_3 = (
    {"base_motion", "current_unsteady", "viv"},
    {"sensor_bias", "sensor_drift"},
)


def alike(id: str, edition: int = 2) -> list[str]:
    """Effects that are in one ambiguity group with this one, itself included, sorted."""
    groups = {e.id: e.group for e in known(edition)}
    found = {id} | {other for other, group in groups.items() if group == groups.get(id)}
    for group in EXTRA_GROUPS if edition < 3 else (*EXTRA_GROUPS, *EXTRA_SINCE_3):
        if id in group:
            found |= group
    return sorted(found)


def by_id(id: str) -> Effect:
    """The effect of that id."""
    return next(e for e in (*CATALOGUE, *NEW, *SENSORS, *NEW_SENSORS, *UNKNOWN, *LEARNT, *STRANGE) if e.id == id)


def describe(values: Mapping[str, Any]) -> str:
    """Parameters in one line."""
    return ", ".join(f"{k} = {v:.4g}" for k, v in values.items())
