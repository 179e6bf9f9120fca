"""FMI 3.0 for co-simulation, without event mode and early return: the FMU handles its events in doStep."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite
from typing import Any, ClassVar

import numpy as np

from ..engine import loop
from ..engine.loop import F32, I8, I16, I32, U8, U16, U32
from ..engine.program import Program
from ..engine.values import INTEGER, LIMITS, REAL, TEXT, FmiType, Signal
from .base import address_of
from .library import LibraryInstance, text

TYPES = {
    "Float64": FmiType("Float64", REAL), "Float32": FmiType("Float32", REAL, F32),
    "Int8": FmiType("Int8", INTEGER, I8), "UInt8": FmiType("UInt8", INTEGER, U8),
    "Int16": FmiType("Int16", INTEGER, I16), "UInt16": FmiType("UInt16", INTEGER, U16),
    "Int32": FmiType("Int32", INTEGER, I32), "UInt32": FmiType("UInt32", INTEGER, U32),
    "Int64": FmiType("Int64", INTEGER), "UInt64": FmiType("UInt64", INTEGER), "Enumeration": FmiType("Int64", INTEGER),
    "Boolean": FmiType("Boolean", INTEGER, U8), "String": FmiType("String", TEXT), "Binary": FmiType("Binary", TEXT),
}  # fmt: skip


class Fmi3Instance(LibraryInstance):
    """An FMU of FMI 3.0."""

    types = TYPES
    version = "3.0"
    set_code, get_code, step_code = loop.SET_3, loop.GET_3, loop.STEP_3
    limits: ClassVar[dict[str, tuple[int, int]]] = {**LIMITS, "Enumeration": LIMITS["Int64"]}

    def _instantiate(self) -> None:
        from fmpy.fmi3 import FMU3Slave

        def on_log(_env: Any, status: int, category: bytes, message: bytes) -> None:
            self.on_message(status, category, message)

        self._keep.append(on_log)
        self._make(FMU3Slave, self.description.instantiationToken)
        self._fmu.instantiate(loggingOn=True, logMessage=on_log)
        if self._structural:
            self._configure()

    def _configure(self) -> None:
        told = ", ".join(f"{name} = {value}" for name, value in self._structural.items())
        self.call(self._fmu.enterConfigurationMode, doing=f"configuration ({told})")
        for name, value in self._structural.items():
            suffix = self.types[self.variables[name].type].call_suffix
            set_values, reference = getattr(self._fmu, f"set{suffix}"), self.variables[name].valueReference
            self.call(set_values, [reference], [value], doing=f"setting the structural parameter {name} = {value}")
        self.call(self._fmu.exitConfigurationMode, doing=f"configuration ({told})")

    def get(self, name: str) -> Any:
        values = self._exchange("get", name, self.size(name), doing="reading")
        if self.variables[name].type == "Binary":
            values = [value or b"" for value in values]
        return tuple(values) if self.variables[name].dimensions else values[0]

    def enter_initialisation(self, start: float, stop: float) -> None:
        told = stop if isfinite(stop) else None
        self.call(self._fmu.enterInitializationMode, doing="enterInitializationMode", startTime=start, stopTime=told)
        self._state = "initialising"

    def reset(self) -> None:
        super().reset()
        if self._structural:
            self._configure()

    def exchange_address(self, verb: str, fmi_type: FmiType) -> int:
        return address_of(getattr(self._fmu.dll, f"fmi3{verb}{fmi_type.call_suffix}"))

    def step_address(self) -> int:
        return address_of(self._fmu.dll.fmi3DoStep)

    def write_step(self, program: Program, may_be_restored: bool) -> None:
        self.reached = program.buffer.stages[U8][self.out_parameters + 8 : self.out_parameters + 16].view(np.float64)
        self.reached[0] = np.nan
        super().write_step(program, may_be_restored)

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

    def serialise(self, state: Any) -> bytes:
        return bytes(self.call(self._fmu.serializeFMUState, state, doing="serializeFMUState"))

    def deserialise(self, content: bytes) -> Any:
        return self.call(self._fmu.deserializeFMUState, content, doing="deserializeFMUState")
