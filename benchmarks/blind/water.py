"""Linkage, arm and sea water of the plant (Eqs. 28-31 and Lagrange's equation of the closed linkage). SI units."""

from __future__ import annotations

import numpy as np

from .compiled import kernel


@kernel
def linkage(c, theta: float) -> tuple[float, float, float, float, float, float]:
    """Cylinder length L (m) and direction phi (rad), and their first and second derivatives by theta."""
    r = c.eye_radius
    cos, sin = np.cos(theta), np.sin(theta)
    along = r * (c.base_x * cos + c.base_y * sin)
    across = r * (c.base_x * sin - c.base_y * cos)
    length = np.hypot(r * cos - c.base_x, r * sin - c.base_y)
    phi = np.arctan2(r * sin - c.base_y, r * cos - c.base_x)
    length1 = across / length
    length2 = (along - length1 * length1) / length
    phi1 = (r * r - along) / (length * length)
    phi2 = length1 / length * (1.0 - 2.0 * phi1)
    return length, length1, length2, phi, phi1, phi2


@kernel
def drag_integral(u: float, w: float, l1: float, l2: float) -> float:
    """Integral of r |r| l dl from l1 to l2 with r = u - w l (m5/s2); r may change sign on the way."""
    a, b, d = 0.5 * u * u, -2.0 / 3.0 * u * w, 0.25 * w * w
    f1 = l1 * l1 * (a + l1 * (b + l1 * d))
    f2 = l2 * l2 * (a + l2 * (b + l2 * d))
    r1, r2 = u - w * l1, u - w * l2
    if r1 * r2 >= 0.0:
        return (f2 - f1) * (1.0 if r1 + r2 > 0.0 else -1.0)
    l0 = u / w
    f0 = l0 * l0 * (a + l0 * (b + l0 * d))
    return (2.0 * f0 - f1 - f2) * (1.0 if r1 > 0.0 else -1.0)


@kernel
def current_at(c, t: float) -> tuple[float, float]:
    """Velocity (m/s) and acceleration (m/s2) of the sea along +x: steady, and a swing with a second harmonic."""
    v = c.current + c.current_offset
    if c.swing_amplitude == 0.0:
        return v, 0.0
    w = 2.0 * np.pi * c.swing_frequency
    angle = w * t + c.swing_phase
    a = c.swing_amplitude
    h = c.swing_harmonic
    v += a * (np.sin(angle) + h * np.sin(2.0 * angle + 0.7))
    return v, a * w * (np.cos(angle) + 2.0 * h * np.cos(2.0 * angle + 0.7))


