"""What a real arm may have and the plain model has not: the FMU's parameters, and what they do to the plain ones.

To add an effect, see CONTRIBUTING.md. One that is a force or torque of its own has its equation in `loads`.
"""

from __future__ import annotations

from collections.abc import Mapping

from ..core.variables import Variable, parameter


def _effect(name: str, start: float, unit: str, low: float, high: float, text: str) -> Variable:
    return parameter(f"effect.{name}", start, unit, low, high, text)


EFFECTS = (
    _effect("joint_friction.tau_c", 0.0, "N.m", 0.0, 1e5, "Coulomb friction of the pivot"),
    _effect("joint_friction.viscous", 0.0, "N.m.s/rad", 0.0, 1e6, "viscous friction of the pivot"),
    _effect("joint_friction.omega_0", 5e-3, "rad/s", 1e-6, 1.0, "angular velocity over which friction turns"),
    _effect("payload_error.scale", 1.0, "1", 0.0, 100.0, "factor on the load's mass and weight"),
    _effect("buoyancy_error.force", 0.0, "N", -1e5, 1e5, "additional upward force at the beam's middle"),
    _effect("marine_growth.thickness", 0.0, "m", 0.0, 0.5, "thickness of neutrally buoyant growth on beam and barrel"),
    _effect("drag_coefficient.scale", 1.0, "1", 0.0, 100.0, "factor on the drag coefficient"),
    _effect("current_error.offset", 0.0, "m/s", -10.0, 10.0, "current beyond current_speed"),
    _effect("current_unsteady.amplitude", 0.0, "m/s", 0.0, 10.0, "amplitude of a further sinusoidal current"),
    _effect("current_unsteady.frequency", 0.1, "1/s", 0.0, 100.0, "frequency of the further sinusoidal current"),
    _effect("current_unsteady.phase", 0.0, "rad", -7.0, 7.0, "phase of the further sinusoidal current at t = 0"),
    _effect("ambient_pressure_error.scale", 1.0, "1", 0.1, 10.0, "factor on the ambient pressure"),
)  # fmt: skip
"""What a real machine may have and the plain model has not; exactly absent at the start values (ssp effects.toml)."""


def with_effects(p: Mapping[str, float]) -> dict[str, float]:
    """The parameters of the plain arm as the effects change them, in the same units; bit for bit the same without."""
    return {
        **p,
        "load_weight": p["load_weight"] * p["effect.payload_error.scale"],
        "C_D": p["C_D"] * p["effect.drag_coefficient.scale"],
        "current_speed": p["current_speed"] + p["effect.current_error.offset"],
    }
