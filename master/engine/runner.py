"""Runs a program: the compiled loop with its arrays, and what its reports mean."""

from __future__ import annotations

import ctypes
import sys
from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from ...core.errors import SimulationError
from . import loop
from .crew import NOBODY, Crew
from .program import Program, Steps
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
        """Wall time in doStep of the slaves, as far as the program has them step [s]."""
        forked = any(row[0] == loop.FORK for row in program.rows)
        self._crew = Crew(self._operations, program.numbered) if forked else NOBODY
        self._report = np.zeros(6, np.int64)
        self._nothing = np.zeros((1, 0))
        self.timed = True

    def spent(self, number: int) -> float:
        """Wall time in doStep of a slave, by its number [s]."""
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
        board, stages = self.program.board, self.program.board.stages
        self._report[:] = 0
        clock = _clock() if self.timed else 0
        self._crew.begin(self._operations, stages[loop.U8], self.seconds, clock)
        loop.run(
            self._operations, self._constants, self._tables, board.reals, board.integers,
            stages[loop.I8], stages[loop.U8], stages[loop.I16], stages[loop.U16], stages[loop.I32], stages[loop.U32],
            stages[loop.F32], self._nothing if driven is None else driven, rows, self._outputs, self._inputs,
            self._finite, self.seconds, start, h, first, count, total, last_step(start, h, total, stop),
            clock, budget, board.ended, self._report, self._crew.control, self._crew.spans,
        )  # fmt: skip
        why, done, operation, status, warned, when = (int(x) for x in self._report)
        self.taken = done
        if warned:
            slave, doing = self.program.labels[warned - 1]
            if slave is not None:
                slave.hear_warning(f"{doing} at t = {start + (first + when) * h:g} s" if h > 0.0 else doing)
        if why in (loop.DONE, loop.TIME_IS_UP, loop.ENDED):
            return done
        t = start + (first + done) * h if first + done < total else stop
        if why == loop.NOT_FINITE:
            raise self.not_finite(t)
        slave, doing = self.program.labels[operation]
        if self.program.error is not None:
            error, self.program.error = self.program.error, None
            raise error
        if status == loop.TOO_LARGE:
            raise SimulationError(f"{self._too_large(operation)} at t = {t:g} s", t)
        assert slave is not None
        if status == loop.EARLY:
            raise SimulationError(
                f"component '{slave.name}' came back early from its step at t = {t:g} s, which it was not allowed to", t
            )
        raise slave.failure(doing, status, t if h > 0.0 else None)

    @property
    def complete(self) -> int:
        """While `run` is under way: the steps that are complete."""
        return int(self._report[1])

    def stuck(self, lost: str = "") -> tuple[int, str]:
        """For another thread, while `run` does not come back: the rows that are complete, and who does not.

        lost: what an FMU did to the process.
        """
        done, operation = int(self._report[1]), int(self._report[2])
        if self.program.rows[operation][0] == loop.FORK:
            operation += 1 + int(np.argmax(self._crew.control[loop.STATUS + operation + 1 :] == loop.UNDERWAY))
        slave, doing = self.program.labels[operation]
        who = f"component '{slave.name}'" if slave is not None else "the master"
        return done, f"{who} {lost} in {doing}" if lost else f"{who} does not come back from {doing}"

    @property
    def ended(self) -> Steps | None:
        """The slave that has asked to end the run."""
        index = int(self.program.board.ended[0])
        return self.program.slaves[index - 1] if index else None

    def _too_large(self, operation: int) -> str:
        """What does not fit into the type it goes to."""
        slave, doing = self.program.labels[operation]
        if slave is None:
            return f"{doing}: the value does not fit into the type of what it is connected to"
        _, width, place, stage, count = self.program.rows[operation]
        board = self.program.board
        values = (board.reals if width == loop.F32 else board.integers)[place : place + count]
        staged = board.stages[width][stage : stage + count]
        k = int(np.argmax(~np.isfinite(staged) if width == loop.F32 else staged != values))
        signals = [s for g in slave.input_groups for s in g.signals if g.form.width == width]
        signal = next(s for s in signals if s.place <= place + k < s.place + s.size)
        return f"component '{slave.name}': {values[k]:g} does not fit into '{signal.name}', which is {signal.type}"

    def once(self) -> None:
        """Run the operations once, where they take no steps."""
        self.run(np.zeros((1, self.width)), 0.0, 0.0, 0, 1, 2, 0.0)

    def not_finite(self, t: float) -> SimulationError:
        """The error that names the values that are not finite."""
        reals = self.program.board.reals
        bad = [f"{s.address} = {reals[p]:g}" for p, s in self._names.items() if not np.isfinite(reals[p])]
        return SimulationError(f"not finite at t = {t:g} s: {', '.join(bad[:10])}", t)
