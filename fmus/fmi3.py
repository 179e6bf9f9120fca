"""FMI 3.0: the project's base class over pythonfmu3's Fmi3Slave."""

from __future__ import annotations

from typing import Any

import numpy as np
from pythonfmu3 import Fmi3Slave
from pythonfmu3.enums import Fmi3Status

from .description3 import model_description
from .instance import Instance


class Slave(Instance, Fmi3Slave):
    """An FMU of FMI 3.0. The independent variable, time, comes after those of the table."""

    statuses = Fmi3Status
    describe = staticmethod(model_description)
    fresh = False
    """Whether no step has been taken: pythonfmu3 does not hand on the start time, so that of the first step counts."""

    def exit_initialization_mode(self) -> None:
        super().exit_initialization_mode()
        self.fresh = True

    def do_step(self, current_time: float, step_size: float) -> bool:
        if self.fresh and np.isfinite(current_time):
            self.time, self.fresh = current_time, False
        return super().do_step(current_time, step_size)

    def _present(self) -> dict[str, Any]:
        return {**super()._present(), "fresh": self.fresh}

    def _restore(self, state: dict[str, Any]) -> None:
        super()._restore(state)
        self.fresh = state["fresh"]

    def get_float64(self, vrs: list[int]) -> list[float]:
        time = len(self.table)
        if time not in vrs:
            return self.read(vrs)
        own = iter(self.read([i for i in vrs if i != time]))
        return [self.time if i == time else next(own) for i in vrs]

    def set_float64(self, vrs: list[int], values: list[float]) -> None:
        self.write(vrs, values)

    def get_int32(self, vrs: list[int]) -> list[int]:
        return self.get_integer(vrs)

    def set_int32(self, vrs: list[int], values: list[int]) -> None:
        self.set_integer(vrs, values)
