"""One model of all scenes of a package: side by side in the picture, each in its own frame, on a sea floor, with light
and water."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from ...core.errors import PackageError
from .camera import axes
from .motion import Motion, extent
from .recorded import RecordedRun
from .scene import Scene

USUAL_VIEW = (78.0, -9.0)
"""Azimuth and elevation [deg] where no scene has its own: from the side, a little from above."""

APART = 0.15
"""Between two scenes, as a share of the wider one."""

BEHIND = 2e-3
"""How far a ghost stands behind what it is to be compared with, as a share of its size: where both are in one place,
the solid one is seen."""

GHOST = (0.62, 0.9, 1.0, 0.3)
"""Colour of a ghost."""

OPENING = 28.0
"""Of the camera, upwards [deg]: narrow, so that what is further away is not much smaller."""

WATER = """
<mujoco model="replay">
  <compiler angle="radian"/>
  <visual>
    <headlight ambient="0.32 0.34 0.36" diffuse="0.26 0.27 0.28" specular="0.1 0.1 0.1"/>
    <rgba haze="0.10 0.24 0.33 1" fog="0.10 0.24 0.33 1"/>
    <quality shadowsize="2048" offsamples="4"/>
  </visual>
  <asset>
    <texture name="replay water" type="skybox" builtin="gradient" rgb1="0.12 0.30 0.40" rgb2="0.02 0.06 0.11"
             width="256" height="256"/>
    <texture name="replay sand" type="2d" builtin="checker" rgb1="0.42 0.42 0.38" rgb2="0.37 0.37 0.34" width="256"
             height="256"/>
    <material name="replay sand" texture="replay sand" texuniform="true" texrepeat="2 2" specular="0" shininess="0"/>
  </asset>
</mujoco>
"""


@dataclass(frozen=True)
class Part:
    """A scene on the stage. Its names begin with `prefix`; `low` and `high` (3,) bound what it draws over its run."""

    prefix: str
    scene: Scene
    run: RecordedRun
    low: np.ndarray
    high: np.ndarray
    ghost: bool = False


@dataclass(frozen=True)
class Stage:
    """The model and its parts; of a ghost too."""

    model: mujoco.MjModel
    parts: tuple[Part, ...]
    view: tuple[float, float]
    """Azimuth and elevation [deg] from which it is meant to be seen."""


def build(scenes: Sequence[Scene], run: RecordedRun, ghosts: Sequence[tuple[Scene, RecordedRun]] = ()) -> Stage:
    """Set the scenes of a run side by side, and behind each its ghost. Raises `PackageError` for a scene that MuJoCo
    cannot build."""
    root = mujoco.MjSpec.from_string(WATER)
    parts: list[Part] = []
    view = next((s.view for s in scenes if s.view), USUAL_VIEW)
    across, edge = axes(*view)[0], 0.0
    for scene in scenes:
        behind = next(((g, of) for g, of in ghosts if g.component == scene.component), None)
        filled = scene.filled(run)
        low, high = bounds(filled, run)
        made = [(filled, run, low, high, "")]
        if behind is not None:
            ghost, other = behind[0].filled(behind[1]), behind[1]
            made.append((ghost, other, *bounds(ghost, other), "ghost "))
        sides = [c for m in made for c in _sides(m[2], m[3], across)]
        left, right = min(sides), max(sides)
        shift = edge + (APART * (right - left) if parts else 0.0) - left
        edge = shift + right
        for own, of, low, high, front in made:
            place = shift * across + (BEHIND * float(np.max(high - low)) * axes(*view)[2] if front else 0.0)
            prefix = f"{front}{own.component}/"
            spec = _spec(own)
            if front:
                _as_ghost(spec)
            root.attach(spec, prefix=prefix, frame=root.worldbody.add_frame(pos=place))
            parts.append(Part(prefix, own, of, low + place, high + place, bool(front)))
    _add_floor(root, parts)
    try:
        return Stage(root.compile(), tuple(parts), view)
    except ValueError as error:
        raise PackageError(f"MuJoCo cannot put the scenes together: {_line(error)}") from None


def _sides(low: np.ndarray, high: np.ndarray, across: np.ndarray) -> tuple[float, float]:
    """How far to the left and to the right of the picture a box reaches [m]."""
    middle, reach = 0.5 * (low + high) @ across, 0.5 * (high - low) @ np.abs(across)
    return float(middle - reach), float(middle + reach)


def bounds(scene: Scene, run: RecordedRun) -> tuple[np.ndarray, np.ndarray]:
    """Least and greatest coordinates (3,) of what a scene that is filled draws over its run."""
    spec = _spec(scene)
    try:
        model = spec.compile()
    except ValueError as error:
        raise PackageError(f"{scene.where}scene.xml: MuJoCo cannot build it: {_line(error)}") from None
    return extent(Motion(model, scene, run, "").film(np.linspace(run.times[0], run.times[-1], 60)))


def _spec(scene: Scene) -> mujoco.MjSpec:
    """The scene of a component as MuJoCo reads it, with no light of its own."""
    try:
        spec = mujoco.MjSpec.from_string(scene.xml, assets=dict(scene.files or {}))
    except (ValueError, RuntimeError) as error:
        raise PackageError(f"{scene.where}scene.xml: MuJoCo does not read it: {_line(error)}") from None
    for elements in (spec.lights, spec.cameras):
        for element in list(elements):
            spec.delete(element)
    return spec


def _as_ghost(spec: mujoco.MjSpec) -> None:
    for geom in spec.geoms:
        geom.rgba, geom.material = GHOST, ""


def _add_floor(root: mujoco.MjSpec, parts: Sequence[Part]) -> None:
    low, high = np.min([p.low for p in parts], axis=0), np.max([p.high for p in parts], axis=0)
    size, middle = float(np.max(high - low)), 0.5 * (low + high)
    root.worldbody.add_geom(
        name="replay floor", type=mujoco.mjtGeom.mjGEOM_PLANE, size=[0, 0, 0.25 * size], material="replay sand",
        pos=[middle[0], middle[1], low[2] - 1e-3 * size], contype=0, conaffinity=0,
    )  # fmt: skip
    root.worldbody.add_light(
        type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL, dir=[0.2, 0.45, -1.0],
        pos=middle + size * np.array([-0.3, -0.8, 2.0]), diffuse=[0.50, 0.54, 0.56],
        specular=[0.25, 0.25, 0.25], castshadow=True,
    )  # fmt: skip
    root.stat.extent, root.stat.center = size, middle
    root.visual.global_.fovy = OPENING
    root.visual.map.haze, root.visual.map.zfar, root.visual.map.znear = 0.45, 60.0, 0.02


def _line(error: Exception) -> str:
    return " ".join(str(error).split())
