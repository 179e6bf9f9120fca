"""An FMU in a process of its own: when it crashes or hangs, the master goes on living and says so.

The worker process (`worker`) holds the real instance. Messages go through a pipe; what a step needs is sent without
waiting, and only reading the outputs waits, so FMUs that are stepped side by side also run side by side.
"""

from __future__ import annotations

import contextlib
import os
import pickle
import select
import signal
import subprocess
import sys
from collections.abc import Sequence
from multiprocessing.connection import Connection, Pipe
from pathlib import Path
from time import monotonic
from typing import Any

from ...core.errors import CosimError, Interrupted, PackageError, SimulationError
from ...core.scratch import make_scratch
from ..engine.loop import U8
from ..engine.program import Program
from ..slaves.base import FmuInstance, Log
from ..slaves.siblings import Siblings
from . import exchange, plain_pickle

KEPT = ("PATH", "LANG", "LC_ALL", "LD_LIBRARY_PATH", "HOME", "TMPDIR", "VIRTUAL_ENV")
KEPT_PARTS = ("PYTHON", "NUMBA", "DEEPSEA", "LICENSE")
"""Environment variables that a worker gets, and parts of the names of others."""

START_UP = 120.0
"""Time that an FMU has to be loaded and initialised [s]."""

LAST_CALL = 4.0
"""Time that the call under way has once the run is asked to end, where its state is wanted [s]: a little less than the
master waits for FMUs in its own process."""

POLL_MS = 100
"""Time after which it is looked whether the run is to end [ms]."""

ENDING = 5.0
"""Time that it has to be terminated and freed [s]."""


def supported() -> bool:
    """Whether a process can inherit a pipe here, and be waited for (not on Windows)."""
    return os.name == "posix" and hasattr(select, "poll")


