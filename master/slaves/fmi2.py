"""FMI 2.0 for co-simulation."""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from typing import Any

from ...core.errors import PackageError
from .base import FORMS_2, STATUS, Form, Log, Signal, Slave, address_of


class Slave2(Slave):
    """An FMU of FMI 2.0."""

    forms = FORMS_2
    version = "2.0"

    def load(self, log: Log) -> None:
        from fmpy import calloc, free
        from fmpy.fmi2 import (
            FMU2Slave,
            fmi2CallbackAllocateMemoryTYPE,
            fmi2CallbackFreeMemoryTYPE,
            fmi2CallbackFunctions,
            fmi2CallbackLoggerTYPE,
        )
        from fmpy.logging import addLoggerProxy

        def on_log(_env: Any, name: bytes, status: int, _category: bytes, message: bytes) -> None:
            if status > 0:
                text = (message or b"").decode("utf-8", "replace").strip()
                shown = STATUS[status] if status < len(STATUS) else str(status)
                # fmpy's formatting of messages knows one receiver per process: go by the name that is given
                log((name or b"").decode("utf-8", "replace") or self.name, shown, text)

        callbacks = fmi2CallbackFunctions()
        callbacks.logger = fmi2CallbackLoggerTYPE(on_log)
        callbacks.allocateMemory = fmi2CallbackAllocateMemoryTYPE(calloc)
        callbacks.freeMemory = fmi2CallbackFreeMemoryTYPE(free)
        addLoggerProxy(ctypes.byref(callbacks))
        try:
            self._fmu = FMU2Slave(
                guid=self.description.guid,
                unzipDirectory=str(self.folder),
                modelIdentifier=self.description.coSimulation.modelIdentifier,
                instanceName=self.name,
            )
            self._fmu.instantiate(callbacks=callbacks, loggingOn=True)
        except Exception as error:
            reason = self.messages[-1][1] if self.messages else " ".join(str(error).split())
            raise PackageError(f"component '{self.name}' cannot be instantiated: {reason}") from None
        self._keep += [callbacks, on_log]
        self._state = "instantiated"

    def set_start(self, name: str, value: Any) -> None:
        verb = self.forms[self.variables[name].type].verb
        reference = [self.variables[name].valueReference]
        self.call(getattr(self._fmu, f"set{verb}"), reference, [value], doing=f"setting '{name}'")

    def get(self, name: str) -> Any:
        verb = self.forms[self.variables[name].type].verb
        reference = [self.variables[name].valueReference]
        return self.call(getattr(self._fmu, f"get{verb}"), reference, doing=f"reading '{name}'")[0]

    def enter_initialisation(self, start: float, stop: float) -> None:
        self.call(self._fmu.setupExperiment, doing="setupExperiment", startTime=start, stopTime=stop)
        self.call(self._fmu.enterInitializationMode, doing="enterInitializationMode")
        self._state = "initialising"

    def exit_initialisation(self) -> None:
        self.call(self._fmu.exitInitializationMode, doing="exitInitializationMode")
        self._state = "running"

    def reset(self) -> None:
        self.call(self._fmu.reset, doing="reset")
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

    def exchange_address(self, verb: str, form: Form) -> int:
        return address_of(getattr(self._fmu.dll, f"fmi2{verb}{form.verb}"))

    def step_address(self) -> int:
        return address_of(self._fmu.dll.fmi2DoStep)

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

    def save(self) -> Any:
        return self.call(self._fmu.getFMUstate, doing="getFMUstate")

    def restore(self, state: Any) -> None:
        self.call(self._fmu.setFMUstate, state, doing="setFMUstate")

    def drop(self, state: Any) -> None:
        self.call(self._fmu.freeFMUstate, state, doing="freeFMUstate")
