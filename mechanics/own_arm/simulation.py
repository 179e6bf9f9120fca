"""A user's arm as a simulation: MuJoCo's model and data, and the row of numbers from which `stepping` moves it on.

Constraints are off: closed loops are what tendons are for, contacts and joint limits are not acted on.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache

import numpy as np

from ...core.errors import ParameterError, SimulationError
from ...core.jit import called
from ...core.sea import GRAVITY, ambient_pressure
from ..mujoco_library import OF_ANY_MODEL, addresses, mujoco
from . import stepping
from .description import Description
from .row import ADDRESSES, Layout, new_row
from .variables import table_of

MAX_STEP = 1e-3
"""Longest internal step [s]."""

DAMPED, SPRUNG = 0.5, 0.2
"""Longest internal step as shares of the time constant of the quickest damper of the model, and of the inverse angular
frequency of its quickest spring."""


@lru_cache(maxsize=8)
def compiled(text: str) -> mujoco.MjModel:
    """The model of an MJCF text without constraints and motors, in the sea's gravity; arms of one text share it, and
    none changes it. An FMU is built several times before its run, and whenever a state is restored."""
    model = mujoco.MjModel.from_xml_string(text)
    disable = mujoco.mjtDisableBit
    model.opt.disableflags |= disable.mjDSBL_CONSTRAINT | disable.mjDSBL_CONTACT | disable.mjDSBL_ACTUATION
    model.opt.gravity[:] = 0.0, 0.0, -GRAVITY
    return model


class OwnArm:
    """State of a model with parameters by name; starts at rest in the model's first pose.

    `values` are those of the variable table: forces are taken from there, and the outputs are written there after each
    step. `row` holds the state beside MuJoCo's data, see `row.PARTS`.
    """

    def __init__(
        self, description: Description, p: Mapping[str, float], values: np.ndarray | None = None, t: float = 0.0
    ):
        self.d, self.p = description, p
        self.model = compiled(description.xml)
        self.data = mujoco.MjData(self.model)
        self.data.qpos[:] = description.pose
        self.values = np.zeros(len(table_of(description))) if values is None else values
        kept = {self.model.joint(name).id for name in description.held}
        self.free = np.array([k for k in range(self.model.nv) if self.model.dof_jntid[k] not in kept])
        self.layout = self._laid_out(t)
        self.row = self.layout.row
        parts = self.layout.parts
        self.force, self.acceleration, self.load = parts["force"], parts["acceleration"], parts["load"]
        self.levers, self.M = parts["levers"], parts["M"]
        self.at = (self.values.ctypes.data, len(self.values), self.row.ctypes.data, len(self.row))
        """Where values and row are, for `stepping.advance`."""
        self.settle()
        self.layout.head.longest = self._longest()
        self.start, self.F_hold = parts["start"], parts["F_hold"]
        self.start[:] = self.lengths
        self.F_hold[:], self.unheld = self._holding()

    def _laid_out(self, t: float) -> Layout:
        m, d, given, p = self.model, self.data, self.d, self.p
        made = new_row(m.nq, m.nv, len(self.free), len(given.tendons), len(given.wet), len(given.joints))
        arrays = (d.qpos, d.qvel, d.qfrc_bias, d.qfrc_passive, d.ten_length, d.ten_J, d.geom_xpos, d.geom_xmat)
        made.set(ADDRESSES, (m._address, d._address, *addresses(OF_ANY_MODEL), *(x.ctypes.data for x in arrays)))
        rho = p["rho_s"]
        head = made.head
        head.t, head.longest, head.P_am, head.current = t, MAX_STEP, ambient_pressure(p["depth"]), p["current_speed"]
        head.rho, head.rho_drag, head.rho_inertia = rho, rho * p["drag"], rho * p["inertia"]
        made.parts["free_dof"][:] = self.free
        for row, name in zip(made.parts["tendon"], given.tendons, strict=True):
            k = row[0] = m.tendon(name).id
            first = m.ten_J_rowadr[k]
            for place in range(first, first + m.ten_J_rownnz[k]):
                dof = m.ten_J_colind[place]
                row[1 + 2 * dof : 3 + 2 * dof] = 1.0, place
        for row, (name, _) in zip(made.parts["joint"], given.joints, strict=True):
            row[:] = m.joint(name).qposadr[0], m.joint(name).dofadr[0]
        for row, w in zip(made.parts["geom"], given.wet, strict=True):
            k = m.geom(w.geom).id
            lifted = w.volume if w.lifted else 0.0
            row[:] = (k, m.geom_bodyid[k], -1 if w.ball else w.axis, w.length, w.diameter, w.C_D, lifted,
                      w.moved, w.turning)  # fmt: skip
        return made

    @property
    def lengths(self) -> np.ndarray:
        """Lengths of the tendons [m]."""
        return np.array([self.data.ten_length[int(k)] for k in self.layout.parts["tendon"][:, 0]])

    @property
    def speeds(self) -> np.ndarray:
        """Their rates [m/s]."""
        return self.levers @ self.data.qvel

    @property
    def longest(self) -> float:
        """Longest internal step [s]."""
        return float(self.layout.head.longest)

    def settle(self) -> None:
        """Work everything out anew for positions, velocities and forces as they are."""
        called(stepping.settle)(*self.at, 0.0, 0.0)

    def _longest(self) -> float:
        """Longest internal step [s] with which the model's own dampers and springs stay calm."""
        m, free = self.model, self.free
        levers = np.zeros((m.ntendon, m.nv))
        for k in range(m.ntendon):
            at = slice(m.ten_J_rowadr[k], m.ten_J_rowadr[k] + m.ten_J_rownnz[k])
            levers[k, m.ten_J_colind[at]] = self.data.ten_J[at]
        springs = m.jnt_stiffness[m.dof_jntid]
        quickest = []
        for own, of_tendons in ((m.dof_damping, m.tendon_damping), (springs, m.tendon_stiffness)):
            matrix = np.diag(own) + levers.T @ np.diag(of_tendons) @ levers
            share = np.linalg.solve(self.M[np.ix_(free, free)], matrix[np.ix_(free, free)])
            quickest.append(float(np.abs(np.linalg.eigvals(share)).max()))
        damped = DAMPED / quickest[0] if quickest[0] > 0.0 else MAX_STEP
        sprung = SPRUNG / np.sqrt(quickest[1]) if quickest[1] > 0.0 else MAX_STEP
        return float(min(MAX_STEP, damped, sprung))

    def _holding(self) -> tuple[np.ndarray, float]:
        """Forces of the tendons [N] that hold the arm at rest, and the largest torque or force that they leave."""
        levers, load = self.levers[:, self.free], self.load[self.free]
        forces, *_ = np.linalg.lstsq(levers.T, -load, rcond=None)
        return forces, float(np.abs(levers.T @ forces + load).max())

    def step(self, t: float, h: float, force: np.ndarray) -> None:
        """Advance from t by h [s] with the tendons' forces [N] held."""
        self.values[: len(self.force)] = force
        self.heed(called(stepping.advance)(*self.at, t, h), t, h)

    def heed(self, code: int, t: float, h: float) -> None:
        """Raise for a code of a step from t over h [s]."""
        if code == stepping.TOO_LONG:
            most = stepping.MOST_STEPS * self.longest
            raise ParameterError(f"communication step of {h:g} s: the arm takes at most {most:g} s")
        if code == stepping.NOT_FINITE:
            raise SimulationError(f"the arm's motion is not finite at t = {t + h:g} s", t + h)

    def state(self) -> list[list[float]]:
        """Everything that a later `restore` needs to go on bitwise the same."""
        d, own = self.data, (self.force.tolist(), self.load.tolist())
        return [d.qpos.tolist(), d.qvel.tolist(), self.acceleration.tolist(), [float(self.layout.head.t)], *own]

    def restore(self, state: list[list[float]]) -> None:
        """Restore what `state` gave."""
        self.data.qpos[:], self.data.qvel[:] = state[0], state[1]
        self.layout.head.t, self.force[:] = state[3][0], state[4]
        self.settle()
        self.acceleration[:], self.load[:] = state[2], state[5]  # that of the velocity foretold
