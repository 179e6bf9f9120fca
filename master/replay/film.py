"""Frames of a model: where its joints and bodies stand, how long its stretched geoms are, which colours it has."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import mujoco
import numpy as np

ARRAYS = ("qpos", "mocap_pos", "mocap_quat", "stretched", "place", "turn", "half", "coloured", "rgba")


def _none(*shape: int) -> np.ndarray:
    return np.empty(shape)


@dataclass(frozen=True)
class Eye:
    """A camera: what it looks at (3,) and from how far [m], azimuth and elevation [deg]; its opening is the model's."""

    lookat: tuple[float, float, float]
    distance: float
    azimuth: float
    elevation: float


@dataclass(frozen=True)
class Film:
    """n frames of a model. Joints (n, nq); mocap bodies (n, m, 3) and (n, m, 4); numbers of the stretched geoms (k,),
    their places (n, k, 3), orientations (n, k, 9) and half lengths (n, k) [m]; numbers of the coloured geoms (c,) and
    their colours (n, c, 4)."""

    model: mujoco.MjModel
    qpos: np.ndarray
    mocap_pos: np.ndarray = field(default_factory=lambda: _none(0, 0, 3))
    mocap_quat: np.ndarray = field(default_factory=lambda: _none(0, 0, 4))
    stretched: np.ndarray = field(default_factory=lambda: np.empty(0, int))
    place: np.ndarray = field(default_factory=lambda: _none(0, 0, 3))
    turn: np.ndarray = field(default_factory=lambda: _none(0, 0, 9))
    half: np.ndarray = field(default_factory=lambda: _none(0, 0))
    coloured: np.ndarray = field(default_factory=lambda: np.empty(0, int))
    rgba: np.ndarray = field(default_factory=lambda: _none(0, 0, 4))

    def __len__(self) -> int:
        return len(self.qpos)

    def pose(self, data: mujoco.MjData, k: int) -> None:
        """Bring model and data to frame k."""
        model = self.model
        data.qpos[:] = self.qpos[k]
        if model.nmocap:
            data.mocap_pos[:], data.mocap_quat[:] = self.mocap_pos[k], self.mocap_quat[k]
        if len(self.coloured):
            model.geom_rgba[self.coloured] = self.rgba[k]
        settle(model, data)
        if len(self.stretched):
            model.geom_size[self.stretched, 1] = self.half[k]
            data.geom_xpos[self.stretched], data.geom_xmat[self.stretched] = self.place[k], self.turn[k]


def settle(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    """Place all that is drawn for the joints as they are; no forces, so no constraint acts."""
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    mujoco.mj_camlight(model, data)
    mujoco.mj_tendon(model, data)


def save(film: Film, folder: Path) -> None:
    """Write a film for another process of this machine."""
    mujoco.mj_saveModel(film.model, str(folder / "model.mjb"), None)
    np.savez(folder / "film.npz", **{name: getattr(film, name) for name in ARRAYS})


def load(folder: Path) -> Film:
    """The film that `save` wrote."""
    model = mujoco.MjModel.from_binary_path(str(folder / "model.mjb"))
    with np.load(folder / "film.npz") as arrays:
        return Film(model, **{name: arrays[name] for name in ARRAYS})