@kernel
def arm(c, theta: float, omega: float, v_sea: float, a_sea: float, load_weight: float) -> tuple[float, float]:
    """Inertia (kg m2) and torque without the cylinder force (N m) of the arm, both reduced to theta.

    inertia * theta'' = torque + F_h * dL/dtheta: rigid bodies, weight, buoyancy and Morison's strips, Eqs. 28-31 with
    the relative velocity in the drag. `load_weight` (N) sits at the beam's end.
    """
    length, length1, length2, phi, phi1, phi2 = linkage(c, theta)
    g, outer = c.gravity, c.rod_diameter
    load_mass = load_weight / g

    # Moments of inertia of the beam with its load about the pivot and of the cylinder about its base hinge
    beam = c.beam_mass * (c.beam_diameter**2 / 16.0 + c.beam_length**2 / 3.0) + load_mass * c.beam_length**2
    barrel = c.barrel_mass * (c.barrel_diameter**2 / 16.0 + c.barrel_length**2 / 3.0)
    rod_centre, piston_centre = length - 0.5 * c.rod_length, length - c.rod_length
    rod = c.rod_mass * (outer**2 / 16.0 + c.rod_length**2 / 12.0 + rod_centre**2)
    swing = barrel + rod + c.piston_mass * piston_centre**2
    swing_by_length = 2.0 * (c.rod_mass * rod_centre + c.piston_mass * piston_centre)
    sliding = c.rod_mass + c.piston_mass

    inertia = beam + swing * phi1**2 + sliding * length1**2
    half_slope = swing * phi1 * phi2 + 0.5 * swing_by_length * length1 * phi1**2 + sliding * length1 * length2
    torque = -half_slope * omega**2

    # Weight and buoyancy (growth is neutrally buoyant): about the pivot, about the base hinge, along the cylinder
    beam_area, barrel_area = np.pi * c.beam_diameter**2 / 4.0, np.pi * c.barrel_diameter**2 / 4.0
    rod_area = np.pi * outer**2 / 4.0
    lever = 0.5 * c.beam_mass + load_mass - 0.5 * c.rho_sea * beam_area * c.beam_length
    torque -= g * np.cos(theta) * c.beam_length * lever
    moment = 0.5 * c.barrel_mass * c.barrel_length + c.rod_mass * rod_centre + c.piston_mass * piston_centre
    moment -= 0.5 * c.rho_sea * (barrel_area * c.barrel_length**2 + rod_area * (length**2 - c.barrel_length**2))
    torque -= g * (np.cos(phi) * moment * phi1 + sliding * np.sin(phi) * length1)
    if c.buoyancy != 0.0:  # a float or sinker of its own, which entrains half its displacement
        torque += c.buoyancy * 0.5 * c.beam_length * np.cos(theta)
        inertia += 0.5 * abs(c.buoyancy) / g * (0.5 * c.beam_length) ** 2

    # Drag
    k_drag = 0.5 * c.rho_sea * c.drag_factor
    u_beam, u_cyl, w_cyl = -v_sea * np.sin(theta), -v_sea * np.sin(phi), phi1 * omega
    torque += k_drag * c.beam_d * drag_integral(u_beam, omega, 0.0, c.beam_length)
    drag_cyl = c.barrel_d * drag_integral(u_cyl, w_cyl, 0.0, c.barrel_length)
    drag_cyl += outer * drag_integral(u_cyl, w_cyl, c.barrel_length, length)
    torque += k_drag * drag_cyl * phi1

    # Inertia of the water: theta'' for the beam, phi'' = phi1 theta'' + phi2 theta'^2 for the cylinder
    k_inertia = c.rho_sea * c.inertia_coefficient
    wet_beam, wet_barrel = np.pi * c.beam_d**2 / 4.0, np.pi * c.barrel_d**2 / 4.0
    water_beam = k_inertia * wet_beam * c.beam_length**3 / 3.0
    outside3, outside2 = length**3 - c.barrel_length**3, length**2 - c.barrel_length**2
    water_cyl = k_inertia * (wet_barrel * c.barrel_length**3 + rod_area * outside3) / 3.0
    inertia += water_beam + water_cyl * phi1**2
    torque -= water_cyl * phi1 * phi2 * omega**2
    torque -= k_inertia * wet_beam * 0.5 * c.beam_length**2 * a_sea * np.sin(theta)
    first_moment = 0.5 * (wet_barrel * c.barrel_length**2 + rod_area * outside2)
    torque -= k_inertia * first_moment * a_sea * np.sin(phi) * phi1
    return inertia, torque


@kernel
def beam_drag(c, theta: float, u: float, omega: float) -> float:
    """Drag on the beam over density/2 and `drag_factor` (m5/s2), u (m/s) across its middle, where not even along it.

    Growth and a wrong drag coefficient may be on the outer part only; an error of the current may grow along the beam.
    """
    length, inner = c.beam_length, c.outer_from * c.beam_length
    shear = -c.current_offset * c.current_shear * np.sin(theta)
    u, w = u - shear, omega - 2.0 * shear / length
    outer = c.beam_d * drag_integral(u, w, inner, length)
    return c.inner_drag * drag_integral(u, w, 0.0, inner) + outer


@kernel
def uneven_arm(c, theta: float, omega: float, v_sea: float, a_sea: float) -> tuple[float, float]:
    """What the inertia (kg m2) and the torque (N m) of `arm` have more where load, growth or current are not even."""
    inertia, torque = 0.0, 0.0
    if c.load_moved != c.load:
        inertia += (c.load_moved - c.load) / c.gravity * c.beam_length**2
    if c.outer_from > 0.0:  # no growth on the inner part
        inner = c.outer_from * c.beam_length
        bare = 0.25 * np.pi * (c.beam_diameter**2 - c.beam_d**2) * c.rho_sea * c.inertia_coefficient
        inertia += bare * inner**3 / 3.0
        torque -= bare * 0.5 * inner**2 * a_sea * np.sin(theta)
    if c.outer_from > 0.0 or c.current_shear != 0.0:
        u = -v_sea * np.sin(theta)
        even = c.beam_d * drag_integral(u, omega, 0.0, c.beam_length)
        torque += 0.5 * c.rho_sea * c.drag_factor * (beam_drag(c, theta, u, omega) - even)
    return inertia, torque


