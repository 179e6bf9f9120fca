"""One instance of an FMU, whatever the FMI version: values by the variable table, life, state, faults.

What pythonfmu and pythonfmu3 leave to be desired and this adds: range checks with messages that name variable, value
and range; errors as fmi2Error with a traceback for bugs, instead of fmi2Fatal, which destroys the instance; complete
state; inputs that act on outputs before the next step.

Both libraries turn every exception into a fatal fault and free the Python object. So no exception may leave a method.
The fault goes to the log with status error, and the front library (`front/front.c`, FMI 2.0) returns the worst status
that was logged during a call. Without the front library the exception is let through.

The front library knows the instance's memory: it reads and writes variables, and makes steps, without Python.
"""

from __future__ import annotations

import ctypes
import json
import sys
import threading
import traceback
from collections.abc import Callable
from functools import cache, wraps
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from ..core.errors import CosimError, ParameterError, SimulationError
from ..core.jit import address_of, called
from ..core.variables import Variable, VariableTable

INSTANTIATED, INITIALISING, RUNNING, TERMINATED = (
    "instantiation", "enterInitializationMode", "exitInitializationMode", "terminate"
)  # fmt: skip
"""Phases of an instance's life, named after what began them."""

_thread = threading.local()


def keep_thread_state() -> None:
    """Keep this thread's Python state alive between calls: an importer that is not Python pays 2 us a call, not 20."""
    if not getattr(_thread, "kept", False):
        ctypes.pythonapi.PyGILState_Ensure()
        _thread.kept = True


def reported(otherwise: Any) -> Callable[..., Any]:
    """Decorator: an exception is logged as fmi2Error and `otherwise` returned; see the module's text."""

    def decorate(method: Callable[..., Any]) -> Callable[..., Any]:
        @wraps(method)
        def guarded(self: Instance, *args: Any) -> Any:
            try:
                return method(self, *args)
            except Exception as error:
                self.log_error(error)
                if not self.has_front:
                    raise
                return otherwise(*args) if callable(otherwise) else otherwise

        return guarded

    return decorate


def _role(variable: Variable) -> int:
    """What a variable is to the front library: 0 not real, 1 a real input, 2 a real output, 3 another real one."""
    return {"input": 1, "output": 2}.get(variable.causality, 3) if variable.kind == "Real" else 0


@cache
def _columns(kind: type[Instance]) -> tuple[Any, ...]:
    """Of a class's table: starts, least and greatest values, types, which are outputs, roles; for all its instances."""
    table = kind.table
    return (
        np.array([0.0 if v.start is None else v.start for v in table], dtype=np.float64),
        np.array([-np.inf if v.min is None else v.min for v in table]),
        np.array([np.inf if v.max is None else v.max for v in table]),
        tuple(v.kind for v in table),
        frozenset(i for i, v in enumerate(table) if v.causality == "output"),
        np.array([_role(v) for v in table], dtype=np.uint8),
    )


def _nan(vrs: list[int]) -> list[float]:
    return [float("nan")] * len(vrs)


