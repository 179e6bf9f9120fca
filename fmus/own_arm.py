"""An arm of the user's own as an FMU; the model is in `arm_model`, whose place in an FMU the build fills."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..mechanics.own_arm import stepping
from ..mechanics.own_arm.description import Description
from ..mechanics.own_arm.simulation import OwnArm as Simulation
from ..mechanics.own_arm.variables import table_of
from .arm_model import DATA
from .slave import Slave

UNHELD = 1e-3
"""Torque or force at rest [N m, N] that no tendon holds, beyond which a word is said."""


class OwnArm(Slave):
    """The forces of the cylinders are held during a step."""

    arm = Description.of(DATA)
    table = table_of(arm)
    step = staticmethod(stepping.advance)

    def __init__(self, **kwargs: Any):
        super().__init__(**kwargs)
        self.description = f"Arm {self.arm.name} on MuJoCo, moved by cylinders, in sea water"
        self.simulation: Simulation | None = None
        self.warned = False

    def build(self, parameters: dict[str, float]) -> None:
        self.simulation = Simulation(self.arm, parameters, self.values, self.time)
        self.row = self.simulation.row
        left = self.simulation.unheld
        if left > UNHELD * (1.0 + np.abs(self.simulation.load).max()) and not self.warned:
            self.warned = True
            self.warn(f"the cylinders do not hold the arm at rest: {left:.3g} N m (N) are left, and it will move")

    def heed(self, code: int, t: float, h: float) -> bool:
        self.simulation.heed(code, t, h)
        return False

    def get_model_state(self) -> dict[str, Any]:
        return {"arm": self.simulation.state()}

    def set_model_state(self, state: dict[str, Any]) -> None:
        self.simulation.restore(state["arm"])


def __getattr__(name: str) -> Any:
    """The class by the arm's own name, after which the FMU is called."""
    if name == OwnArm.arm.name:
        return type(name, (OwnArm,), {"__module__": __name__, "__doc__": OwnArm.__doc__})
    raise AttributeError(name)
