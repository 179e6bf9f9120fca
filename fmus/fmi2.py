"""FMI 2.0: the project's base class over pythonfmu's Fmi2Slave."""

from __future__ import annotations

from pythonfmu import Fmi2Slave
from pythonfmu.enums import Fmi2Status

from .description import model_description
from .instance import Instance


class Slave(Instance, Fmi2Slave):
    """An FMU of FMI 2.0; units, ranges, nominals and InitialUnknowns stand in its model description."""

    statuses = Fmi2Status
    describe = staticmethod(model_description)

    def get_real(self, vrs: list[int]) -> list[float]:
        return self.read(vrs)

    def set_real(self, vrs: list[int], values: list[float]) -> None:
        self.write(vrs, values)