@kernel
def other_torque(c, t: float, theta: float, omega: float) -> float:
    """Torque (N m) on the beam of the effects: pivot friction, tether, blows on the load, vortices."""
    torque = 0.0
    if c.joint_friction != 0.0:
        turned = omega / 4e-3
        sign = -np.expm1(-turned) if omega >= 0.0 else np.expm1(turned)
        level = c.joint_friction
        if c.joint_uneven != 0.0:
            level *= 1.0 + c.joint_uneven * sign
        torque -= level * sign
    if c.tether != 0.0 and theta > c.tether_angle:
        torque -= c.tether * (theta - c.tether_angle) * c.beam_length**2
    if c.impact != 0.0 and t >= c.impact_start:
        since = (t - c.impact_start) % c.impact_period
        if since < c.impact_time:
            torque -= c.impact * c.beam_length * np.sin(np.pi * since / c.impact_time)
    if c.viv != 0.0:
        shed = c.viv_strouhal * abs(c.current) / c.beam_d
        torque += c.viv * (c.current / 0.5) ** 2 * np.sin(2.0 * np.pi * shed * t)
    return torque


@kernel
def base_torque(c, t: float, theta: float, omega: float, v_sea: float) -> float:
    """Torque (N m) on the beam of a base that heaves and pitches about the pivot, in the frame of the base.

    Dry masses feel the accelerations, gravity turns, and the water comes towards the arm, with its inertia. The
    cylinder and its rod, a tenth of the beam's moment, feel gravity's turn and the heave only.
    """
    w = 2.0 * np.pi * c.heave_frequency
    angle = w * t + c.heave_phase
    v_up, a_up = c.heave * w * np.cos(angle), -c.heave * w * w * np.sin(angle)
    pitch = c.heave * c.pitch_per_heave
    tilt, turn, turn_rate = pitch * np.sin(angle), pitch * w * np.cos(angle), -pitch * w * w * np.sin(angle)
    g, length = c.gravity, c.beam_length
    load_mass = c.load / g
    dry = (0.5 * c.beam_mass + load_mass) * length
    wet = dry - 0.125 * c.rho_sea * np.pi * c.beam_diameter**2 * length * length
    turned, upright = np.cos(theta + tilt), np.cos(theta)
    torque = -g * wet * (turned - upright) - dry * a_up * turned
    torque -= (c.beam_mass / 3.0 + load_mass) * length * length * turn_rate
    out, out1, _, phi, phi1, _ = linkage(c, theta)
    masses = 0.5 * c.barrel_mass * c.barrel_length + c.rod_mass * (out - 0.5 * c.rod_length)
    masses += c.piston_mass * (out - c.rod_length)
    normal = np.cos(phi + tilt) - np.cos(phi)
    along = np.sin(phi + tilt) - np.sin(phi)
    torque -= masses * phi1 * (g * normal + a_up * np.cos(phi + tilt))
    torque -= (c.rod_mass + c.piston_mass) * out1 * (g * along + a_up * np.sin(phi + tilt))
    # water: velocity and acceleration that it has in the frame of the base, across the beam
    u = -v_sea * np.sin(theta)
    u_seen = -v_sea * np.sin(theta + tilt) - v_up * turned
    k_drag = 0.5 * c.rho_sea * c.drag_factor * c.beam_d
    torque += k_drag * (drag_integral(u_seen, omega + turn, 0.0, length) - drag_integral(u, omega, 0.0, length))
    k_inertia = c.rho_sea * c.inertia_coefficient * 0.25 * np.pi * c.beam_d**2
    return torque - k_inertia * (0.5 * length * length * a_up * turned + length**3 / 3.0 * turn_rate)
