"""An FMU whose library is loaded into this process by fmpy: what all FMI versions have in common."""

from __future__ import annotations

import ctypes
import inspect
import os
import re
from abc import abstractmethod
from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import cache
from itertools import count
from pathlib import Path
from types import UnionType
from typing import Any, ClassVar, get_args

import numpy as np

from ...core.errors import PackageError, SimulationError, first_few
from ..engine import loop
from ..engine.program import Program
from ..engine.values import TEXT, ExchangeGroup, FmiType, Signal
from .base import FmuInstance, Log
from .message_log import ERROR, FATAL, STATUS
from .siblings import Siblings

_live: dict[int, LibraryInstance] = {}
"""The instances that are loaded, by what the callbacks of their FMUs bring along."""

_numbers = count(1)

_marks: list[str] = []
"""What names of instances end with in this process."""


def mark_instances(mark: str) -> None:
    """From here on names of instances end so in this process: FMUs of several processes may call files after them."""
    _marks[:] = [mark]


@cache
def _quieten_pythonfmu() -> None:
    """Keep FMUs that pythonfmu 0.7.0 has made, ours apart, from crashing this process as it ends.

    The library of `fmus/front/quiet.c`, which says why, has to be there before theirs; without it all else works.
    """
    library = Path(__file__).parents[2] / "fmus" / "_quiet.abi3.so"
    with suppress(OSError):
        ctypes.CDLL(str(library), ctypes.RTLD_GLOBAL)


