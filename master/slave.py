"""One FMU (FMI 2.0 co-simulation) behind the calls the master needs, through fmpy, with memory laid out once.

Real inputs and outputs live in the master's signal array; FMI reads and writes it in place. Every FMI call is checked:
a status above fmi2Warning becomes a `SimulationError` with the FMU's own log message.
"""

from __future__ import annotations

import ctypes
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from ..core.errors import PackageError, ParameterError, SimulationError, UnknownNameError, did_you_mean

_STATUS = ("OK", "warning", "discard", "error", "fatal", "pending")
_FATAL = 4


@dataclass(frozen=True)
class Signal:
    """An input or output that the master exchanges or records; `place` is its index in the signal array."""

    name: str
    reference: int
    kind: str
    place: int


class Slave:
    """An FMU instance. Life: `load`, `set_start`, `initialise_begin`, `initialise_end`, steps, `free`."""

    def __init__(self, name: str, folder: Path, description: Any):
        self.name = name
        self.folder = folder
        self.description = description
        self.variables = {v.name: v for v in description.modelVariables}
        self.seconds = 0.0
        """Wall time spent in the FMU's calls [s]."""
        self.messages: deque[tuple[str, str]] = deque(maxlen=100)
        """The last log messages: (status, text)."""
        self._fmu: Any = None
        self._state = "new"

    # set up

    def variable(self, name: str, kinds: tuple[str, ...] = ()) -> Any:
        """The FMU variable of that name, of one of the causalities `kinds`."""
        variable = self.variables.get(name)
        if variable is None or (kinds and variable.causality not in kinds):
            known = [n for n, v in self.variables.items() if not kinds or v.causality in kinds]
            what = kinds[0] if len(kinds) == 1 else "variable"
            raise UnknownNameError(f"component '{self.name}' has no {what} '{name}'{did_you_mean(name, known)}")
        return variable

    def unit(self, name: str) -> str | None:
        """Unit of a variable, its own or that of its declared type."""
        variable = self.variables[name]
        return variable.unit or (variable.declaredType.unit if variable.declaredType is not None else None)

    def checked(self, name: str, value: Any, where: str = "") -> Any:
        """`value` in the variable's type, or a `ParameterError` that names variable, value and range."""
        variable = self.variable(name)
        shown = f"{where}: " if where else ""
        address = f"{self.name}.{name}"
        if variable.type in ("Real", "Integer", "Enumeration"):
            try:
                number = float(value)
            except (TypeError, ValueError):
                raise ParameterError(f"{shown}{address} = {value!r} is not a number") from None
            low = -float("inf") if variable.min is None else float(variable.min)
            high = float("inf") if variable.max is None else float(variable.max)
            if not (np.isfinite(number) and low <= number <= high):
                unit = f" {self.unit(name)}" if self.unit(name) else ""
                raise ParameterError(
                    f"{shown}{address} = {number:g}{unit} is out of range; allowed: {low:g} to {high:g}{unit}"
                )
            if variable.type == "Real":
                return number
            if number != int(number):
                raise ParameterError(f"{shown}{address} = {number:g} is not an integer")
            return int(number)
        if variable.type == "Boolean":
            truth = {"true": True, "1": True, "1.0": True, "false": False, "0": False, "0.0": False}
            try:
                return truth[str(value).strip().lower()]
            except KeyError:
                raise ParameterError(f"{shown}{address} = {value!r} is neither true nor false") from None
        return str(value)

    def load(self, log: Callable[[str, str, str], None]) -> None:
        """Load the library and instantiate; `log` gets (component, status, text) of every message.

        fmpy's formatting of log messages knows one receiver per process, so messages of other instances arrive here
        as well and `log` has to go by the name it is given.
        """
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
                status_name = _STATUS[status] if status < len(_STATUS) else str(status)
                log((name or b"").decode("utf-8", "replace") or self.name, status_name, text)

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
            reason = self.messages[-1][1] if self.messages else str(error)
            raise PackageError(f"component '{self.name}' cannot be instantiated: {reason}") from None
        self._state = "instantiated"
        self._c = self._fmu.component
        dll = self._fmu.dll
        self._do_step = self._bind(dll.fmi2DoStep, ctypes.c_void_p, ctypes.c_double, ctypes.c_double, ctypes.c_int)
        for kind, ctype in (("Real", ctypes.c_double), ("Integer", ctypes.c_int), ("Boolean", ctypes.c_int)):
            for verb in ("Get", "Set"):
                function = getattr(dll, f"fmi2{verb}{kind}")
                array = ctypes.POINTER(ctype)
                self._bind(function, ctypes.c_void_p, ctypes.POINTER(ctypes.c_uint), ctypes.c_size_t, array)
                setattr(self, f"_{verb.lower()}_{kind.lower()}", function)

    @staticmethod
    def _bind(function: Any, *types: Any) -> Any:
        function.argtypes, function.restype = types, ctypes.c_int
        return function

    def set_start(self, name: str, value: Any) -> None:
        """Set a parameter or start value before initialisation."""
        variable = self.variables[name]
        reference = [variable.valueReference]
        setter = {
            "Real": "setReal",
            "Integer": "setInteger",
            "Enumeration": "setInteger",
            "Boolean": "setBoolean",
            "String": "setString",
        }
        self._call(getattr(self._fmu, setter[variable.type]), reference, [value], doing=f"setting '{name}'")

    def initialise_begin(self, start: float, stop: float) -> None:
        """setupExperiment and enterInitializationMode."""
        self._call(self._fmu.setupExperiment, doing="setupExperiment", startTime=start, stopTime=stop)
        self._call(self._fmu.enterInitializationMode, doing="enterInitializationMode")
        self._state = "initialising"

    def initialise_end(self) -> None:
        """exitInitializationMode."""
        self._call(self._fmu.exitInitializationMode, doing="exitInitializationMode")
        self._state = "running"

    def reset(self) -> None:
        """Back to the state after instantiation: start values, ready for another run."""
        self._call(self._fmu.reset, doing="reset")
        self.messages.clear()
        self._state = "instantiated"

    def lay_out(self, inputs: list[Signal], outputs: list[Signal], given: np.ndarray, read: np.ndarray) -> None:
        """Bind inputs to places in the array `given`, outputs to places in `read`; those of one kind are in a row."""
        self.inputs, self.outputs = inputs, outputs
        self._setters = self._groups(inputs, given, "set")
        self._getters = self._groups(outputs, read, "get")

    def _groups(self, signals: list[Signal], array: np.ndarray, verb: str) -> list[Any]:
        groups = []
        for kind in ("Real", "Integer", "Boolean"):
            chosen = [s for s in signals if s.kind == kind]
            if not chosen:
                continue
            references = (ctypes.c_uint * len(chosen))(*(s.reference for s in chosen))
            first = chosen[0].place
            view = array[first : first + len(chosen)]
            function = getattr(self, f"_{verb}_{kind.lower()}")
            if kind == "Real":
                buffer = ctypes.cast(view.ctypes.data, ctypes.POINTER(ctypes.c_double))
                groups.append((function, references, len(chosen), buffer, None))
            else:
                numbers = np.zeros(len(chosen), np.int32)
                buffer = ctypes.cast(numbers.ctypes.data, ctypes.POINTER(ctypes.c_int))
                groups.append((function, references, len(chosen), buffer, (numbers, view)))
        return groups

    # run

    def set_inputs(self) -> None:
        """Hand the input values in the signal array to the FMU."""
        for function, references, n, buffer, copy in self._setters:
            if copy:
                copy[0][:] = copy[1]
            status = function(self._c, references, n, buffer)
            if status > 1:
                self._fail("setting the inputs", status)

    def get_outputs(self) -> None:
        """Read the outputs of the FMU into the signal array."""
        for function, references, n, buffer, copy in self._getters:
            status = function(self._c, references, n, buffer)
            if status > 1:
                self._fail("reading the outputs", status)
            if copy:
                copy[1][:] = copy[0]

    def do_step(self, t: float, h: float) -> None:
        """Advance the FMU from t over h [s]."""
        begin = perf_counter()
        status = self._do_step(self._c, t, h, 1)
        self.seconds += perf_counter() - begin
        if status > 1:
            self._fail("doStep", status, t)

    def free(self) -> None:
        """Terminate and free; safe to call in any state, and never raises. After fmi2Fatal the FMU is left alone."""
        if self._fmu is None or self._state == "lost":
            return
        try:
            if self._state == "running":
                self._fmu.terminate()
        except Exception:
            pass
        try:
            if self._state != "new":
                self._fmu.freeInstance()
        except Exception:
            pass
        self._fmu = None

    def _call(self, function: Callable[..., Any], *args: Any, doing: str, **kwargs: Any) -> None:
        begin = perf_counter()
        known = len(self.messages)
        try:
            function(*args, **kwargs)
        except Exception as error:
            self._note_fatal(getattr(error, "status", None))
            texts = [text for _, text in list(self.messages)[known:]]
            reason = texts[-1] if texts else str(error)
            raise SimulationError(f"component '{self.name}', {doing}: {' '.join(reason.split())}") from None
        finally:
            self.seconds += perf_counter() - begin

    def _note_fatal(self, status: int | None) -> None:
        if status == _FATAL:
            self._state = "lost"

    def _fail(self, doing: str, status: int, t: float | None = None) -> None:
        self._note_fatal(status)
        told = [text for kind, text in self.messages if kind != "warning"]
        reason = told[-1] if told else f"the FMU returned fmi2{_STATUS[status].capitalize()}"
        at = "" if t is None else f" at t = {t:g} s"
        raise SimulationError(f"component '{self.name}', {doing}{at}: {' '.join(reason.split())}", t)
