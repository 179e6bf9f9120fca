"""The arm as a simulation: MuJoCo gives mass matrix, Coriolis and weight of the tree, `loads` the rest, `stepping`
moves it on."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache

import numpy as np

from ..core.errors import ParameterError
from ..core.sea import ambient_pressure
from . import loads, stepping
from .bending import sag
from .constants import by_name, constants
from .effects import with_effects
from .linkage import check_buildable
from .mjcf import mjcf
from .mujoco_library import addresses, mujoco
from .variables import ARM


@lru_cache(maxsize=8)
def compiled(text: str) -> mujoco.MjModel:
    """The model of an MJCF text without constraints; arms with the same parameters share it, and none changes it.

    An FMU is built several times before its run, and compiling takes longer than a hundred steps.
    """
    model = mujoco.MjModel.from_xml_string(text)
    disable = mujoco.mjtDisableBit
    model.opt.disableflags |= disable.mjDSBL_CONSTRAINT | disable.mjDSBL_CONTACT
    return model


class Arm:
    """State theta [rad], omega [rad/s] at time t [s], driven by the cylinder force F_h [N]; starts at rest at theta0.

    `values` are those of the variable table: the force is taken from there, and the outputs are written there after
    each step and by `report`. `row` holds the state, see `stepping`.
    """

    def __init__(
        self, p: Mapping[str, float], values: np.ndarray | None = None, t: float = 0.0, instead: Arm | None = None
    ):
        """instead: an arm that is not used any more; making MuJoCo's data anew takes most of the time."""
        check_buildable(p["theta0"], p["rod_eye_radius"], p["base_x"], p["base_y"])
        plain, p = p, with_effects(p)
        self.model = compiled(mjcf(p, scenery=False))
        if instead is not None and instead.model is self.model:
            self.data = instead.data
            mujoco.mj_resetData(self.model, self.data)
        else:
            self.data = mujoco.MjData(self.model)
        self.values = np.zeros(len(ARM)) if values is None else values
        self.out = self.values[stepping.FIRST : stepping.BEHIND]
        self.row = np.zeros(stepping.SIZE)
        self.row[: stepping.LEVER_0] = self._addresses()
        self.projection = self.row[stepping.PROJECTION : stepping.MATRIX]
        self.row[stepping.CONSTANTS :] = constants(p, plain)
        self.c = by_name.py_func(self.row[stepping.CONSTANTS :])
        self.at = (self.values.ctypes.data, len(self.values), self.row.ctypes.data, len(self.row))
        """Where values and row are, for `stepping.advance`."""
        self.row[stepping.THETA : stepping.PROJECTION] = 0.0
        self.row[stepping.THETA : stepping.HELD] = p["theta0"], 0.0, t, sag(p["theta0"], self.c), 0.0
        stepping.evaluate(self.row.ctypes.data, p["theta0"], 0.0, t, 0.0)
        self.row[stepping.LEVER_0] = self.projection[loads.LEVER]
        self.F_hold = -self.projection[loads.TORQUE] / self.projection[loads.LEVER]
        self.P_am = ambient_pressure(p["depth"]) * p["effect.ambient_pressure_error.scale"]
        self.out[9], self.out[10] = self.F_hold, self.P_am
        if not np.isfinite(self.F_hold):
            raise ParameterError("the arm's parameters give no finite holding force")

    def _addresses(self) -> Sequence[float]:
        """What stands first in the row; an address is less than 2^53, so a float64 holds it."""
        d = self.data
        arrays = (d.qpos, d.qvel, d.qfrc_bias, d.qfrc_passive)
        return [self.model._address, d._address, *addresses(), *(x.ctypes.data for x in arrays)]

    @property
    def theta(self) -> float:
        """Angle of the beam [rad]."""
        return self.row.item(stepping.THETA)

    @property
    def omega(self) -> float:
        """Its angular velocity [rad/s]."""
        return self.row.item(stepping.OMEGA)

    def step(self, t_0: float, h: float, F_h: float) -> None:
        """Advance from t_0 by h [s] with the cylinder force F_h [N] held."""
        self.values[stepping.FORCE] = F_h
        if stepping.advance(*self.at, t_0, h) == stepping.TOO_LONG:
            raise ParameterError(stepping.too_long(h))

    def report(self, F_h: float) -> None:
        """Write the outputs of the present state with the force F_h [N]."""
        self.values[stepping.FORCE] = F_h
        stepping.advance(*self.at, 0.0, 0.0)

    def get_state(self) -> list[float]:
        """Everything that a later `set_state` needs to go on bitwise the same."""
        state: list[float] = self.row[stepping.THETA : stepping.MATRIX].tolist()
        return state

    def set_state(self, state: list[float]) -> None:
        """Restore what `get_state` gave."""
        self.row[stepping.THETA : stepping.MATRIX] = state
        if np.any(self.row[stepping.GIVEN : stepping.MOTION]):  # a motion that goes on as it is tells of no change
            self.c.switch.base_moves = 1.0