class LibraryInstance(FmuInstance):
    """Versions say how an FMU is instantiated and initialised; `_fmu` is fmpy's object."""

    set_code: ClassVar[int] = loop.SET
    get_code: ClassVar[int] = loop.GET
    step_code: ClassVar[int]

    def load(self, log: Log) -> None:
        self._number, self._log = next(_numbers), log
        _live[self._number] = self
        self.in_call = "being instantiated"
        try:
            self._instantiate()
            if not self.instance:
                raise PackageError("the FMU gave no instance and no reason")
        except Exception as error:
            del _live[self._number]
            reason = self.messages[-1][1] if self.messages else str(error)
            raise PackageError(
                f"component '{self.name}' cannot be instantiated: {' '.join(reason.split())}{self.lacking}"
            ) from None
        self.in_call = ""
        self._state = "instantiated"
        self._switch_on_logging()

    def _switch_on_logging(self) -> None:
        """Have the FMU say more, where the message log wants it."""
        if (log := self.message_log) is None:
            return
        categories = log.switched_on([c.name for c in self.description.logCategories])
        if categories is None:
            return
        try:
            self.set_debug_logging(categories)
        except Exception as error:
            log.write(self.name, 1, "", f"debug logging cannot be switched on: {error}")

    def set_debug_logging(self, categories: list[str]) -> None:
        """Switch debug logging on, of these categories; [] are all. Raises what fmpy raises."""
        self._fmu.setDebugLogging(True, categories)

    @abstractmethod
    def _instantiate(self) -> None:
        """Make `_fmu` and instantiate it."""

    def _make(self, kind: Callable[..., Any], token: str) -> None:
        """Make `_fmu`, of a class of fmpy; what fmpy leaves changed where that fails is put back."""
        here, siblings = os.getcwd(), Siblings(self.folder)
        _quieten_pythonfmu()
        while True:
            try:
                self._fmu = _tolerant(kind)(
                    guid=token,
                    unzipDirectory=str(self.folder),
                    modelIdentifier=self.description.coSimulation.modelIdentifier,
                    instanceName=self.instance_name,
                )
                return
            except Exception as error:
                if not siblings.load(str(error)):
                    raise PackageError(f"{error}{siblings.remedy(str(error))}") from None
            finally:
                os.chdir(here)

    def _callbacks(self, api: Any, prefix: str) -> Any:
        """The callback functions of FMI 1.0 and 2.0, from fmpy's module of the version."""
        from fmpy import calloc, free
        from fmpy.logging import addLoggerProxy

        callbacks = getattr(api, f"{prefix}CallbackFunctions")()
        writer = _writer()
        hears = _receiver() if writer is None else writer
        callbacks.logger = ctypes.cast(hears, getattr(api, f"{prefix}CallbackLoggerTYPE"))
        callbacks.allocateMemory = getattr(api, f"{prefix}CallbackAllocateMemoryTYPE")(calloc)
        callbacks.freeMemory = getattr(api, f"{prefix}CallbackFreeMemoryTYPE")(free)
        if writer is None:
            addLoggerProxy(ctypes.byref(callbacks))
        self._keep.append(callbacks)
        return callbacks

    def on_message(self, status: int, category: bytes | None, message: bytes | None) -> None:
        """Hand a message of the FMU to the log, unless all is well, and to the message log in any case."""
        if status <= 0 and self.message_log is None:
            return
        told = self._spelled((message or b"").decode("utf-8", "replace").strip())
        if self.message_log is not None:
            self.message_log.write(self.name, status, (category or b"").decode("utf-8", "replace"), told)
        if status > 0:
            self._log(self.name, STATUS[status] if status < len(STATUS) else str(status), told)

    def _spelled(self, message: str) -> str:
        """A message with the names of variables for #r12# and the like (FMI 1.0 and 2.0), and # for ##."""
        if "#" not in message or self.version == "3.0":
            return message
        kinds = {"r": ("Real",), "i": ("Integer", "Enumeration"), "b": ("Boolean",), "s": ("String",)}

        def name(found: re.Match[str]) -> str:
            if not found[1]:
                return "#"
            meant = (v for v in self.variables.values() if v.type in kinds[found[1]])
            return next((v.name for v in meant if v.valueReference == int(found[2])), found[0])

        return re.sub(r"#(?:([ribs])(\d+))?#", name, message)

    def note_status(self, status: int | None) -> None:
        """After fmiError only its state may be set; after fmiFatal no instance of the FMU is touched again."""
        if status == FATAL:
            for instance in [s for s in _live.values() if s.folder == self.folder]:
                instance._state = "lost"
        elif status == ERROR and self._state == "running":
            self._state = "failed"
        super().note_status(status)

    def _exchange(self, verb: str, name: str, *rest: Any, doing: str) -> Any:
        """fmpy's getXXX or setXXX for one variable."""
        variable = self.variables[name]
        function = getattr(self._fmu, f"{verb}{self.types[variable.type].call_suffix}")
        return self.call(function, [variable.valueReference], *rest, doing=f"{doing} '{name}'")

    def set_start(self, name: str, value: Any) -> None:
        self._exchange("set", name, list(value) if isinstance(value, tuple) else [value], doing="setting")

    def get(self, name: str) -> Any:
        return self._exchange("get", name, doing="reading")[0]

    def exit_initialisation(self) -> None:
        self.call(self._fmu.exitInitializationMode, doing="exitInitializationMode")
        self.begin()

    def reset(self) -> None:
        self.call(self._fmu.reset, doing="reset")
        self.messages.clear()
        self._state = "instantiated"

    def free(self) -> None:
        if self._state not in ("new", "lost", "freed"):
            for function in ([self._fmu.terminate] if self._state == "running" else []) + [self._fmu.freeInstance]:
                if self.is_lost:  # by what it was called for before
                    break
                try:
                    self.call(function, doing=function.__name__)
                except SimulationError as error:
                    self.termination_error = self.termination_error or str(error)
            self._state = "lost" if self.is_lost else "freed"
        _live.pop(getattr(self, "_number", 0), None)  # what is said on the way is heard

    # what happens in every step

    @abstractmethod
    def exchange_address(self, verb: str, fmi_type: FmiType) -> int:
        """Address of the function that gets or sets values ("Get", "Set") of a type."""

    @abstractmethod
    def step_address(self) -> int:
        """Address of doStep."""

    def ends_address(self) -> int:
        """Address of what tells, after a discarded step, whether the FMU wants to end the run; 0 where nothing does."""
        return 0

    def input_derivatives_address(self) -> int:
        """Address of SetRealInputDerivatives."""
        raise NotImplementedError

    def write_inputs(self, program: Program) -> None:
        self._write_exchange(program, self.input_groups, "Set", "setting the inputs")

    def write_outputs(self, program: Program) -> None:
        self._write_exchange(program, self.output_groups, "Get", "reading the outputs")

    def _write_exchange(self, program: Program, groups: Sequence[ExchangeGroup], verb: str, doing: str) -> None:
        for g in groups:
            if g.fmi_type.family == TEXT:
                if any(s.name in self.texts for s in g.signals):
                    self._write_texts(program, g, verb, doing)
                continue
            if g.fmi_type.width is None:
                buffer = program.buffer.address(g.place)
            else:
                stage = program.buffer.stages[g.fmi_type.width]
                buffer = int(stage.ctypes.data) + g.stage * stage.itemsize
                if verb == "Set":
                    program.add(self, doing, loop.STAGE, g.fmi_type.width, g.place, g.stage, g.count)
            told = f"{doing} ({first_few(s.name for s in g.signals)})"
            code = self.set_code if verb == "Set" else self.get_code
            address = self.exchange_address(verb, g.fmi_type)
            references = int(g.references.ctypes.data)
            program.add(self, told, code, address, self.instance, references, len(g.references), buffer, g.count)
            if g.fmi_type.width is not None and verb == "Get":
                program.add(self, doing, loop.UNSTAGE, g.fmi_type.width, g.place, g.stage, g.count)
            for s in g.signals:
                if s.name in self.negated:
                    program.add(self, doing, loop.LINEAR, s.place, s.place, 1, program.constant(-1.0, 0.0))

    def _write_texts(self, program: Program, group: ExchangeGroup, verb: str, doing: str) -> None:
        def exchange(_t: float, _h: float) -> int:
            try:
                self.exchange_texts(verb, group.signals, program.buffer.texts)
            except Exception as error:
                self.keep_message("error", str(error))
                return 3
            return 0

        program.python(exchange, self, doing)

    def write_step(self, program: Program, may_be_restored: bool) -> None:
        number, ends = program.number(self), self.ends_address()
        program.add(self, "doStep", self.step_code, self.step_address(), self.instance, number, self.substeps,
                    self.out_parameters, ends, int(may_be_restored))  # fmt: skip

    def write_input_derivatives(self, program: Program, references: Sequence[int], changes: int) -> None:
        kept = np.array(references, np.uint32), np.ones(len(references), np.int32)
        program.keep(kept)
        first, orders = (int(a.ctypes.data) for a in kept)
        program.add(self, "setting the inputs' slopes", loop.INPUT_DERIVATIVES, self.input_derivatives_address(),
                    self.instance, first, len(references), orders, changes)  # fmt: skip

    @property
    def interpolates_inputs(self) -> bool:
        # within a step of several own ones it is not defined from where on the slope counts
        able = bool(getattr(self.description.coSimulation, "canInterpolateInputs", False))
        return able and self.version != "3.0" and self.substeps == 1

    def directional_derivatives(self, outputs: Sequence[int], input: int) -> list[float] | None:
        if not getattr(self.description.coSimulation, "providesDirectionalDerivative", False):
            return None
        function = self._fmu.getDirectionalDerivative
        try:
            found = self.call(function, list(outputs), [input], [1.0], doing="getDirectionalDerivative")
        except SimulationError:
            if self.is_lost:
                raise
            return None
        return found if np.isfinite(found).all() else None

    @property
    def instance_name(self) -> str:
        """What the FMU is told that it is called."""
        return self.name + "".join(_marks)

    @property
    def instance(self) -> int:
        """Address of the instance."""
        component = self._fmu.component
        return int(getattr(component, "value", component) or 0)

    def is_instance(self, address: int | None) -> bool:
        """Whether that is the address of the instance, as far as it is there already."""
        fmu = getattr(self, "_fmu", None)
        return bool(address) and getattr(fmu, "component", None) is not None and self.instance == address

    def exchange_texts(self, verb: str, signals: Sequence[Signal], texts: list[Any]) -> None:
        """Get or set strings and binaries, values in `texts` by place."""
        references = [s.reference for s in signals]
        if verb == "Set":
            self.call(self._fmu.setString, references, [texts[s.place] for s in signals], doing="setting the inputs")
            return
        values = self.call(self._fmu.getString, references, doing="reading the outputs")
        for s, value in zip(signals, values, strict=True):
            texts[s.place] = text(value)


