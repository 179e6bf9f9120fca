"""FMI 3.0 for co-simulation, without event mode and early return: the FMU handles its events in doStep."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ...core.errors import PackageError
from .base import FORMS_3, STATUS, Form, Log, Signal, Slave, address_of


class Slave3(Slave):
    """An FMU of FMI 3.0."""

    forms = FORMS_3
    version = "3.0"

    def __init__(self, name: str, folder: Any, description: Any):
        super().__init__(name, folder, description)
        self._structural: dict[str, Any] = {}

    def load(self, log: Log) -> None:
        from fmpy.fmi3 import FMU3Slave

        def on_log(_env: Any, status: int, _category: bytes, message: bytes) -> None:
            if status > 0:
                text = (message or b"").decode("utf-8", "replace").strip()
                log(self.name, STATUS[status] if status < len(STATUS) else str(status), text)

        try:
            self._fmu = FMU3Slave(
                guid=self.description.instantiationToken,
                unzipDirectory=str(self.folder),
                modelIdentifier=self.description.coSimulation.modelIdentifier,
                instanceName=self.name,
            )
            self._fmu.instantiate(loggingOn=True, logMessage=on_log)
            if self._structural:
                self._configure()
        except Exception as error:
            reason = self.messages[-1][1] if self.messages else " ".join(str(error).split())
            raise PackageError(f"component '{self.name}' cannot be instantiated: {reason}") from None
        self._keep.append(on_log)
        self._state = "instantiated"

    def configure(self, name: str, value: Any) -> None:
        """Give a structural parameter a value, before `load`: sizes of arrays follow it."""
        self._structural[name] = value

    def _configure(self) -> None:
        self._fmu.enterConfigurationMode()
        for name, value in self._structural.items():
            verb = self.forms[self.variables[name].type].verb
            getattr(self._fmu, f"set{verb}")([self.variables[name].valueReference], [value])
        self._fmu.exitConfigurationMode()

    def set_start(self, name: str, value: Any) -> None:
        verb = self.forms[self.variables[name].type].verb
        values = list(value) if isinstance(value, tuple) else [value]
        reference = [self.variables[name].valueReference]
        self.call(getattr(self._fmu, f"set{verb}"), reference, values, doing=f"setting '{name}'")

    def get(self, name: str) -> Any:
        verb, size = self.forms[self.variables[name].type].verb, self.size(name)
        reference = [self.variables[name].valueReference]
        values = self.call(getattr(self._fmu, f"get{verb}"), reference, size, doing=f"reading '{name}'")
        return tuple(values) if self.variables[name].dimensions else values[0]

    def enter_initialisation(self, start: float, stop: float) -> None:
        self.call(self._fmu.enterInitializationMode, doing="enterInitializationMode", startTime=start, stopTime=stop)
        self._state = "initialising"

    def exit_initialisation(self) -> None:
        self.call(self._fmu.exitInitializationMode, doing="exitInitializationMode")
        self._state = "running"

    def reset(self) -> None:
        self.call(self._fmu.reset, doing="reset")
        self.messages.clear()
        self._state = "instantiated"
        if self._structural:
            self.call(self._configure, doing="configuration")

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
        return address_of(getattr(self._fmu.dll, f"fmi3{verb}{form.verb}"))

    def step_address(self) -> int:
        return address_of(self._fmu.dll.fmi3DoStep)

    @property
    def instance(self) -> int:
        component = self._fmu.component
        return int(getattr(component, "value", component))

    def exchange_texts(self, verb: str, signals: Sequence[Signal], texts: list[Any]) -> None:
        for kind in ("String", "Binary"):
            for s in (s for s in signals if s.type == kind):
                places = range(s.place, s.place + s.size)
                if verb == "Set":
                    function = getattr(self._fmu, f"set{kind}")
                    self.call(function, [s.reference], [texts[p] for p in places], doing="setting the inputs")
                    continue
                values = self.call(getattr(self._fmu, f"get{kind}"), [s.reference], s.size, doing="reading the outputs")
                for p, value in zip(places, values, strict=True):
                    text = kind == "String" and isinstance(value, bytes)
                    texts[p] = value.decode("utf-8", "replace") if text else value

    def save(self) -> Any:
        return self.call(self._fmu.getFMUState, doing="getFMUState")

    def restore(self, state: Any) -> None:
        self.call(self._fmu.setFMUState, state, doing="setFMUState")

    def drop(self, state: Any) -> None:
        self.call(self._fmu.freeFMUState, state, doing="freeFMUState")

    @property
    def can_restore(self) -> bool:
        return bool(self.description.coSimulation.canGetAndSetFMUstate)
