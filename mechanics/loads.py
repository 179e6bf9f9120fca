"""Equation of motion of the closed linkage: MuJoCo's tree, projected on the beam's angle, with the water's loads.

With q = (theta, phi, L) and q' = G(theta) omega, MuJoCo's M q'' + bias = Q becomes

    (G^T M G) alpha = G^T (Q - bias - M dG/dtheta omega^2)

for the one degree of freedom that the loop leaves. The entrained water adds to M. Kernels take the constants as a
record c (`constants.by_name`) and the base's motion as `base` writes it.
"""

from __future__ import annotations

from math import cos, pi, sin

from ..core.jit import kernel
from ..core.sea import GRAVITY
from .base import HEAVE_ACC, HEAVE_RATE, PITCH, PITCH_ACC, PITCH_RATE, inertial_loads, seen_from_base
from .effects import extra_torque
from .hydrodynamics import added_inertia, drag, inertia_per_length, printed_torque, wave
from .linkage import linkage

MASS, TORQUE, LEVER, X, V = range(5)
"""Places in the result of `project`: effective inertia, torque without the cylinder, dL/dtheta, x_h, v_h."""


@kernel
def current(t: float, c: object) -> tuple[float, float]:
    """Velocity [m/s] and acceleration [m/s2] of the current: steady part and two sinusoidal ones."""
    unsteady = c.effect.current_unsteady
    v_1, a_1 = wave(t, c.current_amplitude, c.current_frequency, 0.0)
    v_2, a_2 = wave(t, unsteady.amplitude, unsteady.frequency, unsteady.phase)
    if unsteady.harmonic != 0.0:
        v, a = wave(t, unsteady.harmonic * unsteady.amplitude, 2.0 * unsteady.frequency, 2.0 * unsteady.phase)
        v_2, a_2 = v_2 + v, a_2 + a
    return c.current_speed + v_1 + v_2, a_1 + a_2


@kernel
def water(t: float, motion: object, c: object) -> tuple[float, float, float, float]:
    """Velocity [m/s] and acceleration [m/s2] of the water in the base's frame, along its two axes."""
    v, a = current(t, c)
    if motion[PITCH] == 0.0 and motion[HEAVE_RATE] == 0.0 and motion[HEAVE_ACC] == 0.0:
        return v, 0.0, a, 0.0
    v_x, v_y = seen_from_base(v, motion[HEAVE_RATE], motion[PITCH])
    a_x, a_y = seen_from_base(a, motion[HEAVE_ACC], motion[PITCH])
    return v_x, v_y, a_x, a_y


@kernel
def drag_torque(u: float, w: float, l1: float, l2: float, diameter: float, C_D: float, c: object) -> float:
    """Torque [N m] about the hinge of the drag between distances l1 and l2 [m] from it."""
    if c.drag_as_printed > 0.0:
        return printed_torque(u, w, l1, l2, diameter, c.rho_s, C_D)
    _, torque = drag(u, w, l1, l2, diameter, c.rho_s, C_D)
    return torque


@kernel
def beam_drag(u: float, w: float, l1: float, l2: float, c: object) -> tuple[float, float]:
    """Force [N] and torque [N m] of the drag on the beam between l1 and l2 [m], in a current that grows along the beam
    and on a part of it that is grown over or drags as its coefficient says."""
    L, shear = c.beam_length, c.effect.current_error.shear
    grown, rough = L * (1.0 - c.effect.marine_growth.part), L * (1.0 - c.effect.drag_coefficient.part)
    near, far = min(grown, rough), max(grown, rough)
    force, torque = 0.0, 0.0
    for k in range(3):
        a = max((l1, near, far)[k], l1)
        b = min((near, far, l2)[k], l2)
        if b > a:
            middle = 0.5 * (a + b)
            diameter = c.grown.beam if middle > grown else c.beam_diameter
            C_D = c.C_D if middle > rough else c.plain.C_D
            f, m = drag(u * (1.0 - 0.5 * shear), w - u * shear / L, a, b, diameter, c.rho_s, C_D)
            if c.drag_as_printed > 0.0:  # Eq. 29, and Eq. 30 with its factor 1/2, of the current at each place
                _, turning = drag(0.0, w, a, b, diameter, c.rho_s, C_D)
                _, standing = drag(u * (1.0 - 0.5 * shear), -u * shear / L, a, b, diameter, c.rho_s, C_D)
                m = turning + 2.0 * standing
            force, torque = force + f, torque + m
    return force, torque


