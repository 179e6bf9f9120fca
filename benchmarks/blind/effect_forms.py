"""Forms in which machines have an effect, other than the catalogue's plain one: further parameters of the plant.

At its neutral values a form is the plain effect. A third of the effects of a case of edition 2 is in another form.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from .effects import CATALOGUE, SENSORS, Effect, Shapes

SHARE = 1.0 / 3.0
"""Share of the effects that is in another form, those counted of which there is none."""


@dataclass(frozen=True)
class Form:
    """A form of an effect: uniform ranges of the parameters that make it, and what it is."""

    effect: str
    id: str
    text: str
    ranges: Shapes
    only_more: bool = False
    """Only of an effect that is more than neutral."""

    def draw(self, rng: np.random.Generator) -> dict[str, float]:
        """Values of its parameters."""
        return {name: float(rng.uniform(low, high)) for name, (low, high) in self.ranges.items()}


def _lands(kind: str, low: float, high: float) -> Mapping[str, tuple[float, float]]:
    return {f"{kind}_{land}": (low, high) for land in ("pa", "at", "pb", "bt")}


_UNEVEN = {"friction_uneven": (0.25, 0.6)}
_UNEVEN_TEXT = "greater extending than retracting"
_BRISTLES = {"presliding": (5e-5, 4e-4), "friction_uneven": (0.0, 0.4)}
_BRISTLES_TEXT = "bristles that bend before they slide (LuGre), greater extending"
_OUTER = {"outer_from": (0.3, 0.7)}

FORMS = (
    Form("cylinder_coulomb_friction", "unequal_directions", _UNEVEN_TEXT, _UNEVEN),
    Form("cylinder_coulomb_friction", "presliding", _BRISTLES_TEXT, _BRISTLES),
    Form("cylinder_stribeck_friction", "unequal_directions", _UNEVEN_TEXT, _UNEVEN),
    Form("cylinder_stribeck_friction", "presliding", _BRISTLES_TEXT, _BRISTLES),
    Form("cylinder_stribeck_friction", "exponent", "another power of the velocity", {"stribeck_exponent": (0.5, 1.4)}),
    Form("seal_pressure_friction", "unequal_directions", _UNEVEN_TEXT, _UNEVEN),
    Form("seal_pressure_friction", "presliding", _BRISTLES_TEXT, _BRISTLES),
    Form("cylinder_viscous_error", "power", "a power of the velocity", {"viscous_power": (0.7, 1.6)}),
    Form("entrained_air", "dissolving", "half dissolved at a low pressure", {"air_half": (2e6, 15e6)}),
    Form("entrained_air", "polytropic", "bubbles that keep their heat", {"air_exponent": (1.2, 1.4)}),
    Form("hose_compliance", "stiffening", "much stiffer as it fills", {"hose_fade": (0.6, 1.2)}),
    Form("valve_dynamics", "rate_limit", "a spool of limited speed", {"spool_rate": (3.0, 10.0)}),
    Form("valve_dynamics", "underdamped", "a spool that overshoots", {"spool_damping": (0.3, 0.55)}),
    Form("valve_dead_zone", "unequal_lands", "four lands, each with its overlap", _lands("overlap", 0.4, 1.6)),
    Form("valve_dead_zone", "open_return", "lands to the tank without overlap",
         {"overlap_at": (-0.4, 0.2), "overlap_bt": (-0.4, 0.2)}),
    Form("valve_leakage", "unequal_lands", "four lands, each with its wear", _lands("leak", 0.2, 1.8)),
    Form("valve_leakage", "turbulent", "partly turbulent", {"leak_turbulent": (0.4, 0.9)}),
    Form("valve_flow_gain", "unequal_directions", "less wrong in retraction", {"gain_retract": (0.0, 0.5)}),
    Form("valve_flow_gain", "notched", "wrong at small openings only", {"notch": (0.15, 0.5)}),
    Form("piston_leakage", "turbulent", "partly turbulent", {"piston_turbulent": (0.4, 0.9)}, only_more=True),
    Form("piston_leakage", "opened", "opened by the pressure", {"piston_opening": (0.5, 2.0)}, only_more=True),
    Form("pump_slip", "turbulent", "partly turbulent", {"slip_turbulent": (0.4, 0.9)}),
    Form("relief_override", "bent", "a bent characteristic", {"override_bend": (0.3, 0.8)}),
    Form("supply_droop", "slow", "sinking after the start", {"droop_time": (1.0, 4.0)}),
    Form("line_minor_losses", "one_line", "in one line more than in the other", {"minor_b": (0.0, 0.5)}),
    Form("line_minor_losses", "directions", "less towards the tank", {"minor_back": (0.2, 0.6)}),
    Form("oil_temperature", "lines_apart", "less in the lines than in the tank", {"line_share": (0.2, 0.6)}),
    Form("joint_friction", "unequal_directions", "greater upwards than downwards", {"joint_uneven": (0.25, 0.6)}),
    Form("payload_error", "off_centre", "not at the beam's end", {"load_place": (0.4, 0.8)}),
    Form("marine_growth", "outer_part", "on the outer part of the beam", _OUTER),
    Form("drag_coefficient", "outer_part", "on the outer part of the beam", _OUTER),
    Form("current_error", "profile", "more at the beam's end", {"current_shear": (0.4, 1.0)}),
    Form("current_unsteady", "harmonic", "a strong second harmonic", {"swing_harmonic": (0.3, 0.6)}),
    Form("sensor_lag", "second_order", "two filters in a row", {"order": (2.0, 2.0)}),
    Form("sensor_delay", "jitter", "samples late by different times", {"jitter": (0.2, 0.5)}),
)  # fmt: skip


def of(effect: Effect, sign: float) -> tuple[Form, ...]:
    """The forms in which an effect may be that is more (sign 1) or less (-1) than neutral."""
    return tuple(f for f in FORMS if f.effect == effect.id and (sign > 0.0 or not f.only_more))


_WITH_FORMS = sum(bool(of(e, 1.0)) for e in (*CATALOGUE, *SENSORS))
CHANCE = SHARE * len((*CATALOGUE, *SENSORS)) / _WITH_FORMS
"""How often an effect that has other forms is in one of them."""


def draw(rng: np.random.Generator, effect: Effect, sign: float) -> Form | None:
    """The form of an effect; None: the plain one."""
    there = of(effect, sign)
    if not there or rng.random() >= CHANCE:
        return None
    return there[int(rng.integers(len(there)))]
