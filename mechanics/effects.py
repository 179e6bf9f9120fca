"""Effects of the arm that a real machine may have and the plain model has not: their parameters and their equations.

A new one is a row of `EFFECTS` and, after what it is, a term of `extra_torque`, a line of `with_effects`, or a use of
its parameters elsewhere (CONTRIBUTING.md walks through it). The catalogue of the diagnosis is in ssp/scenarios.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import cos, pi, sin, tanh

from ..core.jit import kernel
from ..core.variables import Variable, parameter


def _effect(name: str, start: float, unit: str, low: float, high: float, text: str) -> Variable:
    return parameter(f"effect.{name}", start, unit, low, high, text)


EFFECTS = (
    _effect("joint_friction.tau_c", 0.0, "N.m", 0.0, 1e8, "Coulomb friction of the pivot"),
    _effect("joint_friction.viscous", 0.0, "N.m.s/rad", 0.0, 1e6, "viscous friction of the pivot"),
    _effect("joint_friction.omega_0", 5e-3, "rad/s", 1e-6, 1.0, "angular velocity over which friction turns"),
    _effect("joint_friction.uneven", 0.0, "1", -1.0, 1.0, "share by which its Coulomb part is greater upwards"),
    _effect("payload_error.scale", 1.0, "1", 0.0, 100.0, "factor on the load's mass and weight"),
    _effect("payload_error.along", 0.0, "m", -10.0, 10.0, "how far beyond the beam's end the load hangs"),
    _effect("buoyancy_error.force", 0.0, "N", -1e7, 1e7, "additional upward force at the beam's middle"),
    _effect("marine_growth.thickness", 0.0, "m", 0.0, 0.5, "thickness of neutrally buoyant growth on beam and barrel"),
    _effect("marine_growth.part", 1.0, "1", 0.0, 1.0, "share of the beam, from its end, that is grown over"),
    _effect("drag_coefficient.scale", 1.0, "1", 0.0, 100.0, "factor on the drag coefficient"),
    _effect("drag_coefficient.part", 1.0, "1", 0.0, 1.0, "share of the beam, from its end, where it is so"),
    _effect("current_error.offset", 0.0, "m/s", -10.0, 10.0, "current beyond current_speed"),
    _effect("current_error.shear", 0.0, "1", -2.0, 2.0, "growth of the current along the beam, as a share of it"),
    _effect("current_unsteady.amplitude", 0.0, "m/s", 0.0, 10.0, "amplitude of a further sinusoidal current"),
    _effect("current_unsteady.frequency", 0.1, "1/s", 0.0, 100.0, "frequency of the further sinusoidal current"),
    _effect("current_unsteady.phase", 0.0, "rad", -7.0, 7.0, "phase of the further sinusoidal current at t = 0"),
    _effect("current_unsteady.harmonic", 0.0, "1", -3.0, 3.0, "amplitude at twice its frequency, as a share"),
    _effect("viv.C_L", 0.0, "1", 0.0, 50.0, "lift coefficient of the vortices that the beam sheds"),
    _effect("viv.strouhal", 0.2, "1", 0.01, 2.0, "their frequency, in units of current over diameter"),
    _effect("viv.phase", 0.0, "rad", -7.0, 7.0, "phase of their force at t = 0"),
    _effect("beam_flexibility.period", 0.0, "s", 0.0, 10.0, "period of the load on the bending beam; 0 = stiff"),
    _effect("beam_flexibility.damping", 0.02, "1", 0.0, 2.0, "damping ratio of that"),
    _effect("base_motion.heave", 0.0, "m", 0.0, 50.0, "amplitude of the base's vertical motion"),
    _effect("base_motion.pitch", 0.0, "rad", 0.0, 1.5, "amplitude of the base's rotation about the pivot"),
    _effect("base_motion.frequency", 0.12, "1/s", 0.0, 10.0, "frequency of both"),
    _effect("base_motion.phase", 0.0, "rad", -7.0, 7.0, "phase of both at t = 0"),
    _effect("tether.stiffness", 0.0, "N/m", 0.0, 1e7, "spring that pulls the beam's end back to where it was"),
    _effect("tether.drag", 0.0, "kg/m", 0.0, 1e5, "drag of a tether on the beam's end, per square of its speed"),
    _effect("ambient_pressure_error.scale", 1.0, "1", 0.1, 10.0, "factor on the ambient pressure"),
)  # fmt: skip
"""Exactly absent at the start values."""


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
    joint = c.effect.joint_friction
    s = tanh(omega / joint.omega_0)
    return joint.tau_c * (1.0 + joint.uneven * s) * s + joint.viscous * omega


@kernel
def buoyancy_torque(theta: float, length: float, c: object, pitch: float = 0.0) -> float:
    """Torque [N m] about the pivot of the additional upward force at the middle of a beam of that length [m] on a base
    that is turned by `pitch` [rad]."""
    return c.effect.buoyancy_error.force * cos(theta + pitch) * 0.5 * length


@kernel
def tether_torque(theta: float, omega: float, length: float, c: object) -> float:
    """Torque [N m] about the pivot of a tether at the end of a beam of that length [m]: a spring along the arc from
    where the end was at first, and a drag with the square of its speed."""
    tether, speed = c.effect.tether, length * omega
    return -length * (tether.stiffness * length * (theta - c.theta0) + tether.drag * abs(speed) * speed)


@kernel
def extra_torque(theta: float, omega: float, length: float, c: object, pitch: float = 0.0) -> float:
    """Torque [N m] about the pivot of all effects, on a base turned by `pitch` [rad]; positive raises the beam."""
    extra = buoyancy_torque(theta, length, c, pitch) - pivot_friction(omega, c)
    if c.effect.tether.stiffness > 0.0 or c.effect.tether.drag > 0.0:
        extra += tether_torque(theta, omega, length, c)
    return extra


@kernel
def shedding_rate(v: float, c: object) -> float:
    """Rate [rad/s] of the phase of the vortices that a current v [m/s] sheds: 2 pi St |v|/D."""
    return 2.0 * pi * c.effect.viv.strouhal * abs(v) / c.grown.beam


@kernel
def vortex_torque(v: float, phase: float, c: object) -> float:
    """Torque [N m] about the pivot of the vortices' force, rho/2 C_L D v^2 per length all along the beam, by a current
    of that size [m/s] across the plane of the arm; positive raises the beam."""
    force = 0.5 * c.rho_s * c.effect.viv.C_L * c.grown.beam * v * v
    return force * 0.5 * c.beam_length**2 * sin(phase + c.effect.viv.phase)