@kernel
def beam_water(power: int, l1: float, l2: float, c: object) -> float:
    """Integral of the beam's inertia coefficient times l^power over l1 to l2 [m]: kg, kg m or kg m2."""
    bare = min(max(c.beam_length * (1.0 - c.effect.marine_growth.part), l1), l2)
    n = power + 1
    inner = inertia_per_length(c.beam_diameter, c.rho_s, c.C_M) * (bare**n - l1**n) / n if bare > l1 else 0.0
    return inner + inertia_per_length(c.grown.beam, c.rho_s, c.C_M) * (l2**n - bare**n) / n


@kernel
def beam_torque(u: float, w: float, c: object) -> float:
    """Torque [N m] of the drag on the beam."""
    if c.switch.drag_varies > 0.0:
        _, torque = beam_drag(u, w, 0.0, c.beam_length, c)
        return torque
    return drag_torque(u, w, 0.0, c.beam_length, c.grown.beam, c.C_D, c)


@kernel
def place(theta: float, omega: float, c: object, qpos: object, qvel: object) -> None:
    """Write the joint positions and velocities of the closed linkage."""
    L, dL, _, phi, dphi, _ = linkage(theta, c.rod_eye_radius, c.base_x, c.base_y)
    qpos[0] = theta
    qpos[1] = phi
    qpos[2] = L
    qvel[0] = omega
    qvel[1] = dphi * omega
    qvel[2] = dL * omega


@kernel
def project(
    theta: float, omega: float, t: float, c: object, motion: object, M: object, bias: object, passive: object,
    out: object,
) -> None:  # fmt: skip
    """Write MASS [kg m2], TORQUE [N m], LEVER [m], X [m], V [m/s]; alpha = (TORQUE + LEVER F_h)/MASS."""
    L, dL, ddL, phi, dphi, ddphi = linkage(theta, c.rod_eye_radius, c.base_x, c.base_y)
    v_x, v_y, a_x, a_y = water(t, motion, c)
    # water on the beam, about the pivot
    length, turn = c.beam_length, motion[PITCH_RATE]
    beam = beam_torque(v_y * cos(theta) - v_x * sin(theta), omega + turn, c)
    beam += beam_water(1, 0.0, length, c) * (a_y * cos(theta) - a_x * sin(theta))
    beam_inertia = beam_water(2, 0.0, length, c)
    # water on the cylinder, about the base hinge
    barrel_end = min(c.barrel_length, L)
    u_x, u_y = v_x + turn * c.base_y, v_y - turn * c.base_x
    cylinder = cylinder_water_torque(phi, dphi * omega + turn, L, u_x, u_y, a_x, a_y, c)
    # buoyancy of the rod's part outside the barrel
    upright = cos(phi + motion[PITCH])
    cylinder += c.rho_s * GRAVITY * pi * c.rod_diameter**2 / 4.0 * upright * (L**2 - barrel_end**2) / 2.0
    cylinder_inertia = cylinder_added_inertia(L, c)
    w2 = omega * omega
    m00 = M[0, 0] + beam_inertia
    m11 = M[1, 1] + cylinder_inertia
    out[MASS] = m00 + m11 * dphi**2 + M[2, 2] * dL**2 + 2.0 * (M[0, 1] * dphi + M[0, 2] * dL + M[1, 2] * dphi * dL)
    extra = extra_torque(theta, omega, length, c, motion[PITCH])
    r0 = passive[0] - bias[0] + beam + extra - (M[0, 1] * ddphi + M[0, 2] * ddL) * w2
    r1 = passive[1] - bias[1] + cylinder - (m11 * ddphi + M[1, 2] * ddL) * w2
    r2 = passive[2] - bias[2] - (M[1, 2] * ddphi + M[2, 2] * ddL) * w2
    if c.switch.base_moves > 0.0:
        on_beam, on_cylinder, on_rod = inertial_loads(theta, phi, L, motion, m00, m11, c)
        r0, r1, r2 = r0 + on_beam, r1 + on_cylinder, r2 + on_rod
    out[TORQUE] = r0 + dphi * r1 + dL * r2
    out[LEVER] = dL
    out[X] = L - c.start.length
    out[V] = dL * omega


