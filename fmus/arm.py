"""DeepseaArm: the arm in the water as an FMU."""

from __future__ import annotations

from typing import Any

from ..core.errors import ParameterError
from ..mechanics import stepping
from ..mechanics.arm import Arm
from ..mechanics.variables import ARM
from .slave import Slave


class DeepseaArm(Slave):
    """The cylinder force F_h is held during a step."""

    table = ARM
    step = staticmethod(stepping.advance)

    def __init__(self, **kwargs: Any):
        super().__init__(**kwargs)
        self.description = "Arm moved by a hydraulic cylinder in sea water, on MuJoCo, with Morison loads"
        self.arm: Arm | None = None
        self.warned = False

    def build(self, parameters: dict[str, float]) -> None:
        self.arm = Arm(parameters, self.values, self.time, self.arm)
        self.row = self.arm.row
        self.row[stepping.TURNED] = self.warned  # once in a life: masters that repeat steps would tell it each time

    def heed(self, code: int, t: float, h: float) -> bool:
        if code == stepping.TOO_LONG:
            raise ParameterError(stepping.too_long(h))
        self.warned = True
        self.warn(
            f"the linkage passed its dead centre before t = {t + h:g} s: the beam now turns the other way, and x_h "
            "cannot grow beyond that point"
        )
        return False

    def get_model_state(self) -> dict[str, Any]:
        return {"arm": self.arm.get_state()}

    def set_model_state(self, state: dict[str, Any]) -> None:
        self.arm.set_state(state["arm"])
