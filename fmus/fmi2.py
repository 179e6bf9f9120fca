"""FMI 2.0: the project's base class over pythonfmu's Fmi2Slave."""

from __future__ import annotations

from typing import Any

from pythonfmu import Fmi2Slave
from pythonfmu.enums import Fmi2Status

from .description import model_description
from .instance import Instance


class Slave(Instance, Fmi2Slave):
    """An FMU of FMI 2.0; units, ranges, nominals and InitialUnknowns stand in its model description."""

    statuses = Fmi2Status

    def to_xml(self, model_options: dict[str, str] | None = None) -> Any:
        """The complete model description, from the variable table."""
        return model_description(
            self.modelName, self.table, str(self.guid), self.description or "", {**(model_options or {})}
        )

    def get_real(self, vrs: list[int]) -> list[float]:
        return self.read(vrs)

    def set_real(self, vrs: list[int], values: list[float]) -> None:
        self.write(vrs, values)
