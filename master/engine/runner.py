"""Runs a program: the compiled loop with its arrays, and what its reports mean."""

from __future__ import annotations

import ctypes
import sys
from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from ...core.errors import SimulationError
from ...core.guardian import tell
from . import loop
from .program import EngineInstance, Program
from .step_threads import NO_THREADS, StepThreads
from .values import Signal


@lru_cache
def _clock() -> int:
    """Address of clock_gettime, or 0 where there is none: then no times are taken."""
    if sys.platform == "win32":
        return 0
    try:
        return int(ctypes.cast(ctypes.CDLL(None).clock_gettime, ctypes.c_void_p).value or 0)
    except AttributeError:
        return 0


def last_step(start: float, h: float, total: int, stop: float) -> float:
    """Length [s] of the last of `total` steps: h itself, bit for bit, unless it would go beyond `stop` or is cut short.

    FMUs may refuse, or count their inner steps wrongly, where a step is one rounding error shorter than the others.
    """
    t = start + (total - 1) * h
    rounding = max(1e-6 * h, 4.0 * sys.float_info.epsilon * max(abs(start), abs(stop)))
    return h if t + h <= stop and stop - t - h <= rounding else stop - t


class Runner:
    """A program ready to run; `outputs` and `inputs` are the slots recorded at the start and at the end of a step."""

    def __init__(
        self, program: Program, outputs: Sequence[int] = (), inputs: Sequence[int] = (), finite: Sequence[Signal] = ()
    ):
        self.program = program
        self._operations, self._constants, self._tables = program.compiled()
        self._outputs = np.array(outputs, np.int64)
        self._inputs = np.array(inputs, np.int64)
        self._names = {s.place + k: s for s in finite for k in range(s.size)}
        self._finite = np.array(list(self._names), np.int64)
        self.seconds = np.zeros(max(1, program.numbered))
        """Wall time in doStep of the instances, as far as the program has them step [s]."""
        forked = any(row[0] == loop.FORK for row in program.rows)
        self._threads = StepThreads(self._operations, program.numbered) if forked else NO_THREADS
        self._report = np.zeros(6, np.int64)
        self._told = False
        self._nothing = np.zeros((1, 0))
        self.timed = True

    def tell_guardian(self, start: float, h: float) -> None:
        """Have the guardian see which step and which call of an FMU is under way."""
        labels = [(instance.name if instance is not None else "", doing) for instance, doing in self.program.labels]
        if (memory := tell.steps(start, h, labels)) is not None:
            self._report, self._told = np.frombuffer(memory, np.int64), True

    def spent(self, number: int) -> float:
        """Wall time in doStep of an instance, by its number [s]."""
        return float(self.seconds[number]) if number < len(self.seconds) else 0.0

    @property
    def width(self) -> int:
        """Columns of a row."""
        return len(self._outputs) + len(self._inputs)

    def run(
        self, rows: np.ndarray, start: float, h: float, first: int, count: int, total: int, stop: float,
        driven: np.ndarray | None = None, budget: float = 0.0,
    ) -> int:  # fmt: skip
        """Take the steps first ... first + count - 1, or as many as fit into `budget` seconds; how many were taken.

        An FMU may ask to end the run (`ended`): then they are fewer, too.

        Raises `SimulationError` with the time reached when an FMU fails or a value is not finite; `taken` then says how
        many rows are complete.
        """
        buffer, stages = self.program.buffer, self.program.buffer.stages
        self._report[:] = 0
        if self._told:
            tell.steps_before(first)
        clock = _clock() if self.timed else 0
        self._threads.begin(self._operations, stages[loop.U8], self.seconds, clock)
        loop.run(
            self._operations, self._constants, self._tables, buffer.reals, buffer.integers,
            stages[loop.I8], stages[loop.U8], stages[loop.I16], stages[loop.U16], stages[loop.I32], stages[loop.U32],
            stages[loop.F32], self._nothing if driven is None else driven, rows, self._outputs, self._inputs,
            self._finite, self.seconds, start, h, first, count, total, last_step(start, h, total, stop),
            clock, budget, buffer.ended, self._report, self._threads.control, self._threads.spans,
        )  # fmt: skip
        reason, done, operation, status, warned, when = (int(x) for x in self._report)
        self.taken = done
        if warned:
            instance, doing = self.program.labels[warned - 1]
            if instance is not None:
                instance.on_warning(f"{doing} at t = {start + (first + when) * h:g} s" if h > 0.0 else doing)
        if reason in (loop.DONE, loop.TIME_IS_UP, loop.ENDED):
            return done
        t = start + (first + done) * h if first + done < total else stop
        if reason == loop.NOT_FINITE:
            raise self.not_finite(t)
        self._note_others(operation)
        instance, doing = self.program.labels[operation]
        if self.program.error is not None:
            error, self.program.error = self.program.error, None
            raise error
        if status == loop.TOO_LARGE:
            told = self._too_large(operation)
            raise SimulationError(f"{told} at t = {t:g} s", t) if h > 0.0 else SimulationError(told)
        assert instance is not None
        if status == loop.RETURNED_EARLY:
            raise SimulationError(
                f"component '{instance.name}' came back early from its step at t = {t:g} s, which it was not "
                "allowed to", t
            )
        raise instance.failure(doing, status, t if h > 0.0 else None)

    def _note_others(self, operation: int) -> None:
        """What else went wrong where an operation has failed: behind a fork all steps are taken to their end."""
        rows, control = self.program.rows, self._threads.control
        for fork in (i for i, row in enumerate(rows[:operation]) if row[0] == loop.FORK and operation <= i + row[1]):
            for i in range(fork + 1, fork + 1 + rows[fork][1]):
                instance, status = self.program.labels[i][0], int(control[loop.STATUS + i])
                if instance is not None and i != operation and loop.WARNING < status < loop.RETURNED_EARLY:
                    instance.note_status(status)
                control[loop.STATUS + i] = 0  # or the next run would take it for its own

    @property
    def complete(self) -> int:
        """While `run` is under way: the steps that are complete."""
        return int(self._report[1])

    def stuck(self, crash: str = "") -> tuple[int, str]:
        """For another thread, while `run` does not come back: the rows that are complete, and who does not.

        crash: what an FMU did to the process, to be filled with who was in what.
        """
        done, operation = int(self._report[1]), int(self._report[2])
        if self.program.rows[operation][0] == loop.FORK:
            operation += 1 + int(np.argmax(self._threads.control[loop.STATUS + operation + 1 :] == loop.UNDERWAY))
        instance, doing = self.program.labels[operation]
        who = f"component '{instance.name}'" if instance is not None else "the master"
        return done, crash.format(who, doing) if crash else f"{who} does not come back from {doing}"

    @property
    def ended(self) -> EngineInstance | None:
        """The instance that has asked to end the run."""
        index = int(self.program.buffer.ended[0])
        return self.program.instances[index - 1] if index else None

    def _too_large(self, operation: int) -> str:
        """What does not fit into the type it goes to."""
        instance, doing = self.program.labels[operation]
        if instance is None:
            return f"{doing}: the value does not fit into the type of what it is connected to"
        _, width, place, stage, count = self.program.rows[operation]
        buffer = self.program.buffer
        values = (buffer.reals if width == loop.F32 else buffer.integers)[place : place + count]
        staged = buffer.stages[width][stage : stage + count]
        k = int(np.argmax(~np.isfinite(staged) if width == loop.F32 else staged != values))
        signals = [s for g in instance.input_groups for s in g.signals if g.fmi_type.width == width]
        signal = next(s for s in signals if s.place <= place + k < s.place + s.size)
        return f"component '{instance.name}': {values[k]:g} does not fit into '{signal.name}', which is {signal.type}"

    def once(self) -> None:
        """Run the operations once, where they take no steps."""
        self.run(np.zeros((1, self.width)), 0.0, 0.0, 0, 1, 2, 0.0)

    def not_finite(self, t: float) -> SimulationError:
        """The error that names the values that are not finite."""
        reals = self.program.buffer.reals
        bad = [f"{s.address} = {reals[p]:g}" for p, s in self._names.items() if not np.isfinite(reals[p])]
        return SimulationError(f"not finite at t = {t:g} s: {', '.join(bad[:10])}", t)
