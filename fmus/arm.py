"""DeepseaArm: the arm in the water as an FMU."""

from __future__ import annotations

from typing import Any

from ..mechanics.arm import Arm
from ..mechanics.variables import ARM
from .slave import Slave


class DeepseaArm(Slave):
    """The cylinder force F_h is held during a step."""

    table = ARM

    def __init__(self, **kwargs: Any):
        super().__init__(**kwargs)
        self.description = "Arm moved by a hydraulic cylinder in sea water, on MuJoCo, with Morison loads"
        self._force = ARM.index("F_h")
        self.warned = False

    def build(self, parameters: dict[str, float]) -> None:
        self.arm = Arm(parameters, self.out, self.time)

    def advance(self, t: float, h: float) -> None:
        self.arm.step(t, h, self.values.item(self._force))
        if self.arm.turned_over and not self.warned:
            self.warned = True
            self.warn(
                f"the linkage passed its dead centre before t = {t + h:g} s: the beam now turns the other way, and x_h "
                "cannot grow beyond that point"
            )

    def outputs(self) -> None:
        self.arm.report(self.values.item(self._force))

    def get_model_state(self) -> dict[str, Any]:
        return {"arm": self.arm.get_state()}

    def set_model_state(self, state: dict[str, Any]) -> None:
        self.arm.set_state(state["arm"])
