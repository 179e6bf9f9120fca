"""A model as it goes into an FMU: one text that needs no file, with nothing in it that is not followed."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np

NEED_FILES = ("mjGEOM_MESH", "mjGEOM_HFIELD", "mjGEOM_SDF")
"""Types of geoms that go; their masses stay with their bodies."""


def bake(spec: Any, model: mujoco.MjModel) -> str:
    """The text of a model that was compiled as `model`; raises `ValueError` or `RuntimeError` of MuJoCo."""
    _keep_masses(spec, model)
    _keep_materials(spec)
    gone = [getattr(mujoco.mjtGeom, name) for name in NEED_FILES]
    for geom in list(spec.geoms):
        if geom.type in gone:
            spec.delete(geom)
    for elements in (spec.actuators, spec.sensors, spec.keys, spec.pairs, spec.excludes, spec.equalities, spec.meshes,
                     spec.hfields, spec.textures, spec.skins, spec.cameras, spec.lights, spec.tuples):  # fmt: skip
        for element in list(elements):
            spec.delete(element)
    spec.option.density = spec.option.viscosity = 0.0  # the water is that of the table
    spec.option.wind = np.zeros(3)
    spec.compile()
    text: str = spec.to_xml()
    mujoco.MjModel.from_xml_string(text)
    return text


def _keep_masses(spec: Any, model: mujoco.MjModel) -> None:
    """State every body's inertia, and let nothing work it out anew."""
    for body in spec.bodies:
        if body.name == "world":
            continue
        own = model.body(body.name) if body.name else model.body(body.id)
        body.mass, body.explicitinertial = float(own.mass[0]), True
        body.ipos, body.iquat, body.inertia = own.ipos, own.iquat, own.inertia
        body.fullinertia = [np.nan] * 6
    compiler = spec.compiler
    compiler.inertiafromgeom = mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_FALSE
    compiler.balanceinertia = False
    if compiler.settotalmass > 0.0:
        compiler.settotalmass = -1.0
    compiler.boundmass = compiler.boundinertia = 0.0
    compiler.discardvisual = False


def _keep_materials(spec: Any) -> None:
    """Materials stay, for defaults, sites and tendons name them; their pictures do not."""
    for material in spec.materials:
        material.textures = [""] * len(material.textures)
