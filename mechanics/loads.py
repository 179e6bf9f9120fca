"""Equation of motion of the closed linkage: MuJoCo's tree, projected on the beam's angle, with the water's loads.

With q = (theta, phi, L) and q' = G(theta) omega, MuJoCo's M q'' + bias = Q becomes

    (G^T M G) alpha = G^T (Q - bias - M dG/dtheta omega^2)

for the one degree of freedom that the loop leaves. The entrained water adds to M.
"""

from __future__ import annotations

from math import cos, pi, sin

from ..core.jit import kernel
from ..core.sea import GRAVITY
from .effects import AMPLITUDE_2, BUOY, EFFECTS, FREQUENCY_2, PHASE_2, extra_torque
from .hydrodynamics import added_inertia, drag, inertia_per_length, printed_torque, wave
from .linkage import linkage

(
    R_EYE, BASE_X, BASE_Y, L_0, BEAM_L, BEAM_D, BARREL_L, BARREL_D, ROD_D, RHO, C_D, C_M,
    SPEED, AMPLITUDE, FREQUENCY, WEIGHT_MOMENT, PRINTED, SIZE,
) = range(len(EFFECTS), len(EFFECTS) + 18)  # fmt: skip
"""Places of the constants, after those of the effects, and how many there are."""

MASS, TORQUE, LEVER, X, V = range(5)
"""Places in the result of `project`: effective inertia, torque without the cylinder, dL/dtheta, x_h, v_h."""


@kernel
def current(t: float, c: object) -> tuple[float, float]:
    """Velocity [m/s] and acceleration [m/s2] of the current: steady part and two sinusoidal ones."""
    v_1, a_1 = wave(t, c[AMPLITUDE], c[FREQUENCY], 0.0)
    v_2, a_2 = wave(t, c[AMPLITUDE_2], c[FREQUENCY_2], c[PHASE_2])
    return c[SPEED] + v_1 + v_2, a_1 + a_2


@kernel
def drag_torque(u: float, w: float, l1: float, l2: float, diameter: float, c: object) -> float:
    """Torque [N m] about the hinge of the drag between distances l1 and l2 [m] from it."""
    if c[PRINTED] > 0.0:
        return printed_torque(u, w, l1, l2, diameter, c[RHO], c[C_D])
    _, torque = drag(u, w, l1, l2, diameter, c[RHO], c[C_D])
    return torque


@kernel
def place(theta: float, omega: float, c: object, qpos: object, qvel: object) -> None:
    """Write the joint positions and velocities of the closed linkage."""
    L, dL, _, phi, dphi, _ = linkage(theta, c[R_EYE], c[BASE_X], c[BASE_Y])
    qpos[0] = theta
    qpos[1] = phi
    qpos[2] = L
    qvel[0] = omega
    qvel[1] = dphi * omega
    qvel[2] = dL * omega


@kernel
def project(
    theta: float, omega: float, t: float, c: object, M: object, bias: object, passive: object, out: object
) -> None:
    """Write MASS [kg m2], TORQUE [N m], LEVER [m], X [m], V [m/s]; alpha = (TORQUE + LEVER F_h)/MASS."""
    L, dL, ddL, phi, dphi, ddphi = linkage(theta, c[R_EYE], c[BASE_X], c[BASE_Y])
    v, a = current(t, c)
    # water on the beam, about the pivot
    beam = drag_torque(-v * sin(theta), omega, 0.0, c[BEAM_L], c[BEAM_D], c)
    beam += inertia_per_length(c[BEAM_D], c[RHO], c[C_M]) * -a * sin(theta) * c[BEAM_L] ** 2 / 2.0
    beam_inertia = added_inertia(0.0, c[BEAM_L], c[BEAM_D], c[RHO], c[C_M])
    # water on the cylinder, about the base hinge
    barrel_end = min(c[BARREL_L], L)
    cylinder = cylinder_water_torque(phi, dphi * omega, L, v, a, c)
    # buoyancy of the rod's part outside the barrel
    cylinder += c[RHO] * GRAVITY * pi * c[ROD_D] ** 2 / 4.0 * cos(phi) * (L**2 - barrel_end**2) / 2.0
    cylinder_inertia = cylinder_added_inertia(L, c)
    w2 = omega * omega
    m00 = M[0, 0] + beam_inertia
    m11 = M[1, 1] + cylinder_inertia
    out[MASS] = (
        m00 + m11 * dphi**2 + M[2, 2] * dL**2 + 2.0 * (M[0, 1] * dphi + M[0, 2] * dL + M[1, 2] * dphi * dL)
    )
    extra = extra_torque(theta, omega, c[BEAM_L], c)
    r0 = passive[0] - bias[0] + beam + extra - (M[0, 1] * ddphi + M[0, 2] * ddL) * w2
    r1 = passive[1] - bias[1] + cylinder - (m11 * ddphi + M[1, 2] * ddL) * w2
    r2 = passive[2] - bias[2] - (M[1, 2] * ddphi + M[2, 2] * ddL) * w2
    out[TORQUE] = r0 + dphi * r1 + dL * r2
    out[LEVER] = dL
    out[X] = L - c[L_0]
    out[V] = dL * omega


