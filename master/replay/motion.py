"""How a scene moves over a run: its joints by their formulas, then what aims and what stretches between its sites."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import mujoco
import numpy as np

from ...core.errors import PackageError, did_you_mean
from .film import Film
from .recorded import RecordedRun
from .scene import RULES, Scene, followed

SINGLE = int(mujoco.mjtJoint.mjJNT_SLIDE), int(mujoco.mjtJoint.mjJNT_HINGE)
STRETCHED = int(mujoco.mjtGeom.mjGEOM_CYLINDER), int(mujoco.mjtGeom.mjGEOM_CAPSULE)
PLANE = int(mujoco.mjtGeom.mjGEOM_PLANE)

SHORTEST = 1e-6
"""Least half length of what is stretched [m]; MuJoCo draws nothing of none."""


def names(model: mujoco.MjModel, kind: str) -> dict[str, int]:
    """Numbers of the model's joints, bodies, geoms or sites by name."""
    count = getattr(model, {"joint": "njnt", "body": "nbody", "geom": "ngeom", "site": "nsite"}[kind])
    return {getattr(model, kind)(k).name: k for k in range(count)}


class Motion:
    """A scene in a model, where its names begin with `prefix`, over the times of its run. Raises `PackageError` for a
    rule that names what the scene has not."""

    def __init__(self, model: mujoco.MjModel, scene: Scene, run: RecordedRun, prefix: str):
        self.model, self.run, self.scene, self.prefix = model, run, scene, prefix
        known = run.of(scene.component)
        self.joints = []
        for name, formula in scene.joints.items():
            joint = self.number("joint", name)
            if int(model.jnt_type[joint]) not in SINGLE:
                raise PackageError(f"{scene.where}{RULES}: joint '{name}' is no hinge or slide")
            x = followed(formula, known, run, scene.component, f"{scene.where}{RULES}: joint '{name}'")
            if x is None:
                raise PackageError(f"{scene.where}{RULES}: joint '{name}': '{formula}' does not exist")
            self.joints.append((int(model.jnt_qposadr[joint]), np.broadcast_to(x, run.times.shape)))
        self.aims = [
            (self._mocap(aim.body), self.number("site", aim.at), self.number("site", aim.towards)) for aim in scene.aims
        ]
        self.stretches = [
            (self._bar(s.geom), self.number("site", s.begin), self.number("site", s.end)) for s in scene.stretches
        ]

    def number(self, kind: str, name: str) -> int:
        """The number of a joint, body, geom or site of the scene by its name there."""
        known = names(self.model, kind)
        if self.prefix + name not in known:
            own = [n.removeprefix(self.prefix) for n in known if n.startswith(self.prefix) and n != self.prefix]
            hint = did_you_mean(name, own)
            raise PackageError(f"{self.scene.where}{RULES}: the scene has no {kind} '{name}'{hint}")
        return known[self.prefix + name]

    def _mocap(self, name: str) -> int:
        body = self.number("body", name)
        if (k := int(self.model.body_mocapid[body])) < 0:
            raise PackageError(f"{self.scene.where}{RULES}: body '{name}' aims, so it needs mocap=\"true\"")
        return k

    def _bar(self, name: str) -> int:
        geom = self.number("geom", name)
        if int(self.model.geom_type[geom]) not in STRETCHED or self.model.geom_bodyid[geom] != 0:
            raise PackageError(
                f"{self.scene.where}{RULES}: geom '{name}' stretches, so it has to be a cylinder or capsule of the "
                "worldbody"
            )
        return geom

    def film(self, times: np.ndarray) -> Film:
        """The frames at these times [s] of this scene alone."""
        return film(self.model, [self], times)


def film(model: mujoco.MjModel, motions: Sequence[Motion], times: np.ndarray) -> Film:
    """The frames of a model at times (n,) [s]; beyond the ends of a run it stands as there."""
    data = mujoco.MjData(model)
    n = len(times)
    qpos = np.tile(model.qpos0, (n, 1))
    for motion in motions:
        for at, x in motion.joints:
            qpos[:, at] = np.interp(times, motion.run.times, x)
    aims = [aim for motion in motions for aim in motion.aims]
    bars = [bar for motion in motions for bar in motion.stretches]
    mocap_pos, mocap_quat = np.tile(data.mocap_pos, (n, 1, 1)), np.tile(data.mocap_quat, (n, 1, 1))
    place, turn, half = np.empty((n, len(bars), 3)), np.empty((n, len(bars), 9)), np.empty((n, len(bars)))
    for k in range(n):
        data.qpos[:] = qpos[k]
        mujoco.mj_kinematics(model, data)
        for body, at, towards in aims:
            data.mocap_pos[body] = data.site_xpos[at]
            data.mocap_quat[body] = aimed(data.site_xpos[towards] - data.site_xpos[at])
            mujoco.mj_kinematics(model, data)  # the next may aim at what this one carries
        mocap_pos[k], mocap_quat[k] = data.mocap_pos, data.mocap_quat
        for j, (_, begin, end) in enumerate(bars):
            one, other = data.site_xpos[begin], data.site_xpos[end]
            place[k, j], half[k, j] = 0.5 * (one + other), max(0.5 * float(np.linalg.norm(other - one)), SHORTEST)
            mujoco.mju_quat2Mat(turn[k, j], along(other - one))
    stretched = np.array([geom for geom, _, _ in bars], dtype=int)
    return Film(model, qpos, mocap_pos, mocap_quat, stretched, place, turn, half)


