"""The equation of motion of a user's arm, and its steps by velocity Verlet.

(M + M_water) a = tendons' forces + water + weight and Coriolis + passive forces of the model. Constraints are off:
closed loops are what tendons are for, contacts and joint limits are not acted on.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import ceil

import mujoco
import numpy as np

from ...core.errors import ParameterError, SimulationError
from ...core.sea import GRAVITY, ambient_pressure
from .description import Description
from .water import added, carried, drag

MAX_STEP = 1e-3
"""Longest internal step [s]."""

DAMPED, SPRUNG = 0.5, 0.2
"""Longest internal step as shares of the time constant of the quickest damper of the model, and of the inverse angular
frequency of its quickest spring."""

MOST_STEPS = 10_000_000
"""Most internal steps in one communication step."""


class OwnArm:
    """State of a model with parameters by name; starts at rest in the model's first pose."""

    def __init__(self, description: Description, p: Mapping[str, float], t: float = 0.0):
        self.d, self.p, self.t = description, p, t
        self.model = mujoco.MjModel.from_xml_string(description.xml)
        disable = mujoco.mjtDisableBit
        self.model.opt.disableflags |= disable.mjDSBL_CONSTRAINT | disable.mjDSBL_CONTACT | disable.mjDSBL_ACTUATION
        self.model.opt.gravity[:] = 0.0, 0.0, -GRAVITY
        self.data = mujoco.MjData(self.model)
        self.data.qpos[:] = description.pose
        self.wet = [(w, self.model.geom(w.geom).id) for w in description.wet]
        self.tendons = [self.model.tendon(name).id for name in description.tendons]
        self.force = np.zeros(len(self.tendons))
        n = self.model.nv
        self._M, self._jac = np.zeros((n, n)), (np.zeros((3, n)), np.zeros((3, n)))
        kept = {self.model.joint(name).id for name in description.held}
        self.free = np.array([k for k in range(n) if self.model.dof_jntid[k] not in kept])
        self._look()
        self.longest = self._longest()
        self.start = self.lengths.copy()
        self.F_hold, self.unheld = self._holding()
        self.acceleration = self._accelerate()

    @property
    def lengths(self) -> np.ndarray:
        """Lengths of the tendons [m]."""
        return np.array([self.data.ten_length[k] for k in self.tendons])

    @property
    def speeds(self) -> np.ndarray:
        """Their rates [m/s]."""
        return self.levers @ self.data.qvel

    @property
    def P_am(self) -> float:
        """Ambient pressure [Pa]."""
        return ambient_pressure(self.p["depth"])

    def _look(self) -> None:
        """Bring masses, loads and levers up to date with position and velocity."""
        m, d, rho = self.model, self.data, self.p["rho_s"]
        mujoco.mj_fwdPosition(m, d)
        mujoco.mj_fwdVelocity(m, d)
        mujoco.mj_fullM(m, d, self._M)
        self.load = d.qfrc_passive - d.qfrc_bias
        self.levers = np.array([self._lever(k) for k in self.tendons]).reshape(-1, m.nv)
        if rho == 0.0 or not self.wet:
            return
        d.qacc[:] = 0.0
        mujoco.mj_rnePostConstraint(m, d)
        velocity, bias = np.zeros(6), np.zeros(6)
        current = np.array([self.p["current_speed"], 0.0, 0.0])
        linear, angular = self._jac
        kind = mujoco.mjtObj.mjOBJ_GEOM
        for wet, k in self.wet:
            axis = d.geom_xmat[k].reshape(3, 3)[:, wet.axis]
            mujoco.mj_objectVelocity(m, d, kind, k, velocity, 0)
            mujoco.mj_objectAcceleration(m, d, kind, k, bias, 0)
            bias[3:] += m.opt.gravity  # what MuJoCo gives is that of a free fall less gravity
            mujoco.mj_jacGeom(m, d, linear, angular, k)
            force, torque = drag(wet, axis, current - velocity[3:], velocity[:3], rho * self.p["drag"])
            one, other = carried(wet, axis, velocity, bias, rho * self.p["inertia"])
            force, torque = force + one, torque + other
            if wet.lifted:
                force = force + np.array([0.0, 0.0, rho * GRAVITY * wet.volume])
            self.load = self.load + linear.T @ force + angular.T @ torque
            mass, inertia = added(wet, axis, rho * self.p["inertia"])
            self._M += linear.T @ mass @ linear + angular.T @ inertia @ angular

    def _longest(self) -> float:
        """Longest internal step [s] with which the model's own dampers and springs stay calm."""
        m, free = self.model, self.free
        levers = np.array([self._lever(k) for k in range(m.ntendon)]).reshape(m.ntendon, m.nv)
        rest = np.zeros(m.nv)
        for j in range(m.njnt):
            rest[m.dof_jntid == j] = m.jnt_stiffness[j]
        quickest = []
        for own, of_tendons in ((m.dof_damping, m.tendon_damping), (rest, m.tendon_stiffness)):
            matrix = np.diag(own) + levers.T @ np.diag(of_tendons) @ levers
            share = np.linalg.solve(self._M[np.ix_(free, free)], matrix[np.ix_(free, free)])
            quickest.append(float(np.abs(np.linalg.eigvals(share)).max()))
        damped = DAMPED / quickest[0] if quickest[0] > 0.0 else MAX_STEP
        sprung = SPRUNG / np.sqrt(quickest[1]) if quickest[1] > 0.0 else MAX_STEP
        return float(min(MAX_STEP, damped, sprung))

    def _lever(self, k: int) -> np.ndarray:
        """How the length of tendon k [m] changes with each degree of freedom (nv,)."""
        m, row = self.model, np.zeros(self.model.nv)
        first, count = m.ten_J_rowadr[k], m.ten_J_rownnz[k]
        row[m.ten_J_colind[first : first + count]] = self.data.ten_J[first : first + count]
        return row

    @property
    def loose(self) -> tuple[str, ...]:
        """Names of the joints that no tendon moves in the present pose and that are not held."""
        moved = np.abs(self.levers).max(axis=0) > 1e-9
        joints = sorted({int(self.model.dof_jntid[k]) for k in self.free if not moved[k]})
        return tuple(self.model.joint(j).name for j in joints)

    def _holding(self) -> tuple[np.ndarray, float]:
        """Forces of the tendons [N] that hold the arm at rest, and the largest torque or force that they leave."""
        levers, load = self.levers[:, self.free], self.load[self.free]
        forces, *_ = np.linalg.lstsq(levers.T, -load, rcond=None)
        return forces, float(np.abs(levers.T @ forces + load).max())

    def _accelerate(self) -> np.ndarray:
        free, found = self.free, np.zeros(self.model.nv)
        found[free] = np.linalg.solve(self._M[np.ix_(free, free)], (self.load + self.levers.T @ self.force)[free])
        return found

    def step(self, t: float, h: float, force: np.ndarray) -> None:
        """Advance from t by h [s] with the tendons' forces [N] held."""
        parts = h / self.longest * (1.0 - 1e-12)
        if not parts <= MOST_STEPS:
            most = MOST_STEPS * self.longest
            raise ParameterError(f"communication step of {h:g} s: the arm takes at most {most:g} s")
        n = max(1, ceil(parts))
        dt, d = h / n, self.data
        self.force = np.array(force)
        self.acceleration = self._accelerate()
        for _ in range(n):
            before, a = d.qvel.copy(), self.acceleration
            mujoco.mj_integratePos(self.model, d.qpos, before + 0.5 * dt * a, dt)
            d.qvel[:] = before + dt * a
            self._look()
            self.acceleration = self._accelerate()
            d.qvel[:] = before + 0.5 * dt * (a + self.acceleration)
        self.t = t + h
        if not (np.isfinite(d.qpos).all() and np.isfinite(d.qvel).all()):
            raise SimulationError(f"the arm's motion is not finite at t = {self.t:g} s", self.t)

    def state(self) -> list[list[float]]:
        """Everything that a later `restore` needs to go on bitwise the same."""
        d, own = self.data, (self.force.tolist(), self.load.tolist())
        return [d.qpos.tolist(), d.qvel.tolist(), self.acceleration.tolist(), [self.t], *own]

    def restore(self, state: list[list[float]]) -> None:
        """Restore what `state` gave."""
        self.data.qpos[:], self.data.qvel[:] = state[0], state[1]
        self.t, self.force = state[3][0], np.array(state[4])
        self._look()
        self.acceleration, self.load = np.array(state[2]), np.array(state[5])  # that of the velocity foretold
