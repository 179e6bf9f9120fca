"""MuJoCo's own functions by address, for compiled code: its Python bindings take longer than what they call."""

from __future__ import annotations

import ctypes
from functools import cache
from pathlib import Path

from ..core.ending import starting_processes
from ..core.errors import SimulationError

with starting_processes():  # glfw, which comes with it, asks another Python for its version, which Ctrl-C would end
    import mujoco as mujoco

VERSION = "4.0."
"""How the version begins whose declarations are known; functions that are declared otherwise would crash."""

NAMES = ("mj_fwdPosition", "mj_fwdVelocity", "mj_fullM")
"""What the arm calls, the first two of model and data, the last of model, data and matrix."""

OF_ANY_MODEL = (*NAMES, "mj_integratePos", "mj_jac", "mj_jacDot")
"""What a user's arm calls: also of model, positions, velocities and a time; of model, data, two matrices, a place and a
body's number."""


@cache
def addresses(names: tuple[str, ...] = NAMES) -> tuple[int, ...]:
    """Of the functions of these names."""
    if not mujoco.__version__.startswith(VERSION):
        remedy = f'pip install "mujoco~={VERSION}0"'
        raise SimulationError(f"the arm calls MuJoCo {VERSION}x, and here is {mujoco.__version__}: {remedy}")
    folder = Path(mujoco.__file__).parent
    found = sorted(p for p in folder.iterdir() if p.name.startswith(("libmujoco.", "mujoco.dll")))
    if not found:
        raise SimulationError(f"the library of MuJoCo {mujoco.__version__} is not in {folder}; is it installed whole?")
    library = ctypes.CDLL(str(found[0]))
    # its Python package has MuJoCo ask the clock some ten times a step, for timers that nobody reads here: the
    # library on its own does not
    ctypes.c_void_p.in_dll(library, "mjcb_time").value = None
    made = [ctypes.cast(getattr(library, name), ctypes.c_void_p).value for name in names]
    return tuple(address or 0 for address in made)