class Instance:
    """Base of the project's FMUs. A subclass names its table and its step, and implements `build` and `heed`.

    The step is a kernel with the signature `core.jit.STEP`: of the instance's values and the row that `build` has made
    of its model, the time and how far to go; with 0 it only writes the outputs. It returns 0 or a code. While the
    instance runs, the front library calls it by itself, and Python only where it returned a code.

    Mixed into the slave class of pythonfmu or pythonfmu3, which gives `log`, `resources`, `instance_name`, `modelName`.
    """

    table: ClassVar[VariableTable]
    step: ClassVar[Any] = None
    statuses: ClassVar[Any]
    """Names of the FMI version's statuses."""
    describe: ClassVar[Callable[..., Any]]
    """Makes the FMI version's model description; a static method."""
    author = "deepsea-cosim"
    license = "MIT"

    def __init__(self, **kwargs: Any):
        super().__init__(**kwargs)
        keep_thread_state()
        marker = Path(self.resources or ".") / "front.txt"
        self.has_front = marker.is_file() and marker.read_text().strip() == sys.platform
        start, self._low, self._high, self._kinds, self._outputs, roles = _columns(type(self))
        self.values, self._roles = start.copy(), roles.copy()
        self._inputs = np.flatnonzero(self._roles == 1)
        self._stale = np.ones(1, dtype=np.int32)
        self._pending = np.zeros(1, dtype=np.int64)
        """What a step has returned that the front library made, for `advance` to go on from."""
        self.row = np.zeros(0)
        first, behind = min(self._outputs), max(self._outputs) + 1
        self.out = self.values[first:behind]
        """The outputs' part of `values`; the table has them in a row."""
        self._zeros = np.zeros(len(self.out))
        self._clock = np.zeros(1)
        self.phase = INSTANTIATED
        self._restoring = False
        self._goes_by = (self._clock, self.values[:first], self.values[behind:])
        """All that `build` goes by: the time, parameters and inputs."""
        self._built_from = b""
        """What the model was last built from; nothing where it has moved on since."""
        if self.has_front:
            arrays = (self.values, self._low, self._high, self._roles, self._stale, self._clock, self._pending)
            places = " ".join(f"{array.ctypes.data:#x}" for array in arrays)
            self.log(f"variables {places} {len(self.values)}", self.statuses.ok, "front")

    def _tell_step(self) -> None:
        """Let the front library make steps by itself while the instance runs, and only then."""
        if self.has_front and self.step is not None:
            address = address_of(self.step) if self.running else 0
            _, _, row, size = self._at
            self.log(f"step {address:#x} {row:#x} {size}", self.statuses.ok, "front")

    @property
    def row(self) -> np.ndarray:
        """All numbers that the step needs beside the values, and what it remembers, float64."""
        return self._row

    @row.setter
    def row(self, row: np.ndarray) -> None:
        self._row = row
        self._at = (self.values.ctypes.data, len(self.values), row.ctypes.data, len(row))

    @property
    def time(self) -> float:
        """Where the instance is [s]; the front library reads it too."""
        return self._clock.item()

    @time.setter
    def time(self, value: float) -> None:
        self._clock[0] = value

    # what a subclass provides

    def build(self, parameters: dict[str, float]) -> None:
        """Make the model in its initial state, and its row, from checked parameters and the present inputs."""
        raise NotImplementedError

    def heed(self, code: int, t: float, h: float) -> bool:
        """Raise or warn for a code of the step from t over h [s]; returns whether it has yet to be made."""
        raise NotImplementedError

    def advance(self, t: float, h: float) -> None:
        """Advance the model from t over h [s] and write the outputs at t + h into `out`."""
        code, self._pending[0] = self._pending.item(), 0
        if not code:
            code = self._step(t, h)
        while code > 0 and self.heed(code, t, h):
            code = self._step(t, h)

    def outputs(self) -> None:
        """Write the outputs for the present state and inputs into `out`."""
        self._step(self.time, 0.0)

    def _step(self, t: float, h: float) -> int:
        return called(self.step)(*self._at, t, h)

    def get_model_state(self) -> dict[str, Any]:
        """Everything in the model that time changes."""
        raise NotImplementedError

    def set_model_state(self, state: dict[str, Any]) -> None:
        """Restore what `get_model_state` gave."""
        raise NotImplementedError

    # FMI calls

    def to_xml(self, model_options: dict[str, str] | None = None) -> Any:
        """The complete model description, from the variable table."""
        return self.describe(
            self.modelName, self.table, str(self.guid), self.description or "", {**(model_options or {})}
        )

    @property
    def running(self) -> bool:
        """Whether the model stands and takes steps."""
        return self.phase == RUNNING

    def _expect(self, call: str, *phases: str) -> None:
        if self.phase not in phases:
            raise SimulationError(f"{call} was called after {self.phase}")

    @reported(None)
    def setup_experiment(self, start_time: float, stop_time: float | None = None, *_: Any) -> None:
        self._expect("setupExperiment", INSTANTIATED)
        if not np.isfinite(start_time) or (stop_time is not None and not stop_time >= start_time):
            raise ParameterError(f"a run from {start_time:g} s to {stop_time} s is none")
        self.time = start_time
        self._stale[0] = 1

    @reported(None)
    def enter_initialization_mode(self) -> None:
        self._expect("enterInitializationMode", INSTANTIATED)
        self.phase = INITIALISING

    @reported(None)
    def exit_initialization_mode(self) -> None:
        self._expect("exitInitializationMode", INITIALISING)
        self._refresh()
        self.phase = RUNNING
        self._tell_step()

    @reported(None)
    def terminate(self) -> None:
        self._expect("terminate", INITIALISING, RUNNING)
        self.phase = TERMINATED
        self._admit()
        self._tell_step()

    @reported(False)
    def do_step(self, current_time: float, step_size: float) -> bool:
        keep_thread_state()
        if not self.running:
            when = "after terminate" if self.phase == TERMINATED else "before the initialization was finished"
            raise SimulationError(f"doStep was called {when}")
        if not 0.0 < step_size < float("inf"):
            raise ParameterError(f"communication step size = {step_size:g} s; it has to be positive")
        if not abs(current_time - self.time) <= 1e-9 * max(1.0, abs(self.time)):
            raise SimulationError(f"doStep at t = {current_time:g} s, but the FMU is at t = {self.time:g} s")
        self.advance(current_time, step_size)
        self.time = current_time + step_size
        self._settle()
        return True

    @reported(_nan)
    def read(self, vrs: list[int]) -> list[float]:
        """Values of real variables; outputs are brought up to date first."""
        self._known(vrs, "Real")
        if self._stale[0] and not self._outputs.isdisjoint(vrs):
            self._refresh()
        return list(map(self.values.item, vrs))

    @reported(lambda vrs: [0] * len(vrs))
    def get_integer(self, vrs: list[int]) -> list[int]:
        self._known(vrs, "Integer")
        return [int(self.values[i]) for i in vrs]

    @reported(lambda vrs: [False] * len(vrs))
    def get_boolean(self, vrs: list[int]) -> list[bool]:
        self._known(vrs, "Boolean")
        return [bool(self.values[i]) for i in vrs]

    @reported(lambda vrs: [""] * len(vrs))
    def get_string(self, vrs: list[int]) -> list[str]:
        if vrs:
            raise ParameterError("this FMU has no string variables")
        return []

    @reported(None)
    def write(self, vrs: list[int], values: list[float]) -> None:
        """Set real variables."""
        self._set(vrs, values, "Real")

    @reported(None)
    def set_integer(self, vrs: list[int], values: list[int]) -> None:
        self._set(vrs, values, "Integer")

    @reported(None)
    def set_boolean(self, vrs: list[int], values: list[bool]) -> None:
        self._set(vrs, values, "Boolean")

    @reported(None)
    def set_string(self, vrs: list[int], values: list[str]) -> None:
        if vrs:
            raise ParameterError("this FMU has no string variables")

    @reported(dict)
    def _get_fmu_state(self) -> dict[str, Any]:
        return self._present()

    def _present(self) -> dict[str, Any]:
        """All that time changes, and what was set."""
        return {
            "model_name": self.modelName,
            "values": self.values.copy(),
            "time": self.time,
            "phase": self.phase,
            "stale": int(self._stale[0]),
            # before the run the model follows from the values
            "model": self.get_model_state() if self.phase in (RUNNING, TERMINATED) else None,
        }

    @reported(None)
    def _set_fmu_state(self, state: dict[str, Any]) -> None:
        if state.get("model_name") != self.modelName or len(state.get("values", ())) != len(self.values):
            raise ParameterError(f"this is not a state of {self.modelName}")
        before = self._present()
        try:
            self._restore(state)
        except Exception:
            self._restore(before)
            raise

    def _restore(self, state: dict[str, Any]) -> None:
        """Back to what `_present` gave."""
        self.values[:] = state["values"]
        self.time, self.phase, self._built_from = state["time"], state["phase"], b""
        if state["model"] is not None:
            self._restoring = True
            try:
                self.build(self._parameters())
            finally:
                self._restoring = False
            self.set_model_state(state["model"])
        self.values[:] = state["values"]
        self._stale[0] = state["stale"]
        self._admit()
        self._tell_step()

    def _admit(self) -> None:
        """Let the front library write inputs by itself, but not after terminate."""
        self._roles[self._inputs] = 3 if self.phase == TERMINATED else 1

    @staticmethod
    def _fmu_state_to_bytes(state: dict[str, Any]) -> bytes:
        return json.dumps(state, default=np.ndarray.tolist).encode()

    @staticmethod
    def _fmu_state_from_bytes(state: bytes) -> dict[str, Any]:
        try:
            found = json.loads(state.rstrip(b"\0"))  # what the importer's memory had too much
        except ValueError:
            return {}  # an exception would cost the instance; setting this state reports it
        return found if isinstance(found, dict) else {}

    # helpers

    def warn(self, text: str) -> None:
        """Log a warning; what is to be said of a start has no meaning where a state is restored."""
        if not self._restoring:
            self._tell(text, self.statuses.warning)

    def _tell(self, text: str, status: Any) -> None:
        """Log a text, which is a printf format for the importer; the front library sees to that itself."""
        self.log(text if self.has_front else text.replace("%", "%%"), status)

    def log_error(self, error: Exception) -> None:
        """Log an error: its text for a user's mistake, the traceback as well for a fault of ours."""
        text = str(error) if isinstance(error, CosimError) else traceback.format_exc().strip()
        self._tell(text, self.statuses.error)
        if not self.has_front:  # pythonfmu alone drops the log of a call that raises
            print(f"{self.instance_name}: {text}", file=sys.stderr)

    def _parameters(self) -> dict[str, float]:
        values = self.values.tolist()
        return {v.name: values[i] for i, v in enumerate(self.table) if v.causality == "parameter"}

    def _set(self, vrs: list[int], values: list[Any], kind: str) -> None:
        """Set all the values or, when one of them is wrong, none."""
        self._known(vrs, kind)
        if self.phase == TERMINATED:
            raise SimulationError("nothing can be set after terminate")
        for i, value in zip(vrs, values, strict=True):
            variable = self.table[i]
            if kind != "Boolean":
                variable.check(value)
            self._may_set(i)
        self.values[vrs] = values
        self._stale[0] = 1

    def _known(self, vrs: list[int], kind: str) -> None:
        """Value references of variables of that type; pythonfmu hands over those beyond 2^31 as negative numbers."""
        for i in vrs:
            if not 0 <= i < len(self.values):
                raise ParameterError(f"there is no variable with the value reference {i % 2**32}")
            if self._kinds[i] != kind:
                raise ParameterError(f"'{self.table[i].name}' is of type {self.table[i].kind}, not {kind}")

    def _may_set(self, i: int) -> None:
        variable = self.table[i]
        if variable.causality == "output":
            raise ParameterError(f"output '{variable.name}' cannot be set")
        if self.running and variable.causality == "parameter":
            raise ParameterError(f"parameter '{variable.name}' is fixed; it can only be set before the run starts")

    def _refresh(self) -> None:
        """Bring the outputs up to date with inputs and parameters."""
        if self.phase in (INSTANTIATED, INITIALISING):
            given = b"".join(x.tobytes() for x in self._goes_by)
            if given != self._built_from:  # importers read and set in turn until all is consistent
                self.build(self._parameters())
                self._built_from = given
        self.outputs()
        self._settle()

    def _settle(self) -> None:
        """Declare the outputs up to date after a look at whether they are finite."""
        if self.out.dot(self._zeros) != 0.0:  # 0 * inf and 0 * NaN are NaN
            names = [v.name for v in self.table.of("output")]
            bad = [f"{name} = {value:g}" for name, value in zip(names, self.out, strict=True) if not np.isfinite(value)]
            raise SimulationError(f"not finite at t = {self.time:g} s: {', '.join(bad)}", self.time)
        self._stale[0] = 0
