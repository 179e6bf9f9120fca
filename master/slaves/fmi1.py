"""FMI 1.0 for co-simulation: no initialisation mode, no states to restore, booleans of one byte."""

from __future__ import annotations

from .base import FORMS_1, Form, Log, address_of
from .library import LibrarySlave


class Slave1(LibrarySlave):
    """An FMU of FMI 1.0."""

    forms = FORMS_1
    version = "1.0"

    def load(self, log: Log) -> None:
        super().load(log)
        for name, v in self.variables.items():  # FMI 1.0 has no start values of its own accord for what is not set
            if v.causality == "input" and v.start not in (None, ""):
                self.set_start(name, self.start(name))

    def _instantiate(self, log: Log) -> None:
        from fmpy import fmi1

        callbacks = self._callbacks(fmi1, "fmi1", log)
        callbacks.stepFinished = None
        self._make(fmi1.FMU1Slave, self.description.guid)
        self._fmu.instantiate(functions=callbacks, loggingOn=True)

    def enter_initialisation(self, start: float, stop: float) -> None:
        self._times = start, stop
        self._state = "initialising"

    def exit_initialisation(self) -> None:
        start, stop = self._times
        self.call(self._fmu.initialize, tStart=start, stopTime=stop, doing="fmiInitializeSlave")
        self._state = "running"

    def _address(self, name: str) -> int:
        return address_of(getattr(self._fmu.dll, f"{self.description.coSimulation.modelIdentifier}_{name}"))

    def exchange_address(self, verb: str, form: Form) -> int:
        return self._address(f"fmi{verb}{form.verb}")

    def step_address(self) -> int:
        return self._address("fmiDoStep")
