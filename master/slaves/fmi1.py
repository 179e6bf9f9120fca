"""FMI 1.0 for co-simulation: no initialisation mode, no states to restore, booleans of one byte, negated aliases."""

from __future__ import annotations

import ctypes
from math import isfinite
from pathlib import Path
from typing import Any

from ...core.errors import PackageError
from ..engine import loop
from ..engine.loop import I32, U8
from ..engine.values import INTEGER, REAL, TEXT, FmiType
from .base import Log, address_of
from .description import description_tree
from .library import LibraryInstance

TYPES = {
    "Real": FmiType("Real", REAL), "Integer": FmiType("Integer", INTEGER, I32),
    "Enumeration": FmiType("Integer", INTEGER, I32), "Boolean": FmiType("Boolean", INTEGER, U8),
    "String": FmiType("String", TEXT),
}  # fmt: skip


class Fmi1Instance(LibraryInstance):
    """An FMU of FMI 1.0."""

    types = TYPES
    version = "1.0"
    step_code = loop.STEP_1

    def __init__(self, name: str, folder: Path, description: Any):
        super().__init__(name, folder, description)
        self._read_on()

    def _read_on(self) -> None:
        """What fmpy leaves out: capabilities, and reals that are the negative of their value reference's value."""
        root = description_tree(self.folder).getroot()
        for capabilities in root.iter("Capabilities"):
            for able in (
                "canHandleVariableCommunicationStepSize", "canInterpolateInputs", "canBeInstantiatedOnlyOncePerProcess",
            ):  # fmt: skip
                setattr(self.description.coSimulation, able, capabilities.get(able) in ("true", "1"))
        found = [v.get("name") for v in root.iter("ScalarVariable") if v.get("alias") == "negatedAlias"]
        for variable in [self.variables[name] for name in found if name in self.variables]:
            if variable.causality == "local" and self.types[variable.type].family != REAL:
                del self.variables[variable.name]
            elif variable.causality == "input" or self.types[variable.type].family != REAL:
                raise PackageError(
                    f"component '{self.name}': '{variable.name}' is a negated alias; only real outputs and parameters "
                    "may be one"
                )
        self.negated = frozenset(found)
        for v in root.iter("ScalarVariable"):  # an output that does not change; fmpy makes it a parameter
            kind = v.get("causality"), v.get("variability")
            if kind == ("output", "parameter") and v.get("name") in self.variables:
                self.variables[v.get("name")].causality = "output"
        self._direct = self._with_aliases({
            v.get("name"): [n.get("input") or (n.text or "").strip() for n in v.find("DirectDependency")]
            for v in root.iter("ScalarVariable") if v.find("DirectDependency") is not None
        })  # fmt: skip

    def settable(self, name: str) -> bool:
        v = self.variables.get(name)
        if v is None or v.type not in self.types or v.variability == "constant" or v.causality in ("output", "none"):
            return False
        return super().settable(name) or v.start is not None  # an internal variable with a start value

    def _known_feedthrough(self, output: str) -> list[str] | None:
        return self._direct.get(output, self.detected_feedthrough.get(output))

    def set_start(self, name: str, value: Any) -> None:
        super().set_start(name, -value if name in self.negated else value)

    def get(self, name: str) -> Any:
        value = super().get(name)
        return -value if name in self.negated else value

    def load(self, log: Log) -> None:
        super().load(log)
        self._set_inputs()

    def reset(self) -> None:
        super().reset()
        self._set_inputs()

    def _set_inputs(self) -> None:
        for name, v in self.variables.items():  # FMI 1.0 has no start values of its own accord for what is not set
            if v.causality == "input" and v.start not in (None, ""):
                self.set_start(name, self.start(name))

    def _instantiate(self) -> None:
        from fmpy import fmi1

        callbacks = self._callbacks(fmi1, "fmi1")
        callbacks.stepFinished = None
        self._make(fmi1.FMU1Slave, self.description.guid)
        self._fmu.instantiate(functions=callbacks, loggingOn=True)

    def set_debug_logging(self, categories: list[str]) -> None:
        self._fmu.setDebugLogging(True)  # FMI 1.0 has no categories to switch

    def enter_initialisation(self, start: float, stop: float) -> None:
        self._times = start, stop
        self._state = "initialising"

    def exit_initialisation(self) -> None:
        kinds = ctypes.c_void_p, ctypes.c_double, ctypes.c_char, ctypes.c_double
        initialise = ctypes.CFUNCTYPE(ctypes.c_int, *kinds)(self._address("fmiInitializeSlave"))  # fmpy expects a text
        start, stop = self._times
        told = (b"\1", stop) if isfinite(stop) else (b"\0", 0.0)
        status = self.call(initialise, self.instance, start, *told, doing="fmiInitializeSlave")
        if status > 1:
            raise self.failure("fmiInitializeSlave", status)
        self.begin()

    def _address(self, name: str) -> int:
        return address_of(getattr(self._fmu.dll, f"{self.description.coSimulation.modelIdentifier}_{name}"))

    def exchange_address(self, verb: str, fmi_type: FmiType) -> int:
        return self._address(f"fmi{verb}{fmi_type.call_suffix}")

    def step_address(self) -> int:
        return self._address("fmiDoStep")

    def input_derivatives_address(self) -> int:
        return self._address("fmiSetRealInputDerivatives")
