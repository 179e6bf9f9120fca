"""FMI 1.0 for co-simulation: no initialisation mode, no states to restore, booleans of one byte."""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from typing import Any

from ...core.errors import PackageError, SimulationError
from .base import FORMS_1, STATUS, Form, Log, Signal, Slave, address_of


class Slave1(Slave):
    """An FMU of FMI 1.0."""

    forms = FORMS_1
    version = "1.0"

    def load(self, log: Log) -> None:
        from fmpy import calloc, free
        from fmpy.fmi1 import (
            FMU1Slave,
            fmi1CallbackAllocateMemoryTYPE,
            fmi1CallbackFreeMemoryTYPE,
            fmi1CallbackFunctions,
            fmi1CallbackLoggerTYPE,
        )
        from fmpy.logging import addLoggerProxy

        def on_log(_component: Any, name: bytes, status: int, _category: bytes, message: bytes) -> None:
            if status > 0:
                text = (message or b"").decode("utf-8", "replace").strip()
                shown = STATUS[status] if status < len(STATUS) else str(status)
                log((name or b"").decode("utf-8", "replace") or self.name, shown, text)

        callbacks = fmi1CallbackFunctions()
        callbacks.logger = fmi1CallbackLoggerTYPE(on_log)
        callbacks.allocateMemory = fmi1CallbackAllocateMemoryTYPE(calloc)
        callbacks.freeMemory = fmi1CallbackFreeMemoryTYPE(free)
        callbacks.stepFinished = None
        addLoggerProxy(ctypes.byref(callbacks))
        try:
            self._fmu = FMU1Slave(
                guid=self.description.guid,
                unzipDirectory=str(self.folder),
                modelIdentifier=self.description.coSimulation.modelIdentifier,
                instanceName=self.name,
            )
            self._fmu.instantiate(functions=callbacks, loggingOn=True)
        except Exception as error:
            reason = self.messages[-1][1] if self.messages else " ".join(str(error).split())
            raise PackageError(f"component '{self.name}' cannot be instantiated: {reason}") from None
        self._keep += [callbacks, on_log]
        self._state = "instantiated"
        for name, v in self.variables.items():  # FMI 1.0 has no start values of its own accord for what is not set
            if v.causality == "input" and v.start not in (None, ""):
                self.set_start(name, self.start(name))

    def set_start(self, name: str, value: Any) -> None:
        verb = self.forms[self.variables[name].type].verb
        reference = [self.variables[name].valueReference]
        self.call(getattr(self._fmu, f"set{verb}"), reference, [value], doing=f"setting '{name}'")

    def get(self, name: str) -> Any:
        verb = self.forms[self.variables[name].type].verb
        reference = [self.variables[name].valueReference]
        return self.call(getattr(self._fmu, f"get{verb}"), reference, doing=f"reading '{name}'")[0]

    def enter_initialisation(self, start: float, stop: float) -> None:
        self._times = start, stop
        self._state = "initialising"

    def exit_initialisation(self) -> None:
        start, stop = self._times
        self.call(self._fmu.initialize, tStart=start, stopTime=stop, doing="fmiInitializeSlave")
        self._state = "running"

    def reset(self) -> None:
        from fmpy.fmi1 import FMICallException

        try:
            self.call(self._fmu.fmi1ResetSlave, self._fmu.component, doing="fmiResetSlave")
        except FMICallException as error:  # pragma: no cover
            raise SimulationError(str(error)) from None
        self.messages.clear()
        self._state = "instantiated"

    def free(self) -> None:
        if self._state in ("new", "lost", "freed"):
            return
        for function in ([self._fmu.terminate] if self._state == "running" else []) + [self._fmu.freeInstance]:
            try:
                function()
            except Exception:
                continue
        self._state = "freed"

    def _address(self, name: str) -> int:
        return address_of(getattr(self._fmu.dll, f"{self.description.coSimulation.modelIdentifier}_{name}"))

    def exchange_address(self, verb: str, form: Form) -> int:
        return self._address(f"fmi{verb}{form.verb}")

    def step_address(self) -> int:
        return self._address("fmiDoStep")

    @property
    def instance(self) -> int:
        component = self._fmu.component
        return int(getattr(component, "value", component))

    def exchange_texts(self, verb: str, signals: Sequence[Signal], texts: list[Any]) -> None:
        references = [s.reference for s in signals]
        if verb == "Set":
            self.call(self._fmu.setString, references, [texts[s.place] for s in signals], doing="setting the inputs")
            return
        values = self.call(self._fmu.getString, references, doing="reading the outputs")
        for s, value in zip(signals, values, strict=True):
            texts[s.place] = value.decode("utf-8", "replace") if isinstance(value, bytes) else value
