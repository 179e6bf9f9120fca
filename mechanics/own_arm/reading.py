"""Reads a user's MJCF model and the table of its water: `Description`."""

from __future__ import annotations

import re
from collections.abc import Collection
from fnmatch import fnmatch
from math import sqrt
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from ...core.errors import PackageError, did_you_mean
from ...core.toml_tables import Tables
from .baking import bake
from .description import Description
from .overlay import Overlay, add_cylinders, held_joints, leave_out, read_overlay
from .water import Wet

BAR, BALL = (1.2, 2.0), (0.5, 1.5)
"""C_D and C_M of a geom of which the table says nothing: a long cylinder across the flow; a sphere below the drag
crisis, with the added mass of ideal flow (Newman, Marine Hydrodynamics, section 4)."""

LEFT_OUT = ("mesh", "hfield", "sdf", "plane")
"""Types of geoms that carry no loads of the water."""

KEYS = ("name", "C_D", "C_M", "diameter", "length", "lifted")
"""What a `[[geom]]` of the table may say."""


def read(
    path: Path, water: Path | None = None, dry: bool = False, name: str = "", pose: str = "",
    cylinders: Path | None = None,
) -> Description:  # fmt: skip
    """The arm of an MJCF file. Raises `PackageError` in one line for what it cannot be made of.

    water: a table of geoms with their coefficients; without it all geoms of moving bodies are in the water, unless the
    arm is dry. pose: the keyframe in which it starts. cylinders: a table as in `overlay`.
    """
    overlay = Overlay() if cylinders is None else read_overlay(cylinders)
    spec = _spec(path)
    _name(spec)
    whole = _compiled(path, spec)
    if whole.nv == 0:
        raise PackageError(f"{path}: has no joint, nothing moves")
    where = _where(path, whole, pose)
    leave_out(spec, overlay)
    tendons = add_cylinders(spec, overlay)
    _check(path, spec)
    for element in list(spec.keys):
        spec.delete(element)  # of another number of joints by now
    model = _compiled(path, spec)
    units = {int(mujoco.mjtJoint.mjJNT_HINGE): "rad", int(mujoco.mjtJoint.mjJNT_SLIDE): "m"}
    kinds = [(model.joint(j).name, int(kind)) for j, kind in enumerate(model.jnt_type)]
    held = held_joints(overlay, [joint for joint, _ in kinds])
    if len(held) == len(kinds):
        raise PackageError(f"{overlay.where or path}: no joint is left that moves")
    for tendon in tendons:
        if not _moved(model, tendon, held):
            raise PackageError(
                f"{overlay.where or path}: cylinder {tendon}: moves nothing, for no joint between its ends is free"
            )
    joints = tuple((joint, units[kind]) for joint, kind in kinds if kind in units and joint not in held)
    wet = () if dry else tuple(_wet(path, model, water))
    start = tuple(x for joint, _ in kinds for x in where[joint])
    title = re.sub(r"\W", "_", name or path.stem)
    if not title or title[0].isdigit():
        title = f"Arm_{title}"
    try:
        text = bake(spec, model)
    except (ValueError, RuntimeError) as error:
        raise PackageError(f"{path}: MuJoCo cannot write it: {_line(error)}") from None
    return Description(title, text, start, tendons, joints, wet, held)


def _spec(path: Path) -> Any:
    if not path.is_file():
        raise PackageError(f"{path}: no such file")
    warnings = list[str]()
    mujoco.set_mju_user_warning(warnings.append)  # which MuJoCo writes into a file of the current folder else
    try:
        spec = mujoco.MjSpec.from_file(str(path))
    except (ValueError, RuntimeError) as error:
        raise PackageError(f"{path}: is no MJCF model that MuJoCo reads: {_line(error)}") from None
    finally:
        mujoco.set_mju_user_warning(None)
    if (nan := next((text for text in warnings if "nan" in text.lower()), None)) is not None:
        raise PackageError(f"{path}: {_line(ValueError(nan))}")
    try:
        for elements in (spec.bodies, spec.joints, spec.geoms, spec.sites, spec.tendons, spec.equalities, spec.keys):
            _ = [element.name for element in elements]
    except UnicodeDecodeError:
        raise PackageError(f"{path}: a name in it is no UTF-8 text") from None
    spec.compiler.fusestatic = spec.compiler.alignfree = False  # bodies and their frames are those of the file
    return spec


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
            f"{path}: has no tendon; a cylinder is a named <spatial> tendon between a site on each of two bodies, "
            "which --cylinders TABLE.toml adds as well"
        )
    for k, tendon in enumerate(spec.tendons, 1):
        if not tendon.name:
            raise PackageError(f"{path}: tendon {k} has no name; a cylinder's variables are called after its tendon")
    if spec.equalities:
        names = ", ".join(e.name for e in spec.equalities)
        raise PackageError(
            f"{path}: has <equality> constraints ({names}), which are not followed: in the place of a cylinder's "
            "bodies and the loop that they close, a tendon is enough; without = [...] in --cylinders TABLE.toml leaves "
            "out those that do not matter"
        )


