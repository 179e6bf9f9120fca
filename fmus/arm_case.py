"""A user's arm in the cross-check: its Python class again, from what its FMU carries, and forces that move it."""

from __future__ import annotations

import ast
import io
import math
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

SHARE = 0.02
"""By how much of what holds the arm the forces swing."""


def arm_in(fmu: Path) -> tuple[Any, Callable[[float], dict[str, float]]] | None:
    """Class and inputs [N] by time [s] of an arm's FMU; None for another FMU."""
    data = _data(fmu)
    if not data or not data["tendons"]:
        return None
    from ..mechanics.own_arm.description import Description
    from ..mechanics.own_arm.simulation import OwnArm as Simulation
    from ..mechanics.own_arm.variables import table_of
    from .own_arm import OwnArm

    arm = Description.of(data)
    table = table_of(arm)
    hold = Simulation(arm, table.parameters({})).F_hold
    kind = type(arm.name, (OwnArm,), {"arm": arm, "table": table})

    def inputs(t: float) -> dict[str, float]:
        """By a sine the arm would drift."""
        swing = 1.0 + SHARE * math.cos(2.0 * math.pi * t)
        return {f"{name}.F": float(F) * swing for name, F in zip(arm.tendons, hold, strict=True)}

    return kind, inputs


def _data(fmu: Path) -> dict[str, Any]:
    """What `arm_model` of an FMU says; nothing where it has none."""
    try:
        with zipfile.ZipFile(fmu) as archive, zipfile.ZipFile(io.BytesIO(archive.read("resources/code.zip"))) as code:
            [name] = [name for name in code.namelist() if name.endswith("/fmus/arm_model.py")]
            found: dict[str, Any] = ast.literal_eval(code.read(name).decode().partition("DATA = ")[2])
            return found
    except (OSError, KeyError, ValueError, SyntaxError, zipfile.BadZipFile):
        return {}