@cache
def _receiver() -> Any:
    """The one function that hears all FMUs of FMI 1.0 and 2.0; fmpy's formatting of messages knows no other.

    FMI 2.0 hands back what it was given with the callbacks, FMI 1.0 the instance; FMUs that bring neither are known by
    the instance's name, and else by having been loaded last.
    """

    def hear(owner: int | None, name: bytes | None, status: int, category: bytes, message: bytes) -> None:
        instances = [*_live.values()][::-1]
        called = (name or b"").decode("utf-8", "replace")
        found = _live.get(owner or 0) or next((s for s in instances if s.is_instance(owner)), None)
        found = found or next((s for s in instances if s.instance_name == called), instances[0] if instances else None)
        if found is not None:
            found.on_message(status, category, message)

    kind = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_char_p, ctypes.c_int, ctypes.c_char_p, ctypes.c_char_p)
    return kind(hear)


@cache
def _writer() -> Any:
    """The function of `log.c`, which puts values into messages and hands these to `_receiver`; None where it was not
    compiled: fmpy's does so then, which a %n in a message crashes."""
    try:
        library = ctypes.CDLL(str(Path(__file__).with_name("_log.abi3.so")))
    except OSError:
        return None
    library.hand_messages_to(_receiver())
    return library.write_message


class _Library:
    """A loaded library in which a function may be missing, until it is called."""

    def __init__(self, dll: Any):
        self._dll = dll

    def __getattr__(self, name: str) -> Any:
        try:
            return getattr(self._dll, name)
        except AttributeError:

            def missing(*_: Any) -> None:
                raise PackageError(f"its library has no function {name}")

            return missing