@kernel
def cylinder_added_inertia(L: float, c: object) -> float:
    """Moment of inertia [kg m2] about the base hinge of the water entrained by barrel and outer rod."""
    end, rho, C_M = min(c.barrel_length, L), c.rho_s, c.C_M
    return added_inertia(0.0, end, c.grown.barrel, rho, C_M) + added_inertia(end, L, c.rod_diameter, rho, C_M)


@kernel
def cylinder_water_torque(
    phi: float, w: float, L: float, v_x: float, v_y: float, a_x: float, a_y: float, c: object
) -> float:
    """Torque [N m] about the base hinge of drag and of the water's acceleration on barrel and outer rod."""
    u = v_y * cos(phi) - v_x * sin(phi)
    end = min(c.barrel_length, L)
    barrel = drag_torque(u, w, 0.0, end, c.grown.barrel, c.C_D, c)
    rod = drag_torque(u, w, end, L, c.rod_diameter, c.C_D, c)
    inertia = inertia_per_length(c.grown.barrel, c.rho_s, c.C_M) * end**2 / 2.0
    inertia += inertia_per_length(c.rod_diameter, c.rho_s, c.C_M) * (L**2 - end**2) / 2.0
    return barrel + rod + inertia * (a_y * cos(phi) - a_x * sin(phi))


@kernel
def report(
    theta: float, omega: float, alpha: float, t: float, F_h: float, c: object, motion: object, out: object
) -> None:
    """Write x_h, v_h, theta, omega, M_hd, M_hd_cylinder, M_g, M_F, v_oc and the strip loads (from place 11 on)."""
    L, dL, _, phi, dphi, ddphi = linkage(theta, c.rod_eye_radius, c.base_x, c.base_y)
    v, _ = current(t, c)
    v_x, v_y, a_x, a_y = water(t, motion, c)
    length, turn = c.beam_length, motion[PITCH_RATE]
    u, a_n = v_y * cos(theta) - v_x * sin(theta), a_y * cos(theta) - a_x * sin(theta)
    spin = alpha + motion[PITCH_ACC]
    torque = beam_torque(u, omega + turn, c)
    torque += beam_water(1, 0.0, length, c) * a_n - beam_water(2, 0.0, length, c) * spin
    phi_acceleration = dphi * alpha + ddphi * omega * omega + motion[PITCH_ACC]
    u_x, u_y = v_x + turn * c.base_y, v_y - turn * c.base_x
    on_cylinder = cylinder_water_torque(phi, dphi * omega + turn, L, u_x, u_y, a_x, a_y, c)
    out[0] = L - c.start.length
    out[1] = dL * omega
    out[2] = theta
    out[3] = omega
    out[4] = torque
    out[5] = on_cylinder - cylinder_added_inertia(L, c) * phi_acceleration
    out[6] = (c.effect.buoyancy_error.force * 0.5 * length - c.weight.moment) * cos(theta + motion[PITCH])
    out[7] = F_h * dL
    out[8] = v
    strips = len(out) - 11
    for i in range(strips):
        l1 = length * i / strips
        l2 = length * (i + 1) / strips
        force, _ = beam_drag(u, omega + turn, l1, l2, c)
        out[11 + i] = force + beam_water(0, l1, l2, c) * a_n - beam_water(1, l1, l2, c) * spin
