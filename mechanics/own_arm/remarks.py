"""What whoever makes an arm of a model should know of it."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path

import mujoco
import numpy as np

from .simulation import OwnArm

TILTED = 0.01
"""Share of gravity across the z axis from which it counts as turned."""


SHORTEST = 1e-6
"""Length [m] below which a tendon between two places has no direction."""


def without_direction(it: OwnArm) -> tuple[str, ...]:
    """Names of the tendons whose ends are in one place in the present pose, so that their force has no direction."""
    m = it.model
    spatial = [m.wrap_type[m.tendon_adr[m.tendon(name).id]] != mujoco.mjtWrap.mjWRAP_JOINT for name in it.d.tendons]
    return tuple(name for name, between, length in zip(it.d.tendons, spatial, it.lengths, strict=True)
                 if between and length < SHORTEST)  # fmt: skip


def loose_joints(it: OwnArm) -> tuple[str, ...]:
    """Names of the joints that no tendon moves in the present pose and that are not held."""
    moved = np.abs(it.levers).max(axis=0) > 1e-9
    joints = sorted({int(it.model.dof_jntid[k]) for k in it.free if not moved[k]})
    return tuple(it.model.joint(j).name for j in joints)


def bare_bodies(it: OwnArm) -> tuple[str, ...]:
    """Names of the bodies that move, have a mass, and none of whose geoms is in the water."""
    m, free = it.model, set(it.free.tolist())
    wet = {int(m.geom_bodyid[m.geom(w.geom).id]) for w in it.d.wet}
    moves = [False]
    for b in range(1, m.nbody):
        own = range(m.body_dofadr[b], m.body_dofadr[b] + m.body_dofnum[b])
        moves.append(moves[m.body_parentid[b]] or not free.isdisjoint(own))
    found = [b for b in range(1, m.nbody) if moves[b] and m.body_mass[b] > 0.0 and b not in wet]
    return tuple(m.body(b).name or f"number {b}" for b in found)


def not_acted_on(path: Path, joints: Collection[str]) -> tuple[str, ...]:
    """What an MJCF file says of these joints, and of gravity, that an arm leaves out."""
    m = mujoco.MjModel.from_xml_path(str(path))
    mine = [j for j in range(m.njnt) if not m.joint(j).name or m.joint(j).name in joints]

    def called(found: Collection[int]) -> str:
        return ", ".join(m.joint(j).name or f"joint_{j + 1}" for j in sorted(found))

    limited = {j for j in mine if m.jnt_limited[j]}
    rubbing = {int(j) for j, loss in zip(m.dof_jntid, m.dof_frictionloss, strict=True) if loss > 0.0} & set(mine)
    told = [f"the limits of {called(limited)}"] if limited else []
    told += [f"the friction loss of {called(rubbing)}"] if rubbing else []
    x, y, z = m.opt.gravity
    if z >= 0.0 or np.hypot(x, y) > TILTED * -z:
        told.append(f"the model's gravity ({x:g}, {y:g}, {z:g}) m/s2, in whose place are 9.81 m/s2 along -z")
    return tuple(told)
