"""FMI 2.0 for co-simulation."""

from __future__ import annotations

from math import isfinite
from typing import Any

from ...core.errors import SimulationError
from ..engine import loop
from ..engine.loop import I32
from ..engine.values import INTEGER, REAL, TEXT, FmiType
from .base import address_of
from .library import LibraryInstance

TYPES = {
    "Real": FmiType("Real", REAL), "Integer": FmiType("Integer", INTEGER, I32),
    "Enumeration": FmiType("Integer", INTEGER, I32), "Boolean": FmiType("Boolean", INTEGER, I32),
    "String": FmiType("String", TEXT),
}  # fmt: skip


class Fmi2Instance(LibraryInstance):
    """An FMU of FMI 2.0."""

    types = TYPES
    version = "2.0"
    step_code = loop.STEP_2

    def _instantiate(self) -> None:
        from fmpy import fmi2

        callbacks = self._callbacks(fmi2, "fmi2")
        callbacks.componentEnvironment = self._number
        self._make(fmi2.FMU2Slave, self.description.guid)
        self._fmu.instantiate(callbacks=callbacks, loggingOn=True)

    def enter_initialisation(self, start: float, stop: float) -> None:
        told = stop if isfinite(stop) else None
        self.call(self._fmu.setupExperiment, doing="setupExperiment", startTime=start, stopTime=told)
        self.call(self._fmu.enterInitializationMode, doing="enterInitializationMode")
        self._state = "initialising"

    def exchange_address(self, verb: str, fmi_type: FmiType) -> int:
        return address_of(getattr(self._fmu.dll, f"fmi2{verb}{fmi_type.call_suffix}"))

    def step_address(self) -> int:
        return address_of(self._fmu.dll.fmi2DoStep)

    def ends_address(self) -> int:
        return address_of(self._fmu.dll.fmi2GetBooleanStatus)

    def last_successful_time(self) -> float | None:
        from fmpy.fmi2 import fmi2LastSuccessfulTime

        try:
            return float(self.call(self._fmu.getRealStatus, fmi2LastSuccessfulTime, doing="getRealStatus"))
        except SimulationError:
            return None

    def input_derivatives_address(self) -> int:
        return address_of(self._fmu.dll.fmi2SetRealInputDerivatives)

    def save(self) -> Any:
        return self.call(self._fmu.getFMUstate, doing="getFMUstate")

    def restore(self, state: Any) -> None:
        self.call(self._fmu.setFMUstate, state, doing="setFMUstate")
        if self.has_failed:
            self._state = "running"

    def drop(self, state: Any) -> None:
        self.call(self._fmu.freeFMUstate, state, doing="freeFMUstate")

    def serialise(self, state: Any) -> bytes:
        return bytes(self.call(self._fmu.serializeFMUstate, state, doing="serializeFMUstate"))

    def deserialise(self, content: bytes) -> Any:
        return self.call(self._fmu.deSerializeFMUstate, content, doing="deSerializeFMUstate")
