"""The arm as an MJCF model, generated from the parameters.

Three joints: the beam's hinge, the barrel's hinge, the rod's slide along the barrel (its coordinate is the distance
from the base hinge to the rod's eye). The `connect` constraint closes the loop for viewers; the simulation closes it
exactly by projection (`loads`) and switches the constraint off, because a constraint solved by springs drifts by
millimetres.
Buoyancy of beam and barrel is MuJoCo's gravcomp. MuJoCo's z is our y.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import pi

from ..core.sea import GRAVITY

SKY = """<visual><global offwidth="1280" offheight="960"/></visual>
  <asset>
    <texture name="sky" type="skybox" builtin="gradient" rgb1="0.55 0.75 0.9" rgb2="0.05 0.15 0.3"
             width="64" height="64"/>
  </asset>"""


def _tube(mass: float, length: float, diameter: float, middle: float) -> str:
    """Inertial element of a homogeneous round bar along x with its middle at x = middle."""
    along = mass * diameter**2 / 8.0
    across = max(mass * (3.0 * (diameter / 2.0) ** 2 + length**2) / 12.0, 1e-9)
    return f'<inertial pos="{middle!r} 0 0" mass="{mass!r}" diaginertia="{along!r} {across!r} {across!r}"/>'


def _rod_and_piston(p: Mapping[str, float]) -> str:
    """Inertial element of both as one body along x, whose eye is at x = 0."""
    rod, piston, rod_L, rod_D = p["rod_mass"], p["piston_mass"], p["rod_length"], p["rod_diameter"]
    mass = rod + piston
    centre = -(rod * rod_L / 2.0 + piston * rod_L) / mass
    across = 1e-9 + (
        rod * (3.0 * (rod_D / 2.0) ** 2 + rod_L**2) / 12.0
        + rod * (centre + rod_L / 2.0) ** 2
        + piston * (centre + rod_L) ** 2
    )
    along = max(rod * rod_D**2 / 8.0, 1e-9)
    return f'<inertial pos="{centre!r} 0 0" mass="{mass!r}" diaginertia="{along!r} {across!r} {across!r}"/>'


def mjcf(p: Mapping[str, float], scenery: bool = True) -> str:
    """The MJCF text for the parameters of the variable table; without scenery, which takes time to compile and in each
    step, only what moves."""

    def seen(text: str) -> str:
        return text if scenery else ""

    p = {name: float(value) for name, value in p.items()}
    beam_L, beam_D = p["beam_length"], p["beam_diameter"]
    barrel_L, barrel_D = p["barrel_length"], p["barrel_diameter"]
    rod_L, rod_D = p["rod_length"], p["rod_diameter"]
    beam_lift = p["rho_s"] * pi * beam_D**2 / 4.0 * beam_L / p["beam_mass"]
    barrel_lift = p["rho_s"] * pi * barrel_D**2 / 4.0 * barrel_L / p["barrel_mass"]
    load = p["load_weight"] / GRAVITY
    return f"""<mujoco model="deepsea_arm">
  <compiler angle="radian" inertiafromgeom="false" balanceinertia="false"/>
  <option gravity="0 0 {-GRAVITY!r}" timestep="0.001"/>
  {seen(SKY)}
  <default><geom contype="0" conaffinity="0"/></default>
  <worldbody>
    {seen(f'<light pos="0 -3 4" dir="0 0.6 -0.8"/>'
          f'<camera name="side" pos="{beam_L / 2!r} {-3.2 * beam_L!r} {beam_L / 4!r}" xyaxes="1 0 0 0 0 1"/>'
          f'<geom name="pedestal" type="box" size="0.05 0.08 {abs(p["base_y"]) / 2 + 0.05!r}" '
          f'pos="0 0 {p["base_y"] / 2 - 0.06!r}" rgba="0.4 0.4 0.45 1"/>')}
    <body name="beam" gravcomp="{beam_lift!r}">
      <joint name="theta" type="hinge" axis="0 -1 0"/>
      {_tube(p["beam_mass"], beam_L, beam_D, beam_L / 2.0)}
      {seen(f'<geom name="beam" type="capsule" fromto="0 0 0 {beam_L!r} 0 0" size="{beam_D / 2!r}" '
            f'rgba="0.95 0.75 0.2 1"/>')}
      <site name="beam_eye" pos="{p["rod_eye_radius"]!r} 0 0"/>
      <body name="load" pos="{beam_L + p["effect.payload_error.along"]!r} 0 0">
        <inertial pos="0 0 0" mass="{max(load, 1e-9)!r}" diaginertia="1e-9 1e-9 1e-9"/>
        {seen(f'<geom name="load" type="sphere" size="{max(beam_D, 0.02)!r}" rgba="0.7 0.2 0.2 1"/>')}
      </body>
    </body>
    <body name="barrel" gravcomp="{barrel_lift!r}" pos="{p["base_x"]!r} 0 {p["base_y"]!r}">
      <joint name="phi" type="hinge" axis="0 -1 0"/>
      {_tube(p["barrel_mass"], barrel_L, barrel_D, barrel_L / 2.0)}
      {seen(f'<geom name="barrel" type="cylinder" fromto="0 0 0 {barrel_L!r} 0 0" size="{barrel_D / 2!r}" '
            f'rgba="0.3 0.35 0.4 1"/>')}
      <body name="rod">
        <joint name="length" type="slide" axis="1 0 0"/>
        {_rod_and_piston(p)}
        {seen(f'<geom name="rod" type="cylinder" fromto="{-rod_L!r} 0 0 0 0 0" size="{rod_D / 2!r}" '
              f'rgba="0.85 0.85 0.9 1"/>')}
        <site name="rod_eye" pos="0 0 0"/>
      </body>
    </body>
  </worldbody>
  <equality><connect name="eye" site1="rod_eye" site2="beam_eye"/></equality>
</mujoco>
"""
