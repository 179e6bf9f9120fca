"""FMI 3.0 for co-simulation, without event mode and early return: the FMU handles its events in doStep."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, ClassVar

import numpy as np

from .base import FORMS_3, LIMITS, Form, Signal, address_of
from .library import LibrarySlave, text


class Slave3(LibrarySlave):
    """An FMU of FMI 3.0."""

    forms = FORMS_3
    version = "3.0"
    limits: ClassVar[dict[str, tuple[int, int]]] = {**LIMITS, "Enumeration": LIMITS["Int64"]}

    def _instantiate(self) -> None:
        from fmpy.fmi3 import FMU3Slave

        def on_log(_env: Any, status: int, _category: bytes, message: bytes) -> None:
            self.hear(status, message)

        self._keep.append(on_log)
        self._make(FMU3Slave, self.description.instantiationToken)
        self._fmu.instantiate(loggingOn=True, logMessage=on_log)
        if self._structural:
            self._configure()

    def configure(self, name: str, value: Any) -> None:
        """Give a structural parameter a value, before `load`: sizes of arrays follow it."""
        self._structural[name] = value

    def _configure(self) -> None:
        told = ", ".join(f"{name} = {value}" for name, value in self._structural.items())
        self.call(self._fmu.enterConfigurationMode, doing=f"configuration ({told})")
        for name, value in self._structural.items():
            verb = self.forms[self.variables[name].type].verb
            set_values, reference = getattr(self._fmu, f"set{verb}"), self.variables[name].valueReference
            self.call(set_values, [reference], [value], doing=f"setting the structural parameter {name} = {value}")
        self.call(self._fmu.exitConfigurationMode, doing=f"configuration ({told})")

    def get(self, name: str) -> Any:
        values = self._exchange("get", name, self.size(name), doing="reading")
        if self.variables[name].type == "Binary":
            values = [value or b"" for value in values]
        return tuple(values) if self.variables[name].dimensions else values[0]

    def enter_initialisation(self, start: float, stop: float) -> None:
        self.call(self._fmu.enterInitializationMode, doing="enterInitializationMode", startTime=start, stopTime=stop)
        self._state = "initialising"

    def reset(self) -> None:
        super().reset()
        if self._structural:
            self._configure()

    def exchange_address(self, verb: str, form: Form) -> int:
        return address_of(getattr(self._fmu.dll, f"fmi3{verb}{form.verb}"))

    def step_address(self) -> int:
        return address_of(self._fmu.dll.fmi3DoStep)

    def last_successful_time(self) -> float | None:
        return float(self.reached[0]) if np.isfinite(self.reached[0]) else None

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
                    texts[p] = text(value) if kind == "String" else value or b""

    def save(self) -> Any:
        return self.call(self._fmu.getFMUState, doing="getFMUState")

    def restore(self, state: Any) -> None:
        self.call(self._fmu.setFMUState, state, doing="setFMUState")
        if self.has_failed:
            self._state = "running"

    def drop(self, state: Any) -> None:
        self.call(self._fmu.freeFMUState, state, doing="freeFMUState")
