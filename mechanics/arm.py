"""The arm as a simulation: MuJoCo gives mass matrix, Coriolis and weight of the tree, `loads` the rest.

Integration is velocity Verlet (second order, one evaluation a step) with steps of at most `MAX_STEP`; the arm alone is
slow (its pendulum mode is below 1 Hz), the fast mode of the machine arises from the coupling.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from math import ceil, pi

import mujoco
import numpy as np

from ..core.errors import ParameterError
from ..core.sea import GRAVITY, ambient_pressure
from . import loads
from .effects import EFFECTS, effect_constants, with_effects
from .linkage import check_buildable, linkage
from .mjcf import mjcf
from .variables import BEAM_STRIPS

MAX_STEP = 4e-3
"""Longest internal step [s]."""

MOST_STEPS = 10_000_000
"""Most internal steps in one communication step."""


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

    The outputs are written into `out`, in the order of the variable table, after each step and by `report`.
    """

    def __init__(self, p: Mapping[str, float], out: np.ndarray | None = None, t: float = 0.0):
        check_buildable(p["theta0"], p["rod_eye_radius"], p["base_x"], p["base_y"])
        p = with_effects(p)
        self.model = compiled(mjcf(p))
        self.data = mujoco.MjData(self.model)
        self._M = np.zeros((3, 3))
        self._qpos, self._qvel = self.data.qpos, self.data.qvel
        self._bias, self._passive = self.data.qfrc_bias, self.data.qfrc_passive
        self._p = np.zeros(5)
        self.out = np.zeros(11 + BEAM_STRIPS) if out is None else out
        self.c = c = np.zeros(loads.SIZE)
        c[: len(EFFECTS)] = effect_constants(p)
        c[loads.R_EYE], c[loads.BASE_X], c[loads.BASE_Y] = p["rod_eye_radius"], p["base_x"], p["base_y"]
        c[loads.L_0] = linkage.py_func(p["theta0"], p["rod_eye_radius"], p["base_x"], p["base_y"])[0]
        grown = 2.0 * p["effect.marine_growth.thickness"]
        c[loads.BEAM_L], c[loads.BEAM_D] = p["beam_length"], p["beam_diameter"] + grown
        c[loads.BARREL_L], c[loads.BARREL_D] = p["barrel_length"], p["barrel_diameter"] + grown
        c[loads.ROD_D], c[loads.RHO], c[loads.C_M] = p["rod_diameter"], p["rho_s"], p["C_M"]
        c[loads.C_D], c[loads.PRINTED], c[loads.SPEED] = p["C_D"], p["drag_as_printed"], p["current_speed"]
        c[loads.AMPLITUDE], c[loads.FREQUENCY] = p["current_amplitude"], p["current_frequency"]
        net_beam = p["beam_mass"] - p["rho_s"] * pi * p["beam_diameter"] ** 2 / 4.0 * p["beam_length"]
        c[loads.WEIGHT_MOMENT] = (net_beam * GRAVITY / 2.0 + p["load_weight"]) * p["beam_length"]
        self.theta, self.omega, self.t = p["theta0"], 0.0, t
        self._evaluate(self.theta, self.omega, t)
        self.lever_0 = self._p.item(loads.LEVER)
        self.F_hold = -self._p[loads.TORQUE] / self._p[loads.LEVER]
        self.P_am = ambient_pressure(p["depth"]) * p["effect.ambient_pressure_error.scale"]
        self.out[9], self.out[10] = self.F_hold, self.P_am
        if not np.isfinite(self.F_hold):
            raise ParameterError("the arm's parameters give no finite holding force")

    def _evaluate(self, theta: float, omega: float, t: float) -> None:
        """Bring the projected equation of motion up to date for a state."""
        loads.place(theta, omega, self.c, self._qpos, self._qvel)
        mujoco.mj_fwdPosition(self.model, self.data)
        mujoco.mj_fwdVelocity(self.model, self.data)
        mujoco.mj_fullM(self.model, self.data, self._M)
        loads.project(theta, omega, t, self.c, self._M, self._bias, self._passive, self._p)

    def step(self, t_0: float, h: float, F_h: float) -> None:
        """Advance from t_0 by h [s] with the cylinder force F_h [N] held."""
        n = max(1, ceil(h / MAX_STEP * (1.0 - 1e-12)))
        if n > MOST_STEPS:
            raise ParameterError(f"communication step of {h:g} s: the arm takes at most {MOST_STEPS * MAX_STEP:g} s")
        dt = h / n
        theta, omega = self.theta, self.omega
        mass, torque, lever = self._p[0], self._p[1], self._p[2]
        alpha = (torque + lever * F_h) / mass
        for i in range(1, n + 1):
            theta += dt * (omega + 0.5 * dt * alpha)
            self._evaluate(theta, omega + dt * alpha, t_0 + i * dt)
            mass, torque, lever = self._p[0], self._p[1], self._p[2]
            alpha_end = (torque + lever * F_h) / mass
            omega += 0.5 * dt * (alpha + alpha_end)
            alpha = alpha_end
        self.theta, self.omega, self.t = float(theta), float(omega), t_0 + h
        loads.report(self.theta, self.omega, alpha, self.t, F_h, self.c, self.out)

    def report(self, F_h: float) -> None:
        """Write the outputs of the present state with the force F_h [N]."""
        alpha = (self._p[loads.TORQUE] + self._p[loads.LEVER] * F_h) / self._p[loads.MASS]
        loads.report(self.theta, self.omega, alpha, self.t, F_h, self.c, self.out)

    @property
    def turned_over(self) -> bool:
        """Whether the linkage has passed its dead centre: the lever has changed its sign since the start."""
        return self._p.item(loads.LEVER) * self.lever_0 < 0.0

    def get_state(self) -> list[float]:
        """Everything that a later `set_state` needs to go on bitwise the same."""
        return [self.theta, self.omega, self.t, *self._p.tolist()]

    def set_state(self, state: list[float]) -> None:
        """Restore what `get_state` gave."""
        self.theta, self.omega, self.t = state[:3]
        self._p[:] = state[3:]
