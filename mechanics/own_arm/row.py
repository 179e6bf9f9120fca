"""Where everything that the steps of a user's arm need stands in its row of numbers, which compiled code gets by one
address; how long a part is depends on the model."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...core.jit import kernel
from ...core.records import record, size_of

ADDRESSES = ("mj_model", "mj_data", "forward_position", "forward_velocity", "full_matrix", "integrate", "jacobian",
             "jacobian_rate", "qpos", "qvel", "qfrc_bias", "qfrc_passive", "ten_length", "ten_J", "geom_xpos",
             "geom_xmat")  # fmt: skip
"""Addresses of MuJoCo's model, data, functions and arrays; an address is less than 2^53, so a float64 holds it."""

SIZES = ("nq", "nv", "free", "tendons", "wet", "joints", "length")
"""Sizes of the model; how many degrees of freedom are not held, tendons with forces, geoms in the water and joints
whose motion is told; length of the row."""

NUMBERS = ("t", "longest", "rho", "rho_drag", "rho_inertia", "current", "P_am")
"""Time [s]; longest internal step [s]; density of the water, and that times what scales drag and inertia [kg/m3]; its
velocity along x [m/s]; ambient pressure [Pa]."""

PARTS = ("free_dof", "tendon", "joint", "geom", "force", "start", "F_hold", "acceleration", "load", "levers", "M",
         "factor", "right", "before", "Jp", "Jr", "Kp", "Kr")  # fmt: skip
"""Numbers of the free degrees of freedom (free,); tendons' numbers (tendons, 1 + 2 nv: itself, then for each degree of
freedom whether and where in ten_J); places of joints in qpos and qvel (joints, 2); the geoms (wet, WET); forces [N],
lengths at the start [m], holding forces [N] (tendons,); rates of qvel (nv,), generalised forces but the tendons' (nv,);
rates of the tendons' lengths (tendons, nv); mass matrix with the water (nv, nv) and the factor of its free part (free,
free); right side, then solution (free,); velocities (nv,); a geom's Jacobians and their rates (3, nv)."""

WET = 9
"""What is known of a geom: its number, its body's, axis (-1: a ball), length, diameter, C_D, mass of the water that it
displaces per density [m3] and with C_M, 1 if lifted."""

HEAD = record((*ADDRESSES, *SIZES, *NUMBERS, *(f"at_{part}" for part in PARTS)))
"""The record of the numbers that stand first; where the parts begin is among them."""

HEAD_SIZE = size_of(HEAD)
"""How many they are."""


@kernel
def head_of(row: object) -> object:
    """The numbers that stand first in a row, by name."""
    return row[:HEAD_SIZE].view(HEAD)[0]  # type: ignore[index]


@dataclass(frozen=True)
class Layout:
    """A row, its head by name, and views of its parts by name."""

    row: np.ndarray
    head: np.record
    parts: dict[str, np.ndarray]

    def set(self, names: Sequence[str], values: Sequence[float]) -> None:
        """Set numbers of the head."""
        for name, value in zip(names, values, strict=True):
            self.head[name] = value


def new_row(nq: int, nv: int, free: int, tendons: int, wet: int, joints: int) -> Layout:
    """A row of zeros for a model of these sizes."""
    shapes = {
        "free_dof": (free,), "tendon": (tendons, 1 + 2 * nv), "joint": (joints, 2), "geom": (wet, WET),
        "force": (tendons,), "start": (tendons,), "F_hold": (tendons,), "acceleration": (nv,), "load": (nv,),
        "levers": (tendons, nv), "M": (nv, nv), "factor": (free, free), "right": (free,), "before": (nv,),
        "Jp": (3, nv), "Jr": (3, nv), "Kp": (3, nv), "Kr": (3, nv),
    }  # fmt: skip
    begins, at = {}, HEAD_SIZE
    for part in PARTS:
        begins[part] = at
        at += int(np.prod(shapes[part]))
    row = np.zeros(at)
    parts = {p: row[begins[p] : begins[p] + int(np.prod(shapes[p]))].reshape(shapes[p]) for p in PARTS}
    made = Layout(row, head_of.py_func(row), parts)
    made.set(SIZES, (nq, nv, free, tendons, wet, joints, at))
    made.set([f"at_{part}" for part in PARTS], [begins[part] for part in PARTS])
    return made