@cache
def _functions(kind: Callable[..., Any]) -> list[tuple[str, list[str], list[Any], Any]]:
    """Name, arguments, their types and the result's of the functions that a class of fmpy calls: what its own
    `_loadFunctions` finds out anew for every instance, which takes longer than all else of loading."""
    start, found = kind.__name__.lower()[:4].replace("fmu", "fmi"), []
    for name, method in inspect.getmembers(kind, inspect.isfunction):
        if name.startswith(start):
            signature = inspect.signature(method)
            parameters = list(signature.parameters.values())[1:]
            told = [p.annotation for p in parameters]
            types = [get_args(t)[0] if isinstance(t, UnionType) else t for t in told]
            result = signature.return_annotation
            result = {bytes: ctypes.c_char_p, int: ctypes.c_int}.get(result, result)
            found.append((name, [p.name for p in parameters], types, result))
    return found


@cache
def _tolerant(kind: Callable[..., Any]) -> Callable[..., Any]:
    """fmpy's class of FMUs, for libraries that lack functions that nobody calls."""

    class Tolerant(kind):  # type: ignore[misc, valid-type]
        def _loadFunctions(self) -> None:
            self.dll: Any = _Library(self.dll)
            prefix = f"{self.modelIdentifier}_" if kind.__name__.startswith("FMU1") else ""
            for name, arguments, types, result in _functions(kind):
                function = getattr(self.dll, prefix + name.replace("fmi1", "fmi") if prefix else name)
                function.argnames, function.argtypes, function.restype = arguments, types, result
                self._functions[name] = function

    Tolerant.__name__ = kind.__name__  # by which fmpy knows the version
    return Tolerant


def text(value: Any) -> Any:
    """A string as fmpy gives it."""
    return value.decode("utf-8", "replace") if isinstance(value, bytes) else value
