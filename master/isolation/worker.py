"""The process of an isolated FMU: loads it, obeys the messages of `IsolatedInstance`, and ends with its master."""

from __future__ import annotations

import ctypes
import os
import pickle
import sys
from contextlib import suppress
from multiprocessing.connection import Connection
from typing import Any

import numpy as np

from ...core.errors import CosimError
from ..engine.program import Program, ValueBuffer
from ..engine.runner import Runner
from ..slaves.fmu import describe_folder
from . import exchange, sandbox

DIE_WITH_PARENT = 1
NEW_USER, NEW_NET = 0x10000000, 0x40000000


def drop_rights() -> None:
    """Give up what an FMU hardly needs: new privileges, core dumps and, where the system lets us, the network."""
    with suppress(ImportError, OSError, ValueError):
        import resource

        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    if sys.platform.startswith("linux"):
        with suppress(OSError, AttributeError):
            libc = ctypes.CDLL(None)
            libc.prctl(DIE_WITH_PARENT, 9, 0, 0, 0)
            libc.prctl(sandbox.NO_NEW_PRIVILEGES, 1, 0, 0, 0)
            libc.unshare(NEW_USER | NEW_NET)


class Worker:
    """One FMU and the pipe to its master."""

    def __init__(self, pipe: Connection, setup: dict[str, Any]):
        self.pipe = pipe
        self.instance = describe_folder(setup["name"], setup["folder"])
        self.instance._structural = setup["structural"]
        self.instance.substeps, self.instance.out_parameters = setup["substeps"], setup["out_parameters"]
        self.instance.input_groups, self.instance.output_groups = setup["inputs"], setup["outputs"]
        self.instance.texts = setup["texts"]
        self.instance.message_log = setup["message_log"]
        self.writable: list[str] | None = setup["writable"]
        self.time: float | None = None
        """Start of the step that is under way [s]; None before the initialisation."""
        if self.instance.message_log is not None:
            self.instance.message_log.clock = lambda: self.time
            self.instance.message_log.open()  # before the master puts it in its place
        sizes = setup["buffer_sizes"]
        self.buffer = ValueBuffer(sizes["slots"][0], sizes["texts"][0], sizes["stages"])
        self.inputs = exchange.SignalBytes(setup["inputs"])
        self.outputs = exchange.SignalBytes(setup["outputs"])
        self.runners: dict[bytes, Runner] = {}
        """By the operations that it does."""
        self.fault: CosimError | None = None
        self.rows = np.zeros((1, 0))
        self.seconds = 0.0
        """Time in doStep that has not been told [s]."""
        self.states: dict[int, Any] = {}

    def send(self, kind: str, content: Any) -> None:
        self.pipe.send_bytes(pickle.dumps((kind, content)))

    def load(self) -> None:
        if self.writable is not None:
            sandbox.restrict(self.writable)
        self.instance.load(lambda *message: self.log(*message))
        for operations in (b"", exchange.STEP, exchange.SET + exchange.STEP):
            for end in (b"", exchange.GET):
                self.runner(operations + end)

    def runner(self, operations: bytes) -> Runner:
        """The program that does these operations."""
        if operations not in self.runners:
            program = Program(self.buffer, [self.instance])
            write = {
                exchange.SET: program.set_inputs, exchange.STEP: program.do_step, exchange.GET: program.get_outputs
            }  # fmt: skip
            for k in range(len(operations)):
                write[operations[k : k + 1]](self.instance)
            self.runners[operations] = Runner(program)
        return self.runners[operations]

    def log(self, component: str, status: str, text: str) -> None:
        self.instance.keep_message(status, text)
        self.send("log", (component, status, text))

    def step(self, message: bytes) -> None:
        """Operations of a step; what goes wrong is told when the outputs are asked for."""
        operations, t, h, inputs = exchange.read_request(message)
        if exchange.SET in operations:
            self.inputs.unpack(inputs, self.buffer)
        runner, steps = self.runner(operations), exchange.STEP in operations
        if self.fault is None:
            try:
                if steps:
                    self.time = t
                    runner.run(self.rows, t, h, 0, 1, 2, t + h)
                else:
                    runner.once()
            except CosimError as error:
                self.fault = error
        self.seconds += float(runner.seconds[0])
        runner.seconds[0] = 0.0
        if exchange.GET not in operations:
            return
        if self.fault is not None:
            fault, self.fault = self.fault, None
            raise fault
        seconds, self.seconds = self.seconds, 0.0
        ended, self.buffer.ended[0] = bool(self.buffer.ended[0]), 0
        self.pipe.send_bytes(exchange.reply(ended, seconds, self.outputs.pack(self.buffer)))

    def call(self, message: tuple[Any, ...]) -> None:
        """A call of one of the instance's functions."""
        if message[1] in ("save", "deserialise"):
            number = max(self.states, default=-1) + 1
            self.states[number] = getattr(self.instance, message[1])(*message[2])
            self.send("done", number)
        elif message[1] in ("restore", "drop", "serialise"):
            number = message[2][0]
            state = self.states.pop(number) if message[1] == "drop" else self.states[number]
            self.send("done", getattr(self.instance, message[1])(state))
        else:
            if message[1] == "enter_initialisation":
                self.buffer.ended[:] = 0
                self.time = message[2][0]
            self.send("done", getattr(self.instance, message[1])(*message[2]))


def main() -> None:
    """Obey until the master is gone."""
    pipe = Connection(int(sys.argv[1]))
    drop_rights()
    setup = pickle.loads(pipe.recv_bytes())  # noqa: S301  of the master, which is to be obeyed
    try:
        worker = Worker(pipe, setup)
        worker.load()
        worker.send("done", None)
        while True:
            content = pipe.recv_bytes()
            message = () if exchange.is_step(content) else pickle.loads(content)  # noqa: S301
            if message == ("free",):
                break
            try:
                if message:
                    worker.call(message)
                else:
                    worker.step(content)
            except CosimError as error:
                worker.send("error", (type(error).__name__, str(error), worker.instance.is_lost))
    except (EOFError, OSError):
        os._exit(0)  # the master is gone
    except Exception as error:
        reason = str(error) if isinstance(error, CosimError) else f"{type(error).__name__}: {error}"
        text = f"component '{setup['name']}': {reason}"
        with suppress(OSError):
            pipe.send_bytes(pickle.dumps(("error", (type(error).__name__, text, True))))
        os._exit(1)
    worker.instance.free()
    with suppress(OSError):
        worker.send("done", worker.instance.termination_error)
    os._exit(0)


if __name__ == "__main__":
    main()