class IsolatedInstance(FmuInstance):
    """Stands for an instance that lives in another process."""

    def __init__(
        self, real: FmuInstance, step_timeout: float | None = None, interrupt: list[int] | None = None,
        saves: bool = False, sandbox: bool = False,
    ):  # fmt: skip
        """saves: the state is wanted where the run is asked to end (`interrupt`); sandbox: the process may write into
        its own folders only, and use no network."""
        self._sandbox = sandbox
        self._place: Path | None = None
        self._patience = LAST_CALL if saves else 0.0
        super().__init__(real.name, real.folder, real.description)
        self.types, self.version, self.limits = real.types, real.version, real.limits  # type: ignore[misc]
        self._structural = real._structural
        self._kind, self._real = type(real), real
        self.negated = real.negated
        self._timeout, self._interrupt = step_timeout, interrupt if interrupt is not None else []
        self._process: subprocess.Popen[bytes] | None = None
        self._current_call, self._time = "being loaded", 0.0
        # what the worker has not been told yet, for it is woken once for a step
        self._operations, self._inputs = b"", b""
        self._step_interval = 0.0, 0.0
        """Start and length of the step [s]."""
        self._outputs_requested = False
        """Whether the outputs after a step have been asked for, and not been read."""

    # messages

    def start_process(self) -> None:
        self._start()

    def load(self, log: Log) -> None:
        self._log = log
        try:
            self._await_loaded()
        except PackageError as error:
            folders = Siblings(self.folder).folders(str(error))
            if not folders:
                raise
            self._kill()
            self._start(folders)
            self._await_loaded()
        self._state = "instantiated"

    def _start(self, folders: Sequence[str] = ()) -> None:
        """Start the worker, which loads the FMU; folders: where it looks for libraries first."""
        ours, theirs = Pipe()
        environment = {k: v for k, v in os.environ.items() if k in KEPT or any(part in k for part in KEPT_PARTS)}
        environment["PYTHONPATH"] = os.pathsep.join(p for p in sys.path if p)
        if folders:
            usual = os.environ.get("LD_LIBRARY_PATH")
            environment["LD_LIBRARY_PATH"] = os.pathsep.join([*folders, *([usual] if usual else [])])
        own = [str(self.folder)]
        if self._sandbox:
            environment["TMPDIR"] = str(self._scratch())
            own.append(environment["TMPDIR"])
        command = [sys.executable, "-m", f"{__package__}.worker", str(theirs.fileno())]
        self._process = subprocess.Popen(
            command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
            pass_fds=(theirs.fileno(),), env=environment, start_new_session=True,
        )  # fmt: skip
        theirs.close()
        self._pipe: Connection = ours
        self._poll = select.poll()
        self._poll.register(ours, select.POLLIN)
        setup = {
            "kind": self._kind, "name": self.name, "folder": self.folder, "structural": self._structural,
            "substeps": self.substeps, "inputs": self.input_groups, "outputs": self.output_groups,
            "out_parameters": self.out_parameters, "buffer_sizes": self._buffer_sizes(), "texts": self.texts,
            "message_log": self.message_log, "writable": own if self._sandbox else None,
        }  # fmt: skip
        self._pipe.send_bytes(pickle.dumps(setup))

    def _scratch(self) -> Path:
        """Where an FMU in a sandbox may put what it needs for a while."""
        if self._place is None:
            self._place = make_scratch("sandbox")
        return self._place

    def _await_loaded(self) -> None:
        if self._process is None:
            self._start()
        try:
            self._receive(START_UP)
        except Interrupted:
            raise
        except SimulationError as error:
            raise PackageError(str(error)) from None

    def _buffer_sizes(self) -> dict[str, dict[int, int]]:
        """How large the worker's buffer has to be: slots, texts and staging areas up to the end of each group."""
        sizes: dict[str, dict[int, int]] = {"slots": {0: 0}, "texts": {0: 0}, "stages": {}}
        for g in (*self.input_groups, *self.output_groups):
            kind = "texts" if g.fmi_type.family == "text" else "slots"
            sizes[kind][0] = max(sizes[kind][0], g.place + g.count)
            if g.fmi_type.width is not None:
                sizes["stages"][g.fmi_type.width] = max(sizes["stages"].get(g.fmi_type.width, 0), g.stage + g.count)
        sizes["stages"][U8] = max(sizes["stages"].get(U8, 0), self.out_parameters + 16)
        return sizes

    def _receive(self, timeout: float | None, interruptible: bool = True) -> Any:
        """The worker's next answer; its messages on the way go to the log. interruptible: an interrupt is not
        waited out."""
        end = None if timeout is None else monotonic() + timeout
        asked = None
        while True:
            try:
                while not self._poll.poll(POLL_MS):
                    if end is not None and monotonic() > end:
                        self._kill()
                        doing = f"{self._current_call} within {timeout:g} s{self._at()}"
                        raise SimulationError(f"component '{self.name}' did not come back from {doing}", self._when())
                    asked = monotonic() if self._interrupt and asked is None else asked
                    if interruptible and asked is not None and monotonic() - asked >= self._patience:
                        self._kill()
                        doing = self._current_call
                        where = f"component '{self.name}' was {doing if doing.startswith('being ') else f'in {doing}'}"
                        raise Interrupted(f"interrupted while {where}", self._time)
                message = self._pipe.recv_bytes()
                if exchange.is_step(message):
                    return message
                kind, content = plain_pickle.loads(message)
            except (EOFError, OSError):
                raise self._died() from None
            except (pickle.UnpicklingError, ValueError, TypeError):
                self._kill()
                raise SimulationError(f"component '{self.name}' says what no FMU says", self._when()) from None
            if kind == "log":
                self._log(*content)
            elif kind == "error":
                name, text, lost = content
                self._state = "lost" if lost else self._state
                raise PackageError(text) if name == "PackageError" else SimulationError(text, self._when())
            else:
                return content

    def _when(self) -> float | None:
        return self._time if self._current_call == "doStep" else None

    def _at(self) -> str:
        return "" if (t := self._when()) is None else f" at t = {t:g} s"

    def _died(self) -> SimulationError:
        assert self._process is not None
        code = self._process.wait()
        self._state = "lost"
        how = f"ended its process (exit code {code})"
        if code < 0:
            with contextlib.suppress(ValueError):
                how = f"crashed ({signal.Signals(-code).name})"
        where = f"in {self._current_call}{self._at()}"
        return SimulationError(f"component '{self.name}' {how} {where}", self._when())

    def _kill(self) -> None:
        if self._process is not None:
            with contextlib.suppress(OSError):
                self._process.kill()
            self._process.wait()
        self._state = "lost"

    def _send(self, message: bytes) -> None:
        try:
            self._pipe.send_bytes(message)
        except OSError:
            raise self._died() from None

    def _send_message(self, *message: Any) -> None:
        """Send a message, and before it what was waiting."""
        self._flush()
        self._send(pickle.dumps(message))

    def _flush(self, operation: bytes = b"") -> None:
        """Let the worker do what was waiting, and one operation more."""
        if operations := self._operations + operation:
            message = exchange.request(operations, *self._step_interval, self._inputs)
            self._operations, self._inputs = b"", b""
            self._send(message)

    def _queue(self, operation: bytes) -> None:
        """Let an operation wait; one that waits already has to be done before."""
        if operation in self._operations:
            self._flush()
        self._operations += operation

    def _call(self, method: str, *arguments: Any) -> Any:
        if self._outputs_requested:  # what a run that has failed did not read any more
            self._outputs_requested = False
            with contextlib.suppress(CosimError):
                self._receive(START_UP)
        self._current_call = method
        self._send_message("call", method, arguments)
        return self._receive(START_UP)

    # what the engine does

    def write_inputs(self, program: Program) -> None:
        buffer, values = program.buffer, exchange.SignalBytes(self.input_groups)

        def send(_t: float, _h: float) -> int:
            self._current_call = "setting the inputs"
            self._queue(exchange.SET)
            self._inputs = values.pack(buffer)
            return 0

        program.python(send, None, "setting the inputs")

    def write_step(self, program: Program, may_be_restored: bool) -> None:
        """Whether it did step is known when its outputs are read."""

        def send(t: float, h: float) -> int:
            self._current_call, self._time = "doStep", t
            self._queue(exchange.STEP)
            self._step_interval = t, h
            self._flush(exchange.GET)
            self._outputs_requested = True
            return 0

        program.python(send, None, "doStep")

    def write_outputs(self, program: Program) -> None:
        buffer, number, values = program.buffer, program.number(self), exchange.SignalBytes(self.output_groups)

        def receive(_t: float, _h: float) -> int:
            if not self._outputs_requested:
                self._flush(exchange.GET)
            self._outputs_requested = False
            ended, seconds, content = exchange.read_reply(self._receive(self._timeout))
            if ended:
                buffer.ended[0] = number + 1
            self.seconds += seconds
            values.unpack(content, buffer)
            self._current_call = "reading the outputs"
            return 0

        program.python(receive, None, "reading the outputs")

    def last_successful_time(self) -> float | None:
        time: float | None = self._call("last_successful_time")
        return time

    # the life of an instance

    def set_start(self, name: str, value: Any) -> None:
        self._call("set_start", name, value)

    def get(self, name: str) -> Any:
        return self._call("get", name)

    def enter_initialisation(self, start: float, stop: float) -> None:
        self._call("enter_initialisation", start, stop)
        self._state = "initialising"

    def exit_initialisation(self) -> None:
        self._call("exit_initialisation")
        self._state = "running"

    def reset(self) -> None:
        self._call("reset")
        self._state = "instantiated"

    def free(self) -> None:
        if self._process is None:
            return
        if self._state not in ("new", "lost", "freed"):
            self._current_call = "being ended"
            try:
                self._send_message("free")
                self.termination_error = self._receive(ENDING, interruptible=False)
            except SimulationError as error:
                self.termination_error = str(error)
        with contextlib.suppress(subprocess.TimeoutExpired, OSError):
            self._process.kill()
            self._process.wait(ENDING)
        self._state = "freed"

    @property
    def can_restore(self) -> bool:
        return self._real.can_restore

    @property
    def lacks_serialising(self) -> str:
        return self._real.lacks_serialising

    def save(self) -> Any:
        return self._call("save")  # its number: the state itself stays where it is

    def restore(self, state: Any) -> None:
        self._call("restore", state)

    def drop(self, state: Any) -> None:
        self._call("drop", state)

    def serialise(self, state: Any) -> bytes:
        content: bytes = self._call("serialise", state)
        return content

    def deserialise(self, content: bytes) -> Any:
        return self._call("deserialise", content)

    def settable(self, name: str) -> bool:
        return self._real.settable(name)

    def _known_feedthrough(self, output: str) -> list[str] | None:
        self._real.detected_feedthrough = self.detected_feedthrough
        return self._real.direct_feedthrough(output)

