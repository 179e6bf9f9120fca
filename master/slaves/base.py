"""One FMU behind the calls that a master needs, whatever its FMI version.

Life: `load`, `set_start`, `enter_initialisation`, `exit_initialisation`, steps, `free`; `reset` leads back to after
`load`. What happens in every step is not called here: `groups` and the addresses tell the engine's program.
"""

from __future__ import annotations

import ctypes
import json
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from time import perf_counter
from types import FunctionType
from typing import Any, ClassVar

import numpy as np

from ...core.errors import PackageError, ParameterError, SimulationError, UnknownNameError, did_you_mean
from ...core.unit_names import named
from ...core.units import BASE, Unit
from ..engine.loop import F32, I8, I16, I32, U8, U16, U32

STATUS = ("OK", "warning", "discard", "error", "fatal", "pending")
ERROR, FATAL = 3, 4

REAL, INTEGER, TEXT = "real", "integer", "text"
"""Families: how a signal's values are kept."""

Log = Callable[[str, str, str], None]
"""Is told (component, status, text) of every message of an FMU."""


@dataclass(frozen=True)
class Form:
    """How values of an FMI type are exchanged: the name in Get/Set calls, the family, and the width where that is not
    the 8 bytes of a slot."""

    verb: str
    family: str
    width: int | None = None


FORMS_2 = {
    "Real": Form("Real", REAL), "Integer": Form("Integer", INTEGER, I32), "Enumeration": Form("Integer", INTEGER, I32),
    "Boolean": Form("Boolean", INTEGER, I32), "String": Form("String", TEXT),
}  # fmt: skip

FORMS_1 = {**FORMS_2, "Boolean": Form("Boolean", INTEGER, U8)}

FORMS_3 = {
    "Float64": Form("Float64", REAL), "Float32": Form("Float32", REAL, F32), "Int8": Form("Int8", INTEGER, I8),
    "UInt8": Form("UInt8", INTEGER, U8), "Int16": Form("Int16", INTEGER, I16), "UInt16": Form("UInt16", INTEGER, U16),
    "Int32": Form("Int32", INTEGER, I32), "UInt32": Form("UInt32", INTEGER, U32), "Int64": Form("Int64", INTEGER),
    "UInt64": Form("UInt64", INTEGER), "Enumeration": Form("Int64", INTEGER), "Boolean": Form("Boolean", INTEGER, U8),
    "String": Form("String", TEXT), "Binary": Form("Binary", TEXT),
}  # fmt: skip

LIMITS = {
    "Integer": (-(2**31), 2**31 - 1), "Enumeration": (-(2**31), 2**31 - 1),
    **{f"Int{n}": (-(2 ** (n - 1)), 2 ** (n - 1) - 1) for n in (8, 16, 32, 64)},
    **{f"UInt{n}": (0, 2**n - 1) for n in (8, 16, 32, 64)},
}  # fmt: skip

MOST_VALUES = 10_000_000
"""Most values of an array."""

WIDTHS = {I8: np.int8, U8: np.uint8, I16: np.int16, U16: np.uint16, I32: np.int32, U32: np.uint32, F32: np.float32}


@dataclass(frozen=True)
class Signal:
    """An input or output: `place` is its first slot on the board (or its place among the texts), `size` how many."""

    component: str
    name: str
    type: str
    family: str
    reference: int
    place: int
    size: int = 1
    is_array: bool = False
    """Whether it has dimensions, be they 1."""
    element: int | None = None
    """Which value of an array it is, where it is only one of them."""

    @property
    def address(self) -> str:
        """component.variable."""
        return f"{self.component}.{self.name}" if self.component else self.name

    @property
    def index(self) -> str:
        """'[2]' where it is the second value of an array; '' where it is a whole signal."""
        return "" if self.element is None else f"[{self.element + 1}]"

    @property
    def label(self) -> str:
        """Its address, with the index where it is one value of an array."""
        return self.address + self.index

    @property
    def home(self) -> tuple[bool, int]:
        """Where it lies: whether among the texts, and its place. Aliases share it, and the values of an array."""
        return self.family == TEXT, self.place - (self.element or 0)

    def part(self, element: int) -> Signal:
        """One value of an array."""
        return replace(self, place=self.place + element, size=1, element=element)


@dataclass
class Group:
    """Signals of one type that are exchanged in one call: references, first slot (or text) and number of values."""

    form: Form
    references: np.ndarray
    place: int
    count: int
    stage: int
    """Place in the staging area of the form's width."""
    signals: list[Signal]