@kernel
def cylinder_added_inertia(L: float, c: object) -> float:
    """Moment of inertia [kg m2] about the base hinge of the water entrained by barrel and outer rod."""
    end = min(c[BARREL_L], L)
    return added_inertia(0.0, end, c[BARREL_D], c[RHO], c[C_M]) + added_inertia(end, L, c[ROD_D], c[RHO], c[C_M])


@kernel
def cylinder_water_torque(phi: float, w: float, L: float, v: float, a: float, c: object) -> float:
    """Torque [N m] about the base hinge of drag and of the current's acceleration on barrel and outer rod."""
    u = -v * sin(phi)
    end = min(c[BARREL_L], L)
    barrel = drag_torque(u, w, 0.0, end, c[BARREL_D], c)
    rod = drag_torque(u, w, end, L, c[ROD_D], c)
    inertia = inertia_per_length(c[BARREL_D], c[RHO], c[C_M]) * end**2 / 2.0
    inertia += inertia_per_length(c[ROD_D], c[RHO], c[C_M]) * (L**2 - end**2) / 2.0
    return barrel + rod - inertia * a * sin(phi)


@kernel
def report(theta: float, omega: float, alpha: float, t: float, F_h: float, c: object, out: object) -> None:
    """Write x_h, v_h, theta, omega, M_hd, M_hd_cylinder, M_g, M_F, v_oc and the strip loads (from place 11 on)."""
    L, dL, _, phi, dphi, ddphi = linkage(theta, c[R_EYE], c[BASE_X], c[BASE_Y])
    v, a = current(t, c)
    per_length = inertia_per_length(c[BEAM_D], c[RHO], c[C_M])
    u = -v * sin(theta)
    torque = drag_torque(u, omega, 0.0, c[BEAM_L], c[BEAM_D], c)
    torque += per_length * (-a * sin(theta) * c[BEAM_L] ** 2 / 2.0 - alpha * c[BEAM_L] ** 3 / 3.0)
    phi_acceleration = dphi * alpha + ddphi * omega * omega
    out[0] = L - c[L_0]
    out[1] = dL * omega
    out[2] = theta
    out[3] = omega
    out[4] = torque
    out[5] = cylinder_water_torque(phi, dphi * omega, L, v, a, c) - cylinder_added_inertia(L, c) * phi_acceleration
    out[6] = (c[BUOY] * 0.5 * c[BEAM_L] - c[WEIGHT_MOMENT]) * cos(theta)
    out[7] = F_h * dL
    out[8] = v
    strips = len(out) - 11
    for i in range(strips):
        l1 = c[BEAM_L] * i / strips
        l2 = c[BEAM_L] * (i + 1) / strips
        force, _ = drag(u, omega, l1, l2, c[BEAM_D], c[RHO], c[C_D])
        out[11 + i] = force + per_length * (-a * sin(theta) * (l2 - l1) - alpha * (l2**2 - l1**2) / 2.0)
