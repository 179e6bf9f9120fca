"""The numbers that the arm's kernels need, by name: every parameter of the variable table, and what follows from
them."""

from __future__ import annotations

from collections.abc import Mapping
from math import pi

import numpy as np

from ..core.jit import kernel
from ..core.records import record, row_of, size_of
from ..core.sea import GRAVITY
from .linkage import linkage
from .variables import ARM

DERIVED = (
    "start.length", "start.lever",
    "grown.beam", "grown.barrel", "plain.C_D",
    "weight.moment", "mass.load", "mass.moment", "barrel.moment", "barrel.net", "rod.mass", "rod.centre",
    "bending.mass", "bending.weight", "bending.stiffness", "bending.damping", "bending.rate",
    "switch.base_moves", "switch.drag_varies",
)  # fmt: skip
"""What `constants` works out."""

LOADS = record((*ARM.parameters({}), *DERIVED))
"""The record of all constants; those that effects change are there as changed."""

SIZE = size_of(LOADS)
"""How many numbers they are."""

SHORTEST_PERIOD = 5e-3
"""Shortest period [s] of a bending beam that is followed; a stiffer one is stiff."""

MODE = 33.0 / 140.0
"""Share of its mass with which a clamped beam takes part in the motion of its end (Rayleigh)."""


@kernel
def by_name(c: object) -> object:
    """The constants c (`SIZE`,) as a record."""
    return c.view(LOADS)[0]  # type: ignore[attr-defined]


def constants(p: Mapping[str, float], plain: Mapping[str, float]) -> np.ndarray:
    """The constants (`SIZE`,) of an arm with the parameters p, which its effects have changed from `plain` ones."""
    L = p["beam_length"]
    net_beam = p["beam_mass"] - p["rho_s"] * pi * p["beam_diameter"] ** 2 / 4.0 * L
    net_barrel = p["barrel_mass"] - p["rho_s"] * pi * p["barrel_diameter"] ** 2 / 4.0 * p["barrel_length"]
    load, reach = p["load_weight"] / GRAVITY, L + p["effect.payload_error.along"]
    grown = 2.0 * p["effect.marine_growth.thickness"]
    rod = p["rod_mass"] + p["piston_mass"]
    length, lever = linkage.py_func(p["theta0"], p["rod_eye_radius"], p["base_x"], p["base_y"])[:2]
    made = {
        "start.length": length, "start.lever": lever,
        "grown.beam": p["beam_diameter"] + grown, "grown.barrel": p["barrel_diameter"] + grown,
        "plain.C_D": plain["C_D"],
        "weight.moment": (net_beam * GRAVITY / 2.0 + p["load_weight"]) * L + p["load_weight"] * (reach - L),
        "mass.load": load, "mass.moment": p["beam_mass"] * L / 2.0 + load * reach,
        "barrel.moment": p["barrel_mass"] * p["barrel_length"] / 2.0,
        "barrel.net": net_barrel * p["barrel_length"] / 2.0,
        "rod.mass": rod, "rod.centre": -(p["rod_mass"] / 2.0 + p["piston_mass"]) * p["rod_length"] / rod,
        "switch.base_moves": float(p["effect.base_motion.heave"] > 0.0 or p["effect.base_motion.pitch"] > 0.0),
        "switch.drag_varies": float(
            p["effect.marine_growth.part"] < 1.0 or p["effect.drag_coefficient.part"] < 1.0
            or p["effect.current_error.shear"] != 0.0
        ),
    }  # fmt: skip
    return row_of(LOADS, {**p, **made, **_of_bending(p, net_beam, load, reach / L)})


def _of_bending(p: Mapping[str, float], net_beam: float, load: float, reach: float) -> dict[str, float]:
    """Mass [kg], weight in water [N], stiffness [N/m] and damping [N s/m] of the load on the bending beam, and the
    angular frequency [rad/s], 0 where the beam is stiff.

    reach: distance of the load from the pivot over that of the beam's end. All is referred to the end: a load further
    in has less inertia about the pivot, with the square of that, and a smaller moment.
    """
    period = p["effect.beam_flexibility.period"]
    rate = 2.0 * pi / period if period > SHORTEST_PERIOD else 0.0
    water = p["rho_s"] * p["C_M"] * pi * p["beam_diameter"] ** 2 / 4.0 * p["beam_length"]
    mass = load * reach**2 + MODE * (p["beam_mass"] + water)
    return {
        "bending.mass": mass, "bending.weight": GRAVITY * (load * reach + MODE * net_beam), "bending.rate": rate,
        "bending.stiffness": mass * rate**2,
        "bending.damping": 2.0 * p["effect.beam_flexibility.damping"] * mass * rate,
    }  # fmt: skip
