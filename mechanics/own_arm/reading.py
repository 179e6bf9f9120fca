"""Reads a user's MJCF model and the table of its water: `Description`."""

from __future__ import annotations

import re
from fnmatch import fnmatch
from math import sqrt
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from ...core.errors import PackageError, did_you_mean
from ...core.toml_tables import Tables
from .description import Description
from .water import Wet

C_D, C_M = 1.2, 2.0
"""Coefficients of a geom of which the table says nothing: those of the paper's arm."""

LEFT_OUT = ("mesh", "hfield", "sdf", "plane")
"""Types of geoms that carry no loads of the water."""

KEYS = ("name", "C_D", "C_M", "diameter", "length", "lifted")
"""What a `[[geom]]` of the table may say."""


def read(path: Path, water: Path | None = None, dry: bool = False, name: str = "", pose: str = "") -> Description:
    """The arm of an MJCF file. Raises `PackageError` in one line for what it cannot be made of.

    water: a table of geoms with their coefficients; without it all geoms of moving bodies are in the water, unless the
    arm is dry. pose: the keyframe in which it starts.
    """
    spec = _spec(path)
    _check(path, spec)
    model = _compiled(path, spec)
    if model.nv == 0:
        raise PackageError(f"{path}: has no joint, nothing moves")
    start = _pose(path, model, pose)
    _name(spec)
    model = _compiled(path, spec)
    wet = () if dry else tuple(_wet(path, model, water))
    units = {int(mujoco.mjtJoint.mjJNT_HINGE): "rad", int(mujoco.mjtJoint.mjJNT_SLIDE): "m"}
    kinds = [int(kind) for kind in model.jnt_type]
    joints = tuple((model.joint(j).name, units[kind]) for j, kind in enumerate(kinds) if kind in units)
    tendons = tuple(model.tendon(k).name for k in range(model.ntendon))
    _bake(spec, model)
    _compiled(path, spec)
    title = re.sub(r"\W", "_", name or path.stem)
    if not title or title[0].isdigit():
        title = f"Arm_{title}"
    return Description(title, spec.to_xml(), start, tendons, joints, wet)


def _spec(path: Path) -> Any:
    if not path.is_file():
        raise PackageError(f"{path}: no such file")
    try:
        return mujoco.MjSpec.from_file(str(path))
    except (ValueError, RuntimeError) as error:
        raise PackageError(f"{path}: is no MJCF model that MuJoCo reads: {_line(error)}") from None


def _compiled(path: Path, spec: Any) -> mujoco.MjModel:
    try:
        return spec.compile()
    except (ValueError, RuntimeError) as error:
        raise PackageError(f"{path}: MuJoCo cannot build it: {_line(error)}") from None


def _line(error: Exception) -> str:
    return " ".join(str(error).split())


def _check(path: Path, spec: Any) -> None:
    if not spec.tendons:
        raise PackageError(
            f"{path}: has no tendon; a cylinder is a named <spatial> tendon between a site on each of the two bodies"
        )
    for k, tendon in enumerate(spec.tendons, 1):
        if not tendon.name:
            raise PackageError(f"{path}: tendon {k} has no name; a cylinder's variables are called after its tendon")
    if spec.equalities:
        raise PackageError(
            f"{path}: has <equality> constraints, which are not followed: in the place of a cylinder's bodies and the "
            "loop that they close, a tendon is enough"
        )


def _pose(path: Path, model: mujoco.MjModel, pose: str) -> tuple[float, ...]:
    if not pose:
        return tuple(model.qpos0.tolist())
    keys = [model.key(k).name for k in range(model.nkey)]
    if pose not in keys:
        raise PackageError(f"{path}: has no keyframe '{pose}'{did_you_mean(pose, keys)}")
    return tuple(model.key(pose).qpos.tolist())


def _name(spec: Any) -> None:
    """Give joints and geoms without a name one."""
    for kind, elements in (("joint", spec.joints), ("geom", spec.geoms)):
        for k, element in enumerate(elements, 1):
            if not element.name:
                element.name = f"{kind}_{k}"