def aimed(way: np.ndarray) -> np.ndarray:
    """The quaternion that turns the x axis along a vector, by the shortest turn."""
    return _turn(np.array([1.0, 0.0, 0.0]), way, np.array([0.0, 0.0, 0.0, 1.0]))


def along(way: np.ndarray) -> np.ndarray:
    """The quaternion that turns the z axis, which bars have, along a vector."""
    return _turn(np.array([0.0, 0.0, 1.0]), way, np.array([0.0, 1.0, 0.0, 0.0]))


def _turn(axis: np.ndarray, way: np.ndarray, back: np.ndarray) -> np.ndarray:
    length = float(np.linalg.norm(way))
    if length == 0.0:
        return np.array([1.0, 0.0, 0.0, 0.0])
    u = way / length
    quat = np.array([1.0 + axis @ u, *np.cross(axis, u)])
    size = float(np.linalg.norm(quat))
    return quat / size if size > 1e-9 else back


def extent(shot: Film, geoms: Iterable[int] | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Least and greatest coordinates (3,) of what a film shows, planes left out."""
    points = corners(shot, geoms).reshape(-1, 3)
    return points.min(axis=0), points.max(axis=0)


def corners(shot: Film, geoms: Iterable[int] | None = None) -> np.ndarray:
    """Corners (n, 8 g, 3) of the boxes around the geoms of a film in its frames, planes left out."""
    model = shot.model
    data = mujoco.MjData(model)
    shown = [g for g in (range(model.ngeom) if geoms is None else geoms) if model.geom_type[g] != PLANE]
    signs = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, -1).T
    middle, reach = model.geom_aabb[shown, :3].copy(), model.geom_aabb[shown, 3:].copy()
    found = np.empty((len(shot), len(shown) * 8, 3))
    for k in range(len(shot)):
        shot.pose(data, k)
        for geom, half in zip(shot.stretched, shot.half[k] if len(shot.stretched) else (), strict=True):
            if geom in shown:
                reach[shown.index(geom), 2] = half
        local = middle[:, None, :] + signs[None] * reach[:, None, :]
        turns = data.geom_xmat[shown].reshape(-1, 3, 3)
        found[k] = (np.einsum("gij,gcj->gci", turns, local) + data.geom_xpos[shown][:, None, :]).reshape(-1, 3)
    return found


def spines(shot: Film, frames: Sequence[int], count: int = 12) -> np.ndarray:
    """Points (n, count g, 3) along the longest axes of the geoms in some frames of a film, planes left out."""
    model = shot.model
    data = mujoco.MjData(model)
    shown = np.array([g for g in range(model.ngeom) if model.geom_type[g] != PLANE], dtype=int)
    reach = model.geom_aabb[shown, 3:].copy()
    longest = np.eye(3)[np.argmax(reach, axis=1)] * reach.max(axis=1)[:, None]
    local = model.geom_aabb[shown, :3][:, None, :] + np.linspace(-1, 1, count)[:, None] * longest[:, None, :]
    found = np.empty((len(frames), len(shown) * count, 3))
    for j, k in enumerate(frames):
        shot.pose(data, k)
        turns = data.geom_xmat[shown].reshape(-1, 3, 3)
        found[j] = (np.einsum("gij,gcj->gci", turns, local) + data.geom_xpos[shown][:, None, :]).reshape(-1, 3)
    return found


def places(shot: Film, kinds: Sequence[tuple[str, int]]) -> np.ndarray:
    """Where sites, geoms and bodies (kind, number) are in the frames of a film, (n, len(kinds), 3) [m]."""
    data = mujoco.MjData(shot.model)
    found = np.empty((len(shot), len(kinds), 3))
    for k in range(len(shot)):
        shot.pose(data, k)
        for j, (kind, number) in enumerate(kinds):
            found[k, j] = {"site": data.site_xpos, "geom": data.geom_xpos, "body": data.xpos}[kind][number]
    return found
