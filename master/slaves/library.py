"""An FMU whose library is loaded into this process by fmpy: what all FMI versions have in common."""

from __future__ import annotations

import ctypes
from abc import abstractmethod
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from ...core.errors import PackageError, SimulationError
from .base import STATUS, Log, Signal, Slave


class LibrarySlave(Slave):
    """Versions say how an FMU is instantiated and initialised; `_fmu` is fmpy's object."""

    def load(self, log: Log) -> None:
        try:
            self._instantiate(log)
        except Exception as error:
            reason = self.messages[-1][1] if self.messages else " ".join(str(error).split())
            raise PackageError(f"component '{self.name}' cannot be instantiated: {reason}") from None
        self._state = "instantiated"

    @abstractmethod
    def _instantiate(self, log: Log) -> None:
        """Make `_fmu` and instantiate it."""

    def _make(self, kind: Callable[..., Any], token: str) -> None:
        """Make `_fmu`, of a class of fmpy."""
        self._fmu = kind(
            guid=token,
            unzipDirectory=str(self.folder),
            modelIdentifier=self.description.coSimulation.modelIdentifier,
            instanceName=self.name,
        )

    def _callbacks(self, api: Any, prefix: str, log: Log) -> Any:
        """The callback functions of FMI 1.0 and 2.0, from fmpy's module of the version.

        fmpy's formatting of messages knows one receiver per process: `log` has to go by the name that is given.
        """
        from fmpy import calloc, free
        from fmpy.logging import addLoggerProxy

        def on_log(_owner: Any, name: bytes, status: int, _category: bytes, message: bytes) -> None:
            tell(log, (name or b"").decode("utf-8", "replace") or self.name, status, message)

        callbacks = getattr(api, f"{prefix}CallbackFunctions")()
        callbacks.logger = getattr(api, f"{prefix}CallbackLoggerTYPE")(on_log)
        callbacks.allocateMemory = getattr(api, f"{prefix}CallbackAllocateMemoryTYPE")(calloc)
        callbacks.freeMemory = getattr(api, f"{prefix}CallbackFreeMemoryTYPE")(free)
        addLoggerProxy(ctypes.byref(callbacks))
        self._keep += [callbacks, on_log]
        return callbacks

    def _exchange(self, verb: str, name: str, *rest: Any, doing: str) -> Any:
        """fmpy's getXXX or setXXX for one variable."""
        variable = self.variables[name]
        function = getattr(self._fmu, f"{verb}{self.forms[variable.type].verb}")
        return self.call(function, [variable.valueReference], *rest, doing=f"{doing} '{name}'")

    def set_start(self, name: str, value: Any) -> None:
        self._exchange("set", name, list(value) if isinstance(value, tuple) else [value], doing="setting")

    def get(self, name: str) -> Any:
        return self._exchange("get", name, doing="reading")[0]

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

    @property
    def takes_slopes(self) -> bool:
        # within a step of several own ones it is not defined from where on the slope counts
        able = bool(getattr(self.description.coSimulation, "canInterpolateInputs", False))
        return able and self.version != "3.0" and self.ratio == 1

    def derivatives(self, outputs: Sequence[int], input: int) -> list[float] | None:
        if not getattr(self.description.coSimulation, "providesDirectionalDerivative", False):
            return None
        function = self._fmu.getDirectionalDerivative
        try:
            found = self.call(function, list(outputs), [input], [1.0], doing="getDirectionalDerivative")
        except SimulationError:
            return None
        return found if np.isfinite(found).all() else None

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
            texts[s.place] = text(value)


def tell(log: Log, component: str, status: int, message: bytes) -> None:
    """Hand a message of an FMU to the log, unless all is well."""
    if status > 0:
        shown = STATUS[status] if status < len(STATUS) else str(status)
        log(component, shown, (message or b"").decode("utf-8", "replace").strip())


def text(value: Any) -> Any:
    """A string as fmpy gives it."""
    return value.decode("utf-8", "replace") if isinstance(value, bytes) else value