def _wet(path: Path, model: mujoco.MjModel, water: Path | None) -> list[Wet]:
    moving = [g for g in range(model.ngeom) if model.body_weldid[model.geom_bodyid[g]] != 0]
    names = [model.geom(g).name for g in moving]
    entries = [{"name": "*"}] if water is None else _table(water)
    made: dict[str, Wet] = {}
    for entry in entries:
        where = f"{water or path}: geom {entry['name']}"
        found = [g for g, n in zip(moving, names, strict=True) if fnmatch(n, entry["name"])]
        if not found:
            raise PackageError(f"{where}: no geom of a moving body is called so{did_you_mean(entry['name'], names)}")
        for g in found:
            kind = mujoco.mjtGeom(model.geom_type[g]).name.removeprefix("mjGEOM_").lower()
            if kind in LEFT_OUT:
                if entry["name"] == model.geom(g).name:
                    raise PackageError(f"{where}: is a {kind}; put a capsule, cylinder, box, ellipsoid or sphere there")
                continue
            made[model.geom(g).name] = _of(model, g, kind, entry)
    return list(made.values())


def _of(model: mujoco.MjModel, g: int, kind: str, entry: dict[str, Any]) -> Wet:
    """The bar or ball that has a geom's volume, with what the entry says otherwise."""
    size = model.geom_size[g]
    axis, ball = 2, kind == "sphere"
    if ball:
        length, diameter = 2.0 * size[0], 2.0 * size[0]
    elif kind in ("capsule", "cylinder"):
        length, diameter = 2.0 * size[1] + (4.0 / 3.0 * size[0] if kind == "capsule" else 0.0), 2.0 * size[0]
    else:
        axis = int(np.argmax(size))
        one, other = (size[k] for k in range(3) if k != axis)
        share = 2.0 / 3.0 if kind == "ellipsoid" else 1.0
        round_ = 1.0 if kind == "ellipsoid" else 4.0 / np.pi
        length, diameter = 2.0 * size[axis] * share, 2.0 * sqrt(one * other * round_)
    return Wet(
        model.geom(g).name, ball, axis, float(entry.get("length", length)), float(entry.get("diameter", diameter)),
        float(entry.get("C_D", C_D)), float(entry.get("C_M", C_M)), bool(entry.get("lifted", True)),
    )  # fmt: skip


def _table(path: Path) -> list[dict[str, Any]]:
    tables = Tables(PackageError)
    data = tables.load(path)
    tables.no_strangers(data, ("geom",), str(path))
    entries = tables.tables(data, str(path), "geom")
    if not entries:
        raise PackageError(f"{path}: has no [[geom]]; --dry makes an arm without water")
    for k, entry in enumerate(entries, 1):
        where = f"{path}: geom {entry.get('name', k)}"
        tables.no_strangers(entry, KEYS, where)
        tables.get(entry, where, "name", str)
        tables.get(entry, where, "lifted", bool, True)
        for key in KEYS[1:5]:
            if tables.number(entry, where, key, 1.0) < 0.0 or (key in KEYS[3:5] and entry.get(key) == 0):
                raise PackageError(f"{where}: '{key}' = {entry[key]} has to be positive")
    return entries


def _bake(spec: Any, model: mujoco.MjModel) -> None:
    """Leave nothing in the model that needs a file, or that is not followed; its masses stay."""
    for body in spec.bodies:
        if body.name == "world":
            continue
        own = model.body(body.name) if body.name else model.body(body.id)
        body.mass, body.explicitinertial = float(own.mass[0]), True
        body.ipos, body.iquat, body.inertia = own.ipos, own.iquat, own.inertia
        body.fullinertia = [np.nan] * 6
    for geom in list(spec.geoms):
        geom.material = ""
        if geom.type in (mujoco.mjtGeom.mjGEOM_MESH, mujoco.mjtGeom.mjGEOM_HFIELD, mujoco.mjtGeom.mjGEOM_SDF):
            spec.delete(geom)
    for elements in (spec.actuators, spec.sensors, spec.keys, spec.pairs, spec.excludes, spec.meshes, spec.hfields,
                     spec.materials, spec.textures, spec.skins, spec.cameras, spec.lights):  # fmt: skip
        for element in list(elements):
            spec.delete(element)
