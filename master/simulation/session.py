"""A package that is loaded once and run many times, for whoever needs thousands of runs: estimation, sweeps.

Each run resets the FMUs, which is a matter of milliseconds, and keeps only the signals that were asked for.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np

from ...core.errors import SimulationError, UnknownNameError, UsageError, did_you_mean
from ..algorithms import choose_method, method_named
from ..algorithms.method import MEAN
from ..coupling.initialisation import Initialiser
from ..engine.program import Program
from ..engine.runner import Runner
from ..engine.values import REAL, TEXT, Signal, of_slot
from ..options import Options, as_path, as_text, as_texts, as_time
from ..system.addresses import split, targets
from ..system.assemble import assemble
from ..system.findings import Findings
from ..system.instances import load_instances
from ..system.start_values import StartValue, resolve
from .start_up import DrivenInput, initialise, write_program
from .stepped_run import SteppedRun
from .stimuli import InputSeries, as_slots, check_series, interval_means, items_of
from .stimuli_column import whole_numbers
from .time_grid import time_grid

MAX_RECORDED_VALUES = 3e8
"""Values that a run may record: a few GB."""

Series = tuple[np.ndarray, np.ndarray]
"""Times [s] (n,) and values (n,)."""


@dataclass(frozen=True)
class _Driven:
    """An input that a run drives."""

    signal: Signal
    at: np.ndarray
    """Its values at all points in time (n + 1,)."""
    interval_means: np.ndarray | None
    """Its means over the steps (n + 1,), the last unused, where the method holds these."""

    @property
    def input(self) -> DrivenInput:
        """As a run begins with it."""
        return DrivenInput(self.signal, self.at[0], self.signal.family == REAL)


def _matrix(driven: Sequence[_Driven]) -> np.ndarray | None:
    """What a runner is given of them: a column each, then those of the means."""
    columns = [as_slots(d.at) for d in driven]
    averages = [d.interval_means for d in driven if d.interval_means is not None]
    return np.stack([*columns, *averages], axis=1) if driven else None


class Session:
    """The system of an SSP package, loaded; a context manager. Not for use from several threads.

    only: names of the components to load; the inputs that the others would give can then be driven.
    internals: names or patterns of other variables than inputs and outputs that runs may record.
    """

    def __init__(
        self, package: str | Path, log: Callable[[str, str, str], None] = lambda *_: None, only: Sequence[str] = (),
        internals: Sequence[str] = (),
    ):  # fmt: skip
        self._stack = ExitStack()
        try:
            path, options = as_path("package", package), Options(record=tuple(internals))
            assembly = assemble(path, options, self._stack, Findings(), only)
            assert assembly is not None
            self.structure, self.system, self._bound = assembly.network.structure, assembly.system, assembly.values
            load_instances(assembly.instances, self._stack, log)
            self._initialiser = Initialiser(self.system)
        except BaseException:
            self._stack.close()
            raise
        self._closed = False
        self._under_way: SteppedRun | None = None
        self._stepping: tuple[Runner, float, float] | None = None
        """Who takes the steps that are under way, from when on and how long they are [s]."""
        self._fresh = True
        self._programs: dict[tuple[Any, ...], Program] = {}
        self._runners: dict[tuple[Any, ...], Runner] = {}

    def __enter__(self) -> Session:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Free the FMUs; what leaving the `with` block does."""
        self._stack.close()
        self._closed = True
        self._under_way = None

    def culprit(self, crash: str) -> str:
        """For another thread, where an FMU has ended the process: which one, and in what; "" where that is unknown."""
        if self._stepping is not None:
            runner, start, step = self._stepping
            done, who = runner.stuck(crash)
            return f"{who} at t = {start + done * step:g} s"
        calling = next((i for i in self.system.instances.values() if i.in_call), None)
        return crash.format(f"component '{calling.name}'", calling.in_call) if calling is not None else ""

    @property
    def is_lost(self) -> bool:
        """Whether an FMU returned fatal in a run; no further run is possible."""
        return any(instance.is_lost for instance in self.system.instances.values())

    def signal(self, address: str) -> tuple[bool, Signal]:
        """(is an output, signal) of component.variable, or of a connector of the whole system."""
        component, name = split(address, self.system.instances)
        for signals, is_output in ((self.system.outputs, True), (self.system.inputs, False)):
            if (component, name) in signals:
                return is_output, signals[component, name]
        if address in self.system.system_outputs:
            return not self.system.connections.passed_on(address), self.system.system_outputs[address]
        if address in self.system.system_inputs:
            return False, self.system.system_inputs[address]
        known = [f"{c}.{n}" for c, n in (*self.system.outputs, *self.system.inputs)]
        raise UnknownNameError(f"no connector '{address}'{did_you_mean(address, known)}")

    def place(self, address: str) -> tuple[bool, int]:
        """(is an output, its slot) of the signal component.variable."""
        is_output, signal = self.signal(address)
        return is_output, signal.place

    def targets(self, address: str) -> list[tuple[str, str]]:
        """(component, variable) of what a change of that address sets; '' for an input of the whole system."""
        return targets(address, self.system.instances, self.system)

    def values(self, changes: Mapping[str, Any] | None = None) -> dict[str, Any]:
        """Every parameter and start value in force with these changes, by component.variable."""
        instances = self.system.instances
        in_force = {
            f"{c}.{v.name}": value
            for c, instance in instances.items()
            for v in instance.description.modelVariables
            if v.start is not None and instance.settable(v.name) and (value := instance.start(v.name)) is not None
        }
        for v in [*self._bound, *resolve((changes or {}).items(), instances, "", self.system)]:
            in_force[f"{v.component}.{v.variable}" if v.component else v.variable] = v.value
        return in_force

    def run(
        self,
        record: Sequence[str],
        stop: float,
        step: float,
        changes: Mapping[str, Any] | None = None,
        inputs: Mapping[str, Series] | None = None,
        method: str | None = None,
        drives: Sequence[InputSeries] = (),
    ) -> tuple[np.ndarray, np.ndarray]:
        """Times (n,) and recorded signals (n, len(record)) of a run from the package's start time to `stop` [s].

        The last step is shorter where `step` does not divide the time.

        changes: parameters by address, on top of the package's; inputs: series by address of unconnected inputs, joined
        by straight lines, whole numbers held from one to the next, and held beyond their ends; method: None is the
        package's, or the first of all; drives: likewise, as `stimuli.read` has them from a file. Raises `UsageError`
        for what is no value of an input's type, `SimulationError` when an FMU fails or a recorded value is not finite;
        the session can be used again afterwards.
        """
        self._check_usable()
        self._stepping = None
        start, stop, step, n = time_grid(self.structure, as_time("stop", stop), as_time("step", step))
        record = as_texts("record", record)
        method = choose_method(None if method is None else as_text("method", method), self.structure.method)
        wanted = self._recorded(record)
        if n * (len(record) + len(inputs or {}) + 1) > MAX_RECORDED_VALUES:
            raise UsageError(f"a run of {n:.1e} steps would not fit into memory: take longer steps or a shorter run")
        times = start + np.arange(n + 1) * step
        times[n] = stop
        driven = self._driven(inputs or {}, drives, times, method_named(method).input_hold == MEAN)
        self._begin(method, self._start_values(changes or {}), driven, start, stop)
        self.system.writer.watched = None
        if all(is_output and s.component for is_output, s in wanted):
            self.system.writer.watched = frozenset((s.component, s.name) for _, s in wanted)
        runner, order = self._runner(method, tuple(wanted), driven)
        runner.program.begin()
        rows = np.empty((n + 1, len(record)))
        raw = np.empty((n, len(record)))
        self._stepping = runner, start, step
        try:
            taken_steps = runner.run(raw, start, step, 0, n, n, stop, _matrix(driven))
        finally:
            self._stepping = None
        if taken_steps < n and runner.ended is not None:
            end = start + taken_steps * step
            raise SimulationError(f"component '{runner.ended.name}' asks to end the simulation at t = {end:g} s", end)
        rows[:n, order] = raw
        self._finish(rows, wanted, driven)
        if not np.isfinite(rows).all():
            k, i = np.argwhere(~np.isfinite(rows))[0]
            raise SimulationError(f"'{record[i]}' is not finite at t = {times[k]:g} s", float(times[k]))
        return times, rows

    def start(
        self,
        record: Sequence[str],
        step: float | None = None,
        inputs: Mapping[str, float] | None = None,
        changes: Mapping[str, Any] | None = None,
        method: str | None = None,
    ) -> SteppedRun:
        """Begin a run that the caller takes on, some steps at a time: a controller, a learning loop, a test bench.

        record: signals whose values its `step` returns; step: the macro step [s], None: the package's; inputs: what
        unconnected inputs begin with, by address: those may be driven; changes: parameters; method: see `run`.
        """
        self._check_usable()
        begin, step = self.structure.start_time, self.macro_step(step)
        wanted = self._recorded(as_texts("record", record))
        method = choose_method(None if method is None else as_text("method", method), self.structure.method)
        held = {name: as_time(name, value) for name, value in (inputs or {}).items()}
        holds_mean = method_named(method).input_hold == MEAN
        constant = {name: (np.array([begin]), np.array([value])) for name, value in held.items()}
        driven = self._driven(constant, (), np.array([begin, begin + step]), holds_mean)
        self._begin(method, self._start_values(changes or {}), driven, begin, np.inf)
        self.system.writer.watched = None
        runner, _ = self._runner(method, tuple(wanted), driven)
        runner.program.begin()
        signals = dict(zip(held, (d.signal for d in driven), strict=True))
        inputs_driven = {name: (signal, items_of(signal, self.system)) for name, signal in signals.items()}
        made = SteppedRun(
            runner, [s for _, s in wanted], inputs_driven, held, holds_mean, begin, step,
            lambda run: run is self._under_way,
        )  # fmt: skip
        self._under_way = made
        return made

    def macro_step(self, step: float | None) -> float:
        """The step that is asked for, else the package's [s]."""
        chosen = self.structure.step_size if step is None else as_time("step", step)
        if chosen is None:
            raise UsageError("the package suggests no step: give one")
        if not (np.isfinite(chosen) and chosen > 0.0):
            raise UsageError(f"step {chosen:g} s: it has to be positive")
        return chosen

    def _check_usable(self) -> None:
        """Raise where no run may begin; one that somebody else takes on is over now."""
        self._under_way = None
        if self._closed:
            raise UsageError("the session is closed: run inside its `with` block")
        for instance in self.system.instances.values():
            if instance.is_lost:
                raise SimulationError(f"component '{instance.name}' was lost in an earlier run; open a new session")

    def _recorded(self, record: Sequence[str]) -> list[tuple[bool, Signal]]:
        """(is an output, signal) of each of these; all are single numbers."""
        wanted = [self.signal(address) for address in record]
        for _, signal in wanted:
            if signal.family == TEXT or signal.size > 1:
                raise UsageError(f"'{signal.address}' is not a single number and cannot be recorded here")
        return wanted

    def _driven(
        self, inputs: Mapping[str, Series], drives: Sequence[InputSeries], times: np.ndarray, holds_mean: bool
    ) -> list[_Driven]:
        """What is driven, at these times."""
        connected = {link.target.place for link in self.system.links}
        driven: list[_Driven] = []
        for address, given in inputs.items():
            t, y = check_series(address, given)
            is_output, signal = self.signal(address)
            if is_output or signal.place in connected:
                raise UsageError(f"'{address}' cannot be driven: it is {'an output' if is_output else 'connected'}")
            if signal.family == TEXT or signal.size > 1:
                raise UsageError(f"'{address}' is not a single number and cannot be driven here")
            if signal.family == REAL:
                held = np.append(interval_means(t, y, times), 0.0) if holds_mean else None
                driven.append(_Driven(signal, np.interp(times, t, y), held))
                continue
            exact = given[1] if isinstance(given, (tuple, list)) else y  # a float has no more than 53 bits
            whole = whole_numbers(address, np.asarray(exact).tolist(), signal, items_of(signal, self.system))
            d = InputSeries(signal, 0, t, whole, False)
            driven.append(_Driven(signal, d.at(times), np.append(d.mean(times), 0.0) if holds_mean else None))
        for d in drives:
            if d.texts:
                raise UsageError(f"'{d.signal.address}' takes texts and cannot be driven here")
            signal = d.signal.part(d.element) if d.signal.size > 1 else d.signal
            driven.append(_Driven(signal, d.at(times), np.append(d.mean(times), 0.0) if holds_mean else None))
        return driven

    def _start_values(self, changes: Mapping[str, Any]) -> list[StartValue]:
        """Parameters and start values of a run."""
        system = self.system
        values = [*self._bound, *resolve(changes.items(), system.instances, "", system, system.network.inputs)]
        for v in values:
            if v.component and system.instances[v.component].variables[v.variable].causality == "structuralParameter":
                raise UsageError(f"'{v.component}.{v.variable}' gives arrays their size and cannot change in a session")
        return values

    def _begin(
        self, method: str, values: list[StartValue], driven: Sequence[_Driven], start: float, stop: float
    ) -> None:
        """Initialise the FMUs, which are as new."""
        if not self._fresh:
            for instance in self.system.instances.values():
                instance.reset()
        self._fresh = False
        self.system.values.reset_inputs()
        initialise(self._initialiser, method_named(method), values, [d.input for d in driven], start, stop)

    def _finish(self, rows: np.ndarray, wanted: Sequence[tuple[bool, Signal]], driven: Sequence[_Driven]) -> None:
        """Write what is recorded at the end into the last row (n + 1, columns), and whole numbers as such into all."""
        if driven:
            for d in driven:
                self.system.values.put(d.signal, d.at[-1])
            self._initialiser.show()
        reals, integers = self.system.buffer.reals, self.system.buffer.integers
        for j, (_, signal) in enumerate(wanted):
            rows[-1, j] = reals[signal.place]
            if signal.family != REAL:
                kind = np.uint64 if signal.type == "UInt64" else np.int64
                rows[:-1, j] = rows[:-1, j].copy().view(kind)
                rows[-1, j] = of_slot(int(integers[signal.place]), signal.type)

    def _runner(
        self, method: str, wanted: tuple[tuple[bool, Signal], ...], driven: Sequence[_Driven]
    ) -> tuple[Runner, list[int]]:
        """The runner of a method that records these signals, and which column of the record each of its columns is."""
        outputs = [j for j, (is_output, _) in enumerate(wanted) if is_output]
        inputs = [j for j, (is_output, _) in enumerate(wanted) if not is_output]
        detected = tuple(
            (n, o, *inputs) for n, s in self.system.instances.items() for o, inputs in s.detected_feedthrough.items()
        )
        signals, unset = tuple(d.signal for d in driven), frozenset(self.system.values.inputs_without_value)
        key = (method, signals, unset, self.system.writer.watched, detected)
        if key not in self._programs:
            inputs_driven = [d.input for d in driven]
            try:
                self._programs[key] = write_program(self.system, method_named(method), inputs_driven)
            except MemoryError:  # the programs' memory is on the buffer: start anew
                self._programs.clear()
                self._runners.clear()
                self.system.layout.release()
                self._programs[key] = write_program(self.system, method_named(method), inputs_driven)
        records = (*key, wanted)
        if records not in self._runners:
            if len(self._runners) >= 64:
                self._runners.pop(next(iter(self._runners)))
            self._runners[records] = Runner(
                self._programs[key], [wanted[j][1].place for j in outputs], [wanted[j][1].place for j in inputs]
            )
            self._runners[records].timed = False
        return self._runners[records], [*outputs, *inputs]