class Slave(ABC):
    """An FMU instance."""

    forms: ClassVar[dict[str, Form]]
    version: ClassVar[str]
    limits: ClassVar[dict[str, tuple[int, int]]] = LIMITS
    """Least and greatest value of the types of whole numbers."""

    def __init__(self, name: str, folder: Path, description: Any):
        self.name, self.folder, self.description = name, folder, description
        self.variables = {v.name: v for v in description.modelVariables}
        self._log: Log = lambda *_: None
        self.messages: deque[tuple[str, str]] = deque(maxlen=100)
        """The last log messages: (status, text)."""
        self.heard = 0
        """How many there have been."""
        self._begun = 0
        """How many until the run began."""
        self.seconds = 0.0
        """Wall time spent in the FMU's calls outside of steps [s]."""
        self.ratio = 1
        """Steps of the FMU in a macro step."""
        self.inputs: list[Signal] = []
        self.outputs: list[Signal] = []
        self.input_groups: list[Group] = []
        self.output_groups: list[Group] = []
        self.texts: set[str] = set()
        """Strings and binaries that are handed over at every step: of the inputs those that something drives (the
        others are set once, before the run), of the outputs those that are connected or recorded."""
        self.answers: dict[str, list[str]] = {}
        """Inputs that outputs have been found to answer to at once (`direct.probe`)."""
        self._through: dict[str, list[str]] | None = None
        """Inputs that outputs depend on at once, where the FMU says it."""
        self.told = 0
        """Place of doStep's out parameters, or of its status, among the bytes of the staging area."""
        self.reached = np.full(1, np.nan)
        """Where doStep of FMI 3.0 says that the FMU has come to [s]."""
        self.negated: frozenset[str] = frozenset()
        """Variables that are the negative of what their value reference stands for; only FMI 1.0 has some."""
        self._structural: dict[str, Any] = {}
        """Values of structural parameters, which sizes of arrays follow; only FMI 3.0 has some."""
        self._units = {u.name: _unit(u) for u in description.unitDefinitions}
        self._state = "new"
        self._keep: list[Any] = []

    # what the model description says

    def variable(self, name: str, kinds: tuple[str, ...] = ()) -> Any:
        """The variable of that name, of one of the causalities `kinds`."""
        variable = self.variables.get(name)
        if variable is None or (kinds and variable.causality not in kinds):
            known = [n for n, v in self.variables.items() if not kinds or v.causality in kinds]
            what = kinds[0] if len(kinds) == 1 else "variable"
            raise UnknownNameError(f"component '{self.name}' has no {what} '{name}'{did_you_mean(name, known)}")
        return variable

    def form(self, name: str) -> Form | None:
        """How a variable's values are exchanged; None for a type that is not supported."""
        return self.forms.get(self.variables[name].type)

    def unit_name(self, name: str) -> str | None:
        """Name of a variable's unit, its own or that of its declared type."""
        variable = self.variables[name]
        return variable.unit or (variable.declaredType.unit if variable.declaredType is not None else None)

    def unit(self, name: str) -> Unit | None:
        """Unit of a variable, as the FMU defines it, else the well-known one of that name."""
        own = self.unit_name(name)
        if own is None:
            return None
        return self._units.get(own) or named(own) or Unit(own, None)

    def relative(self, name: str) -> bool:
        """Whether a variable is a difference, whose unit's offset does not count."""
        variable = self.variables[name]
        if variable.relativeQuantity is not None:
            return bool(variable.relativeQuantity)
        return variable.declaredType is not None and bool(variable.declaredType.relativeQuantity)

    def meant(self, unit: Unit | None, name: str) -> Unit | None:
        """The unit of a variable: what a package says, by the FMU's definition of it where the package has none."""
        if unit is None:
            return self.unit(name)
        return unit if unit.defined else self._units.get(unit.name, unit)

    def items(self, name: str) -> dict[str, int] | None:
        """Items of an enumeration's variable."""
        variable = self.variables[name]
        if variable.type != "Enumeration" or variable.declaredType is None or not variable.declaredType.items:
            return None
        try:
            return {item.name: int(item.value) for item in variable.declaredType.items}
        except (TypeError, ValueError):
            kind = variable.declaredType.name
            raise PackageError(f"component '{self.name}': an item of the enumeration '{kind}' has no value") from None

    def shape(self, name: str) -> tuple[int, ...]:
        """Sizes of a variable; () for a scalar."""
        variable = self.variables[name]
        sizes = []
        for d in variable.dimensions or ():
            size = d.start if d.start is not None else self._structural.get(d.variable.name, d.variable.start)
            try:
                sizes.append(int(size))
            except (TypeError, ValueError):
                raise PackageError(f"component '{self.name}': '{name}' has a dimension of size {size!r}") from None
        count = 1
        for size in sizes:
            count *= size
            if not 0 <= size <= MOST_VALUES or count > MOST_VALUES:
                shown = " x ".join(map(str, sizes))
                raise PackageError(f"component '{self.name}': '{name}' has {shown} values; most are {MOST_VALUES}")
        return tuple(sizes)

    def size(self, name: str) -> int:
        """Number of values of a variable."""
        return int(np.prod(self.shape(name), dtype=int)) if self.variables[name].dimensions else 1

    def settable(self, name: str) -> bool:
        """Whether a value may be given before the initialisation."""
        v = self.variables.get(name)
        if v is None or v.variability == "constant" or v.type not in self.forms:
            return False
        return v.causality in ("parameter", "input", "structuralParameter") or v.initial in ("exact", "approx")

    def feed_through(self, output: str) -> list[str] | None:
        """Inputs that an output depends on at once; where the FMU does not say, those that were found, else None."""
        if self._through is None:
            self._through = {}
            for unknown in self.description.outputs:
                if unknown.variable is not None and unknown.dependencies is not None:
                    known = [v.name for v in unknown.dependencies if v.causality == "input"]
                    self._through.setdefault(unknown.variable.name, known)
        if output in self._through:
            return self._through[output]
        return self.answers.get(output)

    def checked(self, name: str, value: Any, where: str = "", limited: bool = True) -> Any:
        """`value` in the variable's type, or a `ParameterError` that names variable, value and range.

        limited: the range that the FMU states counts.
        """
        self.variable(name)
        size = self.size(name)
        family = self.forms[self.variables[name].type].family
        if isinstance(value, str) and self.variables[name].dimensions and family != TEXT:
            value = tuple(value.replace(",", " ").split())
        elif isinstance(value, str) and self.variables[name].dimensions and value.startswith("["):
            value = _listed(value)
        if isinstance(value, (tuple, list)) or self.variables[name].dimensions:
            values = list(value) if isinstance(value, (tuple, list)) else [value] * size
            if len(values) != size:
                shown = f"{where}: " if where else ""
                raise ParameterError(f"{shown}{self.name}.{name} has {size} values, not {len(values)}")
            return tuple(self._scalar(name, v, where, limited) for v in values)
        return self._scalar(name, value, where, limited)

    def nominal(self, name: str) -> float:
        """Usual size of a real variable: what its FMU or its type declares, else 1 as FMI has it."""
        found = self._declared(name, "nominal")
        return abs(found) if found and np.isfinite(found) else 1.0

    def bounds(self, name: str) -> tuple[float, float]:
        """Least and greatest value that a variable's type and its FMU allow."""
        low, high = self.limits.get(self.variables[name].type, (-float("inf"), float("inf")))
        least, most = self._declared(name, "min"), self._declared(name, "max")
        return (low if least is None else max(low, least)), (high if most is None else min(high, most))

    def _declared(self, name: str, attribute: str) -> float | None:
        """A number that a variable or its type declares."""
        variable = self.variables[name]
        text = getattr(variable, attribute)
        if text in (None, "") and variable.declaredType is not None:
            text = getattr(variable.declaredType, attribute)
        try:
            return None if text in (None, "") else float(text)
        except ValueError:
            raise PackageError(
                f"component '{self.name}', modelDescription.xml: {attribute}=\"{text}\" of '{name}' is not a number"
            ) from None

    def _scalar(self, name: str, value: Any, where: str, limited: bool = True) -> Any:
        variable = self.variables[name]
        shown = f"{where}: " if where else ""
        address = f"{self.name}.{name}"
        family = self.forms[variable.type].family
        if variable.type == "Boolean":
            told = {"true": True, "1": True, "1.0": True, "false": False, "0": False, "0.0": False}
            try:
                return told[str(value).strip().lower()]
            except KeyError:
                raise ParameterError(f"{shown}{address} = {value!r} is neither true nor false") from None
        if family == TEXT:
            if variable.type == "Binary":
                return value if isinstance(value, bytes) else _bytes(value, f"{shown}{address}")
            return str(value)
        items = self.items(name)
        if items and isinstance(value, str) and value in items:
            value = items[value]
        try:
            if isinstance(value, str) and "_" in value:
                raise ValueError
            number = float(value) if family == REAL else _whole(value)
            if number != number:
                raise ValueError
        except (TypeError, ValueError, OverflowError):
            known = f"; known: {', '.join(items)}" if items else ""
            what = "is not a number" if family == REAL or not _is_number(value) else "is not an integer"
            value = f"{value:g}" if isinstance(value, float) else repr(value)
            raise ParameterError(f"{shown}{address} = {value} {what}{known}") from None
        low, high = self.bounds(name) if limited else self.limits.get(variable.type, (-float("inf"), float("inf")))
        if not low <= number <= high:
            unit = f" {self.unit_name(name)}" if self.unit_name(name) else ""
            raise ParameterError(
                f"{shown}{address} = {number:g}{unit} is out of range; allowed: {low:g} to {high:g}{unit}"
            )
        if limited and items and number not in items.values():
            raise ParameterError(f"{shown}{address} = {number:g} is none of its items; known: {', '.join(items)}")
        return number

    def start(self, name: str) -> Any:
        """The start value of a variable in its type; None where only the FMU knows it.

        That is so where the model description has none, and for an array that a structural parameter has given another
        size than its start value has.
        """
        variable = self.variables[name]
        if variable.start is None or (variable.start == "" and self.forms[variable.type].family != TEXT):
            return None
        text = variable.start
        if isinstance(text, (list, tuple)) and not variable.dimensions:
            text = text[0] if text else ""
        if variable.dimensions and self._structural and isinstance(text, (str, list, tuple)):
            given = len(text.split()) if isinstance(text, str) else len(text)
            if given not in (1, self.size(name)):
                return None
        return self.checked(name, text, "modelDescription.xml", limited=False)

    # life

    @abstractmethod
    def load(self, log: Log) -> None:
        """Load the library and instantiate; `log` gets every message."""

    @abstractmethod
    def set_start(self, name: str, value: Any) -> None:
        """Set a parameter or start value before initialisation."""

    @abstractmethod
    def get(self, name: str) -> Any:
        """A variable's present value."""

    @abstractmethod
    def enter_initialisation(self, start: float, stop: float) -> None:
        """Start and stop time [s], and the initialisation mode where there is one."""

    @abstractmethod
    def exit_initialisation(self) -> None:
        """From here on steps may be taken."""

    @abstractmethod
    def reset(self) -> None:
        """Back to the state after `load`: start values, ready for another run."""

    @abstractmethod
    def free(self) -> None:
        """Terminate and free; safe to call in any state, and never raises."""

    # what the engine calls

    @abstractmethod
    def exchange_address(self, verb: str, form: Form) -> int:
        """Address of the function that gets or sets values ("Get", "Set") of a form."""

    @abstractmethod
    def step_address(self) -> int:
        """Address of doStep."""

    def ends_address(self) -> int:
        """Address of what tells, after a discarded step, whether the FMU wants to end the run; 0 where nothing does."""
        return 0

    def last_successful_time(self) -> float | None:
        """Where an FMU came to [s] in a step that it did not take to its end; None where it does not say."""
        return None

    @property
    def takes_slopes(self) -> bool:
        """Whether the FMU carries its real inputs on through a step when it is told their slopes."""
        return False

    def slopes_address(self) -> int:
        """Address of SetRealInputDerivatives."""
        raise NotImplementedError

    @property
    @abstractmethod
    def instance(self) -> int:
        """Address of the instance."""

    @abstractmethod
    def exchange_texts(self, verb: str, signals: Sequence[Signal], texts: list[Any]) -> None:
        """Get or set strings and binaries, values in `texts` by place."""

    def derivatives(self, outputs: Sequence[int], input: int) -> list[float] | None:
        """What outputs answer at once to a change of an input, by value references; None where the FMU does not say."""
        return None

    # state

    @property
    def can_restore(self) -> bool:
        """Whether the state can be saved and restored."""
        return bool(getattr(self.description.coSimulation, "canGetAndSetFMUstate", False))

    def save(self) -> Any:
        """The state, to be restored later."""
        raise SimulationError(f"component '{self.name}' cannot save its state")

    def restore(self, state: Any) -> None:
        """Back to a saved state, which can be restored again."""
        raise SimulationError(f"component '{self.name}' cannot restore a state")

    def drop(self, state: Any) -> None:  # noqa: B027  nothing to do for a slave without states
        """A saved state is not needed any more."""

    # errors

    def call(self, function: Callable[..., Any], *args: Any, doing: str, **kwargs: Any) -> Any:
        """Call a function of fmpy; a failure becomes a `SimulationError` with the FMU's own message."""
        begin, known = perf_counter(), self.heard
        try:
            return function(*args, **kwargs)
        except Exception as error:
            self.note(getattr(error, "status", None))
            reason = self._last_since(known) or str(error)
            raise SimulationError(f"component '{self.name}', {doing}: {' '.join(reason.split())}") from None
        finally:
            self.seconds += perf_counter() - begin

    def take(self, status: str, text: str) -> None:
        """Keep a message."""
        self.messages.append((status, text))
        self.heard += 1

    def hear_warning(self, doing: str) -> None:
        """Be told that a call ended with a warning; kept where the FMU has not said a word of it."""
        if not any(kind == "warning" for kind, _ in self.messages):
            self._log(self.name, "warning", f"{doing} ended with a warning and no word of why")

    def begin(self) -> None:
        """The run begins: what was told before is no reason for what goes wrong in it."""
        self._begun = self.heard
        self._state = "running"

    def _last_since(self, known: int) -> str | None:
        """The last message that is more than a warning, of those after the first `known`."""
        fresh = list(self.messages)[max(0, len(self.messages) - (self.heard - known)) :]
        return next((text for kind, text in reversed(fresh) if kind != "warning"), None)

    @property
    def is_lost(self) -> bool:
        """Whether the FMU has returned fatal, or its process has died: it must not be touched any more."""
        return self._state == "lost"

    @property
    def has_failed(self) -> bool:
        """Whether the FMU has returned an error: it may only be put back to a saved state, reset or freed."""
        return self._state == "failed"

    def note(self, status: int | None) -> None:
        """What a status means for the calls that are still allowed: after fmiFatal none."""
        if status == FATAL:
            self._state = "lost"

    def failure(self, doing: str, status: int, t: float | None = None) -> SimulationError:
        """The error of a call that returned a status, with the FMU's last message."""
        self.note(status)
        known = 0 <= status < len(STATUS)
        told = f"{self.prefix}{STATUS[status].capitalize()}" if known else f"{status}, which is no status of FMI"
        reason = self._last_since(self._begun) or f"the FMU returned {told}"
        at = "" if t is None else f" at t = {t:g} s"
        return SimulationError(f"component '{self.name}', {doing}{at}: {' '.join(reason.split())}", t)

    @property
    def prefix(self) -> str:
        """What names of its FMI version begin with."""
        return f"fmi{self.version[0]}" if self.version != "1.0" else "fmi"