def _where(path: Path, model: mujoco.MjModel, pose: str) -> dict[str, tuple[float, ...]]:
    """Position of each joint at the start, by name: one number, four of a ball, seven of a free joint."""
    start = model.qpos0
    if pose:
        keys = [model.key(k).name for k in range(model.nkey)]
        if pose not in keys:
            raise PackageError(f"{path}: has no keyframe '{pose}'{did_you_mean(pose, keys)}")
        start = model.key(pose).qpos
    firsts = [*model.jnt_qposadr, model.nq]
    return {model.joint(j).name: tuple(start[firsts[j] : firsts[j + 1]].tolist()) for j in range(model.njnt)}


def _moved(model: mujoco.MjModel, tendon: str, held: Collection[str]) -> set[str]:
    """Names of the joints that are free and change a tendon's length: its own, and those between the bodies on its
    way."""
    first = model.tendon_adr[model.tendon(tendon).id]
    way = range(first, first + model.tendon_num[model.tendon(tendon).id])
    found: set[str] = set()
    chains: list[set[str]] = []
    for kind, place in ((model.wrap_type[k], model.wrap_objid[k]) for k in way):
        if kind == mujoco.mjtWrap.mjWRAP_JOINT:
            found.add(model.joint(place).name)
        elif kind != mujoco.mjtWrap.mjWRAP_PULLEY:
            body = (model.site_bodyid if kind == mujoco.mjtWrap.mjWRAP_SITE else model.geom_bodyid)[place]
            chains.append(set())
            while body != 0:
                own = range(model.body_jntadr[body], model.body_jntadr[body] + model.body_jntnum[body])
                chains[-1].update(model.joint(j).name for j in own)
                body = model.body_parentid[body]
    if chains:
        found |= set.union(*chains) - set.intersection(*chains)
    return found - set(held)


def _name(spec: Any) -> None:
    """Give joints, geoms and constraints without a name one."""
    for kind, elements in (("joint", spec.joints), ("geom", spec.geoms), ("equality", spec.equalities)):
        for k, element in enumerate(elements, 1):
            if not element.name:
                element.name = f"{kind}_{k}"


def _wet(path: Path, model: mujoco.MjModel, water: Path | None) -> list[Wet]:
    moving = [g for g in range(model.ngeom) if model.body_weldid[model.geom_bodyid[g]] != 0]
    names = [model.geom(g).name for g in moving]
    if water is None and not moving:
        return []
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
    C_D, C_M = BALL if ball else BAR
    return Wet(
        model.geom(g).name, ball, axis, float(entry.get("length", length)), float(entry.get("diameter", diameter)),
        float(entry.get("C_D", C_D)), float(entry.get("C_M", C_M)), bool(entry.get("lifted", True)),
    )  # fmt: skip


def _table(path: Path) -> list[dict[str, Any]]:
    tables = Tables(PackageError)
    data = tables.load(path)
    tables.reject_unknown_keys(data, ("geom",), str(path))
    entries = tables.tables(data, str(path), "geom")
    if not entries:
        raise PackageError(f"{path}: has no [[geom]]; --dry makes an arm without water")
    for k, entry in enumerate(entries, 1):
        where = f"{path}: geom {entry.get('name', k)}"
        tables.reject_unknown_keys(entry, KEYS, where)
        tables.get(entry, where, "name", str)
        tables.get(entry, where, "lifted", bool, True)
        for key in KEYS[1:5]:
            positive = key in KEYS[3:5]
            if tables.number(entry, where, key, 1.0) < 0.0 or (positive and entry.get(key) == 0):
                wanted = "has to be positive" if positive else "must not be negative"
                raise PackageError(f"{where}: '{key}' = {entry[key]} {wanted}")
        if tables.number(entry, where, "C_M", 1.0) < 1.0:
            raise PackageError(
                f"{where}: 'C_M' = {entry['C_M']} has to be 1 at least: the inertia coefficient is 1 plus that of the "
                "water that moves along"
            )
    return entries
