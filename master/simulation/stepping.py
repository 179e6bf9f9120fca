"""The macro steps of a run, a slice of time at once, with all that is to be looked after between slices."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from time import perf_counter, sleep
from typing import cast

import numpy as np

from ...core import ending
from ...core.errors import Interrupted, SimulationError
from ...core.guardian import tell
from ..engine.program import Program
from ..engine.runner import Runner
from ..slaves.base import FmuInstance
from . import stimuli
from .interrupts import Interrupts
from .plan import Plan
from .recording import Recording
from .state_saver import StateSaver

SLICE = 0.05
"""Wall time after which the engine comes back to look for Ctrl-C and to write [s]."""

LISTEN = 0.1
"""Wall time after which waiting for the clock is interrupted for the same [s]."""


TELL = 0.2
"""Wall time after which progress is told [s]."""


class MacroSteps:
    """The macro steps, a slice of time at once."""

    def __init__(
        self, plan: Plan, program: Program, recording: Recording, averaged: bool, realtime: bool,
        saver: StateSaver | None = None,
    ):  # fmt: skip
        self._saver = saver
        self.system, self.layout, self.drives = plan.system, plan.layout, plan.drives
        self.recording, self.averaged, self.realtime = recording, averaged, realtime
        system, layout = self.system, self.layout
        if layout.keeps_texts:
            recording.take_texts(program)
        linked = [link.target for link in system.links]
        finite = [s for s in (*system.outputs.values(), *linked, *system.system_outputs.values()) if s.family == "real"]
        self.runner = Runner(program, layout.outputs, layout.inputs, finite)
        exchange = system.writer.program()
        system.writer.exchange(exchange, system.order)
        system.writer.show(exchange)
        self._exchange = Runner(exchange)
        self._finite = finite
        self.ended_by: FmuInstance | None = None
        """The FMU that has asked to end the run before its time."""
        self.first = plan.steps_before
        """Steps that an earlier run has taken."""
        self.done = self.first
        self.time = plan.first_time
        self._h, self._stepping = plan.times.step, False

    def run(
        self, start: float, stop: float, h: float, n: int, progress: Callable[[int, int], None], interrupt: Interrupts,
        abandon: Callable[[Runner, str], None],
    ) -> None:  # fmt: skip
        """Take those left of n steps of h from start, the last one to stop; `abandon` is for an FMU that does not come
        back: see `interrupts.OnHang`."""
        recording = self.recording
        self._h = h
        progress(0, n - self.first)
        self._check_start(self.time)
        self.runner.tell_guardian(start, h)
        self._save(self._is_due())
        told = perf_counter()
        begin = told - self.first * h
        while self.done < n:
            count = min(recording.free_rows(), n - self.done)
            if self._saver is not None:
                count = min(count, self._saver.until(self.done))
            if self.realtime:
                self._wait(begin + self.done * h, interrupt)
                count = max(1, min(count, int((perf_counter() - begin) / h) + 1 - self.done))
                self._heed(interrupt)
            driven = None
            if self.drives:
                t = np.minimum(start + (self.done + np.arange(count + 1)) * h, stop)
                driven = stimuli.driven_rows(self.drives, t, self.averaged)
            try:
                with interrupt.watching(partial(abandon, self.runner)), self._in_steps():
                    self.runner.run(recording.rows(count), start, h, self.done, count, n, stop, driven, SLICE)
            except SimulationError as error:
                failed_in_step = self.runner._report[0] == 1
                recording.add_rows(start, h, self.done, self.runner.taken + failed_in_step)
                self._reach(start, stop, h, n)
                if error.time is None:
                    raise type(error)(f"{error} at t = {self.time:g} s", self.time) from None
                raise
            recording.add_rows(start, h, self.done, self.runner.taken)
            self._reach(start, stop, h, n)
            if recording.due():
                recording.flush()
            if perf_counter() - told > TELL:
                told = perf_counter()
                progress(self.done - self.first, n - self.first)
            self._save(self._is_due() and self.runner.ended is None)
            self._heed(interrupt)
            if self.runner.ended is not None and self.done < n:
                self.ended_by = cast(FmuInstance, self.runner.ended)  # the system's programs are about its instances
                stop, n = self.time, self.done
        if self.realtime:
            self._wait(begin + self.time - start, interrupt)
        for drive in self.drives:
            self.system.values.put(drive.signal, drive.value(stop), drive.element)
        tell.no_steps()
        with interrupt.watching(partial(abandon, self._exchange)):
            self._exchange.once()
        recording.add_final_row(self.time)
        progress(n - self.first, n - self.first)

    @contextmanager
    def _in_steps(self) -> Iterator[None]:
        self._stepping = True
        try:
            yield
        finally:
            self._stepping = False

    def under_way(self) -> float:
        """Start of the step that is under way [s], for what an FMU says in it."""
        return self.time + self.runner.complete * self._h if self._stepping else self.time

    def abandon(self, runner: Runner, start: float, h: float, crash: str) -> str:
        """Take what is complete of the steps that do not end, and say who it is that does not come back."""
        complete, why = runner.stuck(crash)
        self.recording.add_rows(start, h, self.done, complete)
        self.done += complete
        if complete:
            self.time = start + self.done * h
        if crash:
            return f"{why} at t = {self.time:g} s; --isolate keeps the others from it"
        return f"{why} at t = {self.time:g} s; --isolate with --step-timeout ends such a run by itself"

    def ending(self, stop: float) -> list[str]:
        """What is to be said of an FMU that has ended the run."""
        instance = self.ended_by
        if instance is None:
            return []
        last = instance.last_successful_time()
        inside = last is not None and last < self.time - 1e-9 * self._h
        early = f", and came to t = {last:g} s in its last step" if inside else ""
        return [f"component '{instance.name}' ended the run at t = {self.time:g} s, before {stop:g} s{early}"]

    def _is_due(self) -> bool:
        return self._saver is not None and self._saver.is_due(self.done)

    def _save(self, wanted: bool) -> None:
        """Save the state, if that is wanted; the rows before it are on disk then."""
        if self._saver is not None and wanted:
            self.recording.flush()
            self._saver.save(self.done)

    def _reach(self, start: float, stop: float, h: float, n: int) -> None:
        self.done += self.runner.taken
        self.time = start + self.done * h if self.done < n else stop

    def _check_start(self, start: float) -> None:
        reals = self.system.buffer.reals
        if any(not np.isfinite(reals[s.place : s.place + s.size]).all() for s in self._finite):
            raise self.runner.not_finite(start)

    def _heed(self, interrupt: Interrupts) -> None:
        if interrupt:
            self._save(self.runner.ended is None)
            saver = self._saver
            further = f"; --resume {saver.path.parent} goes on from there" if saver is not None and saver.saved else ""
            raise Interrupted(f"{ending.told()} at t = {self.time:g} s{further}", self.time)

    def _wait(self, until: float, interrupt: Interrupts) -> None:
        """Wait for a moment of the clock [s], and write meanwhile what there is."""
        while not interrupt and (ahead := until - perf_counter()) > 0.0:
            sleep(min(ahead, LISTEN))
            if self.recording.due():
                self.recording.flush()