def address_of(function: Any) -> int:
    """Address of a function of a library; raises `PackageError` for one that it lacks."""
    if isinstance(function, FunctionType):  # stands for a missing one, and says so
        function()
    return int(ctypes.cast(function, ctypes.c_void_p).value or 0)


def _unit(unit: Any) -> Unit:
    base = unit.baseUnit
    if base is None:
        return named(unit.name) or Unit(unit.name, None)
    exponents = {key: int(getattr(base, key, 0) or 0) for key in BASE}
    exponents = {key: power for key, power in exponents.items() if power}
    return Unit(unit.name, exponents, float(base.factor or 1.0), float(base.offset or 0.0))


def _is_number(value: Any) -> bool:
    try:
        float(value)
    except (TypeError, ValueError):
        return False
    return True


def _listed(text: str) -> Any:
    """The texts of a list such as ["a", "b"] in JSON; what is none is one text."""
    try:
        found = json.loads(text)
    except (ValueError, RecursionError):
        return text
    return tuple(found) if all(isinstance(v, str) for v in found) else text


def _whole(value: Any) -> int:
    if isinstance(value, (int, np.integer)):
        return int(value)
    try:
        return int(str(value).strip())
    except ValueError:
        number = float(value)
        if number != int(number):
            raise
        return int(number)


def _bytes(value: Any, where: str) -> bytes:
    try:
        return bytes.fromhex(str(value))
    except ValueError:
        raise ParameterError(f"{where} = {value!r} is not hexadecimal") from None
