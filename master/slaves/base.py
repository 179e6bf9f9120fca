"""One FMU behind the calls that a master needs, whatever its FMI version.

Life: `load`, `set_start`, `enter_initialisation`, `exit_initialisation`, steps, `free`; `reset` leads back to after
`load`. What happens in every step is not called here: `write_inputs`, `write_step` and `write_outputs` put it down in
a program of the engine.
"""

from __future__ import annotations

import ctypes
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from time import perf_counter
from types import FunctionType
from typing import Any

import numpy as np

from ...core.errors import CosimError, SimulationError
from ...core.guardian import tell
from ..engine.program import Program
from ..engine.values import ExchangeGroup, Signal
from .message_log import FATAL, STATUS, MessageLog
from .variables import FmuVariables

Log = Callable[[str, str, str], None]
"""Is told (component, status, text) of every message of an FMU."""


class FmuInstance(FmuVariables, ABC):
    """An FMU instance."""

    is_foreign = True
    """Whether code of others runs in it, which a process of its own can keep apart."""

    def __init__(self, name: str, folder: Path, description: Any):
        super().__init__(name, folder, description)
        self._log: Log = lambda *_: None
        self.message_log: MessageLog | None = None
        """Gets all messages, notes too; set before `load`."""
        self.messages: deque[tuple[str, str]] = deque(maxlen=100)
        """The last log messages: (status, text)."""
        self.message_count = 0
        """How many there have been."""
        self._begun = 0
        """How many until the run began."""
        self.seconds = 0.0
        """Wall time spent in the FMU's calls outside of steps [s]."""
        self.substeps = 1
        """Steps of the FMU in a macro step."""
        self.inputs: list[Signal] = []
        self.outputs: list[Signal] = []
        self.input_groups: list[ExchangeGroup] = []
        self.output_groups: list[ExchangeGroup] = []
        self.texts: set[str] = set()
        """Strings and binaries that are handed over at every step: of the inputs those that something drives (the
        others are set once, before the run), of the outputs those that are connected or recorded."""
        self.out_parameters = 0
        """Place of doStep's out parameters, or of its status, among the bytes of the staging area."""
        self.reached = np.full(1, np.nan)
        """Where doStep of FMI 3.0 says that the FMU has come to [s]."""
        self.negated: frozenset[str] = frozenset()
        """Variables that are the negative of what their value reference stands for; only FMI 1.0 has some."""
        self._in_call = ""
        """The call that the FMU is in, outside of steps."""
        self.termination_error = ""
        """What went wrong as the FMU was ended, once it is."""
        self._state = "new"
        self._keep: list[Any] = []

    # life

    def start_process(self) -> None:
        """Start the process that the FMU lives in, where it has one; it goes on by itself until `load`."""

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
        """Start and stop time [s], and the initialisation mode where there is one; of a stop time that is infinite the
        FMU is told nothing."""

    @abstractmethod
    def exit_initialisation(self) -> None:
        """From here on steps may be taken."""

    @abstractmethod
    def reset(self) -> None:
        """Back to the state after `load`: start values, ready for another run."""

    @abstractmethod
    def free(self) -> None:
        """Terminate and free; safe to call in any state, and never raises: `termination_error` has what goes wrong."""

    # what the engine does

    @abstractmethod
    def write_inputs(self, program: Program) -> None:
        """Write down: the inputs in the buffer are handed to the FMU."""

    @abstractmethod
    def write_outputs(self, program: Program) -> None:
        """Write down: the outputs of the FMU are read into the buffer."""

    @abstractmethod
    def write_step(self, program: Program, may_be_restored: bool) -> None:
        """Write down: the FMU advances over the macro step, in as many steps of its own as `substeps` says.

        may_be_restored: a state from before the step may be set after it.
        """

    def write_input_derivatives(self, program: Program, references: Sequence[int], changes: int) -> None:
        """Write down: the slopes of inputs are handed to the FMU, whose changes over the last step lie from the slot
        `changes` on."""
        raise NotImplementedError

    def last_successful_time(self) -> float | None:
        """Where an FMU came to [s] in a step that it did not take to its end; None where it does not say."""
        return None

    @property
    def interpolates_inputs(self) -> bool:
        """Whether the FMU carries its real inputs on through a step when it is told their slopes."""
        return False

    def directional_derivatives(self, outputs: Sequence[int], input: int) -> list[float] | None:
        """What outputs answer at once to a change of an input, by value references; None where the FMU does not say."""
        return None

    @property
    def runs_in_python(self) -> bool:
        """Whether its steps need Python's interpreter, which one FMU of a process has at a time: an FMU of pythonfmu
        without a front of ours."""
        resources = self.folder / "resources"
        return (resources / "slavemodule.txt").is_file() and not (resources / "front.txt").is_file()

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

    def drop(self, state: Any) -> None:
        """A saved state is not needed any more."""

    @contextmanager
    def dropping(self, state: Any) -> Iterator[None]:
        """Around the use of a saved state, which is dropped afterwards unless the FMU is lost.

        What goes wrong in that hides no error of the use, and is an error only where it is fatal to the FMU.
        """
        try:
            yield
        except BaseException:
            self._drop(state)
            raise
        if (error := self._drop(state)) is not None and self.is_lost:
            raise error

    def _drop(self, state: Any) -> CosimError | None:
        """What went wrong in dropping a state."""
        if not self.is_lost:
            try:
                self.drop(state)
            except CosimError as error:
                return error
        return None

    @property
    def lacks_serialising(self) -> str:
        """Why a state cannot be kept beyond the life of the instance; empty where it can."""
        if self.version == "1.0":
            return "FMI 1.0 has no states"
        if self.can_restore and getattr(self.description.coSimulation, "canSerializeFMUstate", False):
            return ""
        return f"it cannot serialise its state (canSerializeFMU{'S' if self.version == '3.0' else 's'}tate)"

    def serialise(self, state: Any) -> bytes:
        """A saved state as bytes, which another instance of the FMU understands."""
        raise SimulationError(f"component '{self.name}' cannot serialise its state")

    def deserialise(self, content: bytes) -> Any:
        """The state that has been serialised so, to be restored."""
        raise SimulationError(f"component '{self.name}' cannot restore a serialised state")

    # errors

    @property
    def in_call(self) -> str:
        """What the FMU has been called for and has not come back from."""
        return self._in_call

    @in_call.setter
    def in_call(self, doing: str) -> None:
        self._in_call = doing
        tell.call(self.name if doing else "", doing)

    def call(self, function: Callable[..., Any], *args: Any, doing: str, **kwargs: Any) -> Any:
        """Call a function of fmpy; a failure becomes a `SimulationError` with the FMU's own message."""
        begin, known = perf_counter(), self.message_count
        self.in_call = doing
        try:
            return function(*args, **kwargs)
        except Exception as error:
            self.note_status(getattr(error, "status", None))
            reason = self._last_since(known) or str(error)
            raise SimulationError(f"component '{self.name}', {doing}: {' '.join(reason.split())}") from None
        finally:
            self.in_call = ""
            self.seconds += perf_counter() - begin

    def keep_message(self, status: str, text: str) -> None:
        """Keep a message."""
        self.messages.append((status, text))
        self.message_count += 1

    def on_warning(self, doing: str) -> None:
        """Be told that a call ended with a warning; kept where the FMU has not said a word of it."""
        if not any(kind == "warning" for kind, _ in self.messages):
            self._log(self.name, "warning", f"{doing} ended with a warning and no word of why")

    def begin(self) -> None:
        """The run begins: what was told before is no reason for what goes wrong in it."""
        self._begun = self.message_count
        self._state = "running"

    def _last_since(self, known: int) -> str | None:
        """The last message that is more than a warning, of those after the first `known`."""
        fresh = list(self.messages)[max(0, len(self.messages) - (self.message_count - known)) :]
        return next((text for kind, text in reversed(fresh) if kind != "warning"), None)

    @property
    def is_lost(self) -> bool:
        """Whether the FMU has returned fatal, or its process has died: it must not be touched any more."""
        return self._state == "lost"

    @property
    def has_failed(self) -> bool:
        """Whether the FMU has returned an error: it may only be put back to a saved state, reset or freed."""
        return self._state == "failed"

    def note_status(self, status: int | None) -> None:
        """What a status means for the calls that are still allowed: after fmiFatal none."""
        if status == FATAL:
            self._state = "lost"

    def failure(self, doing: str, status: int, t: float | None = None) -> SimulationError:
        """The error of a call that returned a status, with the FMU's last message."""
        self.note_status(status)
        known = 0 <= status < len(STATUS)
        told = f"{self.prefix}{STATUS[status].capitalize()}" if known else f"{status}, which is no status of FMI"
        reason = self._last_since(self._begun) or f"the FMU returned {told}"
        at = "" if t is None else f" at t = {t:g} s"
        why = f"{' '.join(reason.split())}{self.lacking if doing == 'doStep' else ''}"
        return SimulationError(f"component '{self.name}', {doing}{at}: {why}", t)

    @property
    def lacking(self) -> str:
        """What may be the cause where it refuses to step or to be instantiated, for messages."""
        return " (its clocks need event mode, which is not supported)" if self.needs_event_mode else ""

    @property
    def prefix(self) -> str:
        """What names of its FMI version begin with."""
        return f"fmi{self.version[0]}" if self.version != "1.0" else "fmi"


def fmu_warnings(instances: Iterable[FmuInstance]) -> list[str]:
    """What FMUs warned of although their run came to its end."""
    return [f"{i.name}: {text}" for i in instances for kind, text in i.messages if kind == "warning"]


def address_of(function: Any) -> int:
    """Address of a function of a library; raises `PackageError` for one that it lacks."""
    if isinstance(function, FunctionType):  # stands for a missing one, and says so
        function()
    return int(ctypes.cast(function, ctypes.c_void_p).value or 0)
