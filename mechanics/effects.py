"""Effects of the arm that a real machine may have and the plain model has not: their parameters and their equations.

A new one is a row of `EFFECTS` and, after what it is, a term of `extra_torque`, a line of `with_effects`, or a use of
its parameters elsewhere (CONTRIBUTING.md walks through it). The catalogue of the diagnosis is in ssp/scenarios.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import cos, tanh

import numpy as np

from ..core.jit import kernel
from ..core.variables import Variable, parameter


def _effect(name: str, start: float, unit: str, low: float, high: float, text: str) -> Variable:
    return parameter(f"effect.{name}", start, unit, low, high, text)


EFFECTS = (
    _effect("joint_friction.tau_c", 0.0, "N.m", 0.0, 1e5, "Coulomb friction of the pivot"),
    _effect("joint_friction.viscous", 0.0, "N.m.s/rad", 0.0, 1e6, "viscous friction of the pivot"),
    _effect("joint_friction.omega_0", 5e-3, "rad/s", 1e-6, 1.0, "angular velocity over which friction turns"),
    _effect("joint_friction.uneven", 0.0, "1", -1.0, 1.0, "share by which its Coulomb part is greater upwards"),
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
"""Exactly absent at the start values."""

_PLACE = {v.name.removeprefix("effect."): k for k, v in enumerate(EFFECTS)}

TAU_C, TAU_V, OMEGA_0, UNEVEN = (
    _PLACE[f"joint_friction.{name}"] for name in ("tau_c", "viscous", "omega_0", "uneven")
)
BUOY = _PLACE["buoyancy_error.force"]
AMPLITUDE_2, FREQUENCY_2, PHASE_2 = (_PLACE[f"current_unsteady.{n}"] for n in ("amplitude", "frequency", "phase"))
"""Places of the effects' parameters among the constants of the kernels, which begin with them."""


def effect_constants(p: Mapping[str, float]) -> np.ndarray:
    """The effects' parameters in the order of their places."""
    return np.array([p[v.name] for v in EFFECTS], dtype=float)


def with_effects(p: Mapping[str, float]) -> dict[str, float]:
    """The arm's parameters with the effects that change one of them."""
    return {
        **p,
        "load_weight": p["load_weight"] * p["effect.payload_error.scale"],
        "C_D": p["C_D"] * p["effect.drag_coefficient.scale"],
        "current_speed": p["current_speed"] + p["effect.current_error.offset"],
    }


@kernel
def pivot_friction(omega: float, c: object) -> float:
    """Torque [N m] of the pivot's friction against omega [rad/s]: Coulomb (regularised; greater upwards by a share,
    less downwards) and viscous."""
    s = tanh(omega / c[OMEGA_0])
    return c[TAU_C] * (1.0 + c[UNEVEN] * s) * s + c[TAU_V] * omega


@kernel
def buoyancy_torque(theta: float, length: float, c: object) -> float:
    """Torque [N m] about the pivot of the additional upward force at the middle of a beam of that length [m]."""
    return c[BUOY] * cos(theta) * 0.5 * length


@kernel
def extra_torque(theta: float, omega: float, length: float, c: object) -> float:
    """Torque [N m] about the pivot of all effects, positive raises the beam."""
    return buoyancy_torque(theta, length, c) - pivot_friction(omega, c)
