"""What whoever makes an arm of a model should know of it."""

from __future__ import annotations

import numpy as np

from .simulation import OwnArm


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
