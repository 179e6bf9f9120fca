"""Runs a package from start to end: prepare, load, initialise, step, record, free."""

from __future__ import annotations

import errno
import os
import platform
from collections.abc import Callable, Sequence
from contextlib import ExitStack, suppress
from dataclasses import replace
from functools import partial
from math import inf
from pathlib import Path
from time import perf_counter
from typing import Any

from ...core.errors import CosimError, Interrupted, OutputError, SimulationError
from ...core.files import returning, writing
from ...core.guardian import tell
from ...core.scratch import scratch
from ...core.versions import versions
from ..accuracy.divergence import divergence
from ..accuracy.doubt import doubt, warning
from ..accuracy.held_inputs import HeldInputs
from ..algorithms.method import MEAN
from ..coupling.feedthrough import feedthrough_slopes, loops_that_came_up
from ..coupling.initialisation import Initialiser
from ..coupling.residual_energy import ResidualEnergy
from ..engine.program import Program
from ..engine.runner import Runner
from ..options import Options
from ..results.columns import elements
from ..results.constants import constants
from ..slaves.base import fmu_warnings
from ..slaves.message_log import MessageLog
from ..system.instances import load_instances
from ..system.parameters import parameters_in_force
from .answers import Answers, answers
from .identity import check_resumed, identity
from .interrupts import Interrupts, interrupts
from .manifest import manifest, write_manifest
from .plan import Plan, make_plan
from .recording import Recording, sample_stride
from .result import Result
from .run_folder import RunFolder, result_folder, write_summary
from .saved_state import STATE_FILE
from .start_up import DrivenInput, initialise, undriven, write_program
from .state_saver import StateSaver, recall_feedthrough, restore
from .stepping import MacroSteps

OnHang = Callable[[CosimError], object]

Reals = dict[str, list[tuple[int, str, str]]]


def run(
    package: Path,
    folder: Path,
    options: Options | None = None,
    log: Callable[[str, str, str], None] = lambda *_: None,
    progress: Callable[[int, int], None] = lambda *_: None,
    stride: int | None = None,
    on_hang: OnHang | None = None,
    say: Callable[[str], object] = lambda text: None,
    loaded: Callable[[int, int], None] = lambda *_: None,
) -> Result:
    """Run the SSP file `package`, write the results, summary.json and manifest.json into `folder`.

    What an earlier run left there is kept until this one has something to show; `say` is told of one that was killed.

    `log` gets (component, status, text) of every message of an FMU, `loaded` (FMUs that are there, FMUs in all),
    `progress` (steps done, steps in all) at the start and now and then. `stride` is the distance of sampled points in
    steps, else what gives a few thousand. `on_hang` is called when the run was asked to end and an FMU does not come
    back, or when an FMU ends the process it is in: in another thread and with everything written. It gets what to say,
    an `Interrupted` in the first case, and has to end the process.
    Raises `CosimError`; what was recorded until then is kept on disk.
    """
    options = options or Options()
    begin = perf_counter()
    with ExitStack() as outer:  # the folder is held until nothing is written there any more, the FMUs are freed before
        with ExitStack() as stack:
            interrupt = stack.enter_context(interrupts(on_hang is not None))
            folder = stack.enter_context(returning()) / folder
            plan = make_plan(package, options, stack, interrupt)
            run_identity = identity(plan) if options.saves or plan.resumed is not None else {}
            plan.remarks += check_resumed(plan, run_identity, folder)
            files = outer.enter_context(result_folder(folder, options.results, options.log, say))
            options = plan.options
            tell.results(str(files.folder), options.results)
            write_manifest(files.place, manifest(package, plan.network, options))
            under_way = _Run(package, files, plan, interrupt, on_hang, begin, run_identity)
            under_way.start(stack, log, stride, loaded)
            under_way.take_steps(progress)
            under_way.warn_of_late_loops()
            result = under_way.result()
        under_way.warn_of_termination()
        if options.check_step:
            _check_step(result, package, options, log, progress, on_hang)
    return result


class _Run:
    """A run under way: `start`, `take_steps`, `result`. Each part knows what is left on disk if it is the last."""

    def __init__(
        self, package: Path, files: RunFolder, plan: Plan, interrupt: Interrupts,
        on_hang: OnHang | None, begin: float, run_identity: dict[str, Any],
    ):  # fmt: skip
        self._identity = run_identity
        self.package, self.files, self.options, self.plan = package, files, plan.options, plan
        self.interrupt, self._on_hang, self._begin = interrupt, on_hang, begin
        self.method = plan.method
        self.remarks = list(plan.remarks)
        self.answers: Answers | None = None

    def start(
        self, stack: ExitStack, log: Callable[[str, str, str], None], stride: int | None,
        loaded: Callable[[int, int], None],
    ) -> None:  # fmt: skip
        """Load and initialise everything; what is loaded goes with the stack."""
        plan, options = self.plan, self.options
        count = plan.times.steps - plan.steps_before
        try:
            self._begin_log(stack)
            with self.interrupt.watching(self._abandon_start):
                load_instances(plan.instances, stack, log, loaded)
                stack.callback(self.interrupt.watch_until_end, self._abandon_end)
                program = self._initialised()
                bonds = plan.bonds
                slopes = [feedthrough_slopes(plan.system, bond) for bond in bonds]
                if self.interrupt:
                    raise Interrupted("interrupted before the first step", plan.times.start)
                interpolating = self.method.interpolating(plan.instances.values())
                layout = plan.layout
                self.energy = ResidualEnergy(bonds, layout.outputs, layout.inputs, slopes, interpolating)
                held = HeldInputs(plan.system, layout.outputs, layout.inputs, interpolating, options.check_step)
                self.file = self.files.place / options.results if options.results else None
                self.stride = stride or sample_stride(count, len(layout.columns))
                taken = [layout.columns[i] for i in plan.recorded_columns]
                self.recording = Recording(
                    plan.system, layout, plan.recorded_columns, self.file, options.record_every, self.energy, held,
                    self.stride, constants(plan.system, self.parameters, options.record_parameters, taken),
                    plan.steps_before, self._show,
                )  # fmt: skip
                if plan.resumed is not None and options.resume is not None:
                    restore(plan.resumed, options.resume, plan.system, program)
        except CosimError as error:
            kept = self._write_failed_start("interrupted" if isinstance(error, Interrupted) else "failed", error)
            if kept:
                error.args = (f"{error}{kept}",)
            raise
        stack.callback(self.recording.close)
        self._started = perf_counter()
        self.saver = None
        if options.saves:
            guarded = partial(self.interrupt.watching, self._abandon_saving)
            self.saver = StateSaver(self.files.place / STATE_FILE, plan, program, self._identity, guarded)
        self.loop = MacroSteps(
            plan, program, self.recording, self.method.input_hold == MEAN, options.realtime, self.saver
        )
        if self.message_log is not None:
            self.message_log.clock = self.loop.under_way

    def _begin_log(self, stack: ExitStack) -> None:
        """Make the file that gets what FMUs say, where one is wanted."""
        options = self.options
        self.message_log: MessageLog | None = None
        if options.log:
            path = self.files.place / options.log
            self.message_log = log = MessageLog(path, options.log_level or "info", options.log_categories)
            with writing(path):
                log.begin()
            stack.callback(log.close)
        for instance in self.plan.instances.values():
            instance.message_log = self.message_log

    def _initialised(self) -> Program:
        """Bring the system to its start; what a macro step consists of."""
        plan, system = self.plan, self.plan.system
        start, stop = plan.times.start, plan.times.stop
        driven = [DrivenInput(d.signal, d.value(start), d.interpolated, d.element, d.texts) for d in plan.drives]
        initialiser = Initialiser(system)
        until = inf if self.options.saves else stop  # or an FMU might refuse to go on
        self.remarks += initialise(initialiser, self.method, plan.values, driven, start, until)
        values = [*plan.structural_values, *undriven(plan.values, driven)]
        self.parameters = parameters_in_force(system, values, initialiser.brought)
        if plan.resumed is not None:
            recall_feedthrough(plan.resumed, system)
        return write_program(system, self.method, driven)

    def _show(self) -> None:
        """There are rows in the result file: from now on it stands where it is looked for."""
        self.files.show()
        if self.file is not None:
            self.file = self.files.folder / self.options.results
            self.recording.moved_to(self.file)
        if self.message_log is not None:
            self.message_log.path = self.files.folder / self.options.log
        if self.saver is not None:
            self.saver.path = self.files.folder / STATE_FILE

    def take_steps(self, progress: Callable[[int, int], None]) -> None:
        """Take all steps, and write the summary however they end."""
        failure: CosimError | None = None
        try:
            self.loop.run(*self.plan.times, progress, self.interrupt, self._abandon)
            self.remarks += self.loop.ending(self.plan.times.stop)
            self.remarks += self.saver.remarks() if self.saver is not None else []
            self.recording.flush()
            self.recording.finish()
        except OSError as caught:
            if caught.errno != errno.EBADF:
                raise
            where = f"at t = {self.loop.time:g} s or before: files of the master are closed; --isolate says which"
            failure = SimulationError(f"an FMU has closed what is not its own {where}", self.loop.time)
        except OutputError as caught:  # nothing more can be written
            time = self.loop.time
            left = self.recording.written_to
            holds = "no row" if left is None else f"the rows up to t = {left:g} s"
            failure = SimulationError(f"stopped at t = {time:g} s: {caught}; it holds {holds}", time)
        except CosimError as caught:
            failure = caught
            with suppress(OutputError):
                self.recording.flush()
        status = "interrupted" if isinstance(failure, Interrupted) else "failed" if failure else "ok"
        self.summary = self._summary("ended" if self.loop.ended_by is not None and not failure else status, failure)
        kept = ""
        try:
            if self.files.is_shown:
                write_summary(self.files.folder, self.summary)
            else:
                kept = self.files.fail(self.summary)
        except OutputError:
            if failure is None:
                raise
        if failure and kept:
            failure.args = (f"{failure}{kept}",)
        if failure:
            raise failure

    def warn_of_late_loops(self) -> None:
        """Add to the summary what FMUs show that may be asked in any way now, for no step follows."""
        if self.loop.ended_by is not None:
            return
        with self.interrupt.watching(self._abandon_end):
            warnings = loops_that_came_up(self.plan.system)
        self._add_warnings(warnings)

    def warn_of_termination(self) -> None:
        """Add to the summary what the FMUs said, and what went wrong, as they were ended."""
        instances = self.plan.instances.values()
        self._add_warnings(
            [*fmu_warnings(instances), *filter(None, (instance.termination_error for instance in instances))]
        )

    def _add_warnings(self, late: Sequence[str]) -> None:
        """Add warnings to a summary that has been written, those that it does not have."""
        warnings = self.summary["warnings"]
        if fresh := [text for text in late if text not in warnings]:
            warnings += fresh
            write_summary(self.files.folder, self.summary)

    def result(self) -> Result:
        """What is left behind."""
        system = self.plan.system
        return Result(
            self.files.folder,
            self.summary,
            [c.name for c in self.plan.layout.columns],
            {**system.units(), **{c.name: c.unit for c in self.recording.columns if c.unit and c.name != "time"}},
            self.recording.sampled(),
            self.recording.extremes(),
            [name for link in system.links for name in elements(link.source)],
            [name for s in (*system.outputs.values(), *system.system_outputs.values()) for name in elements(s)],
            [name for s in system.system_outputs.values() for name in elements(s)],
            self.file,
            [c.name for c in self.recording.columns if c.type == "text"],
            [c.name for c in self.recording.columns if c.type == "boolean"],
            self.stride,
            self.recording.held,
            self.answers,
        )

    def _summary(self, status: str, error: object) -> dict[str, Any]:
        plan, loop = self.plan, self.loop
        start, step = plan.first_time, plan.times.step
        wall = perf_counter() - self._started
        simulated = loop.time - start
        instances = plan.instances
        reals = self._reals()
        in_doubt = self._doubt(reals)
        doubts = warning(in_doubt, self.method.order, step)
        runaway = self._divergence(reals)
        told = self._answers() if status in ("ok", "ended") else None
        warnings = [*fmu_warnings(instances.values()), *self.energy.warnings(), *runaway, *doubts, *self.remarks]
        if self.message_log is not None and self.message_log.fault is not None:
            warnings.append(self.message_log.fault)
        return {
            "package": str(self.package),
            "variant": plan.network.structure.file.name,
            "status": status,
            "error": str(error) if error else None,
            "method": self.options.method,
            "order": plan.system.order,
            "start_time_s": start,
            "stop_time_s": loop.time,
            "step_s": step,
            "steps": loop.done - loop.first,
            "setup_time_s": self._started - self._begin,
            "wall_time_s": wall,
            "real_time_factor": simulated / wall if wall > 0 else None,
            "fmu_time_s": {
                name: instance.seconds + loop.runner.spent(i) for i, (name, instance) in enumerate(instances.items())
            },
            "coupling": self.energy.summary(),
            "doubt": in_doubt,
            "warnings": list(dict.fromkeys(warnings)),
            "changes": dict(self.options.changes),
            "parameters": {p.address: p.summary() for p in self.parameters},
            **self.recording.described(),
            "connections": [list(ends) for ends in plan.system.connections.ends()],
            "versions": versions(),
            "machine": {"system": platform.system(), "cpus": os.cpu_count()},
            **self._states(),
            **({"answers": told.summary()} if told is not None else {}),
        }

    def _answers(self) -> Answers | None:
        """What the package wants said of the run, if that is all of it."""
        asked, recording = self.plan.answers, self.recording
        if not asked.values or self.plan.resumed is not None or recording.extremes() is None:
            return None
        sample, columns = recording.sampled(), self.plan.layout.columns
        signals = {c.name: sample[:, i] for i, c in enumerate(columns)}
        self.answers = answers(asked, sample[:, 0], signals, {p.address: p.value for p in self.parameters})
        self.remarks += self.answers.problems
        return self.answers

    def _states(self) -> dict[str, Any]:
        """What of the run's summary is about states, where it has to do with some."""
        states: dict[str, Any] = {}
        if (resumed := self.plan.resumed) is not None:
            states["resumed"] = {"from": str(self.options.resume), "time_s": resumed.time, "steps": resumed.done}
        if self.saver is not None and (saved := self.saver.saved) is not None:
            states["saved_state"] = {"file": STATE_FILE, "time_s": saved.time, "steps": saved.done}
        return states

    def _reals(self) -> Reals:
        """(column, its name, variable) of the outputs that FMUs give as reals, by component."""
        places = {c.name: i for i, c in enumerate(self.plan.layout.columns) if c.type == "float"}
        by_component: Reals = {}
        for signal in self.plan.system.outputs.values():
            columns = [(places[name], name, signal.name) for name in elements(signal) if name in places]
            by_component.setdefault(signal.component, []).extend(columns)
        return by_component

    def _doubt(self, reals: Reals) -> dict[str, Any] | None:
        """What is in doubt of the outputs that FMUs give as reals."""
        recording = self.recording
        if recording.extremes() is None:
            return None
        columns = {component: [(i, name) for i, name, _ in named] for component, named in reals.items()}
        return doubt(columns, recording.sampled(), recording.held)

    def _divergence(self, reals: Reals) -> list[str]:
        """What to say of an output that has run away."""
        if self.recording.extremes() is None:
            return []
        sample, instances = self.recording.sampled(), self.plan.instances
        outputs = [
            (i, name, instances[component].nominal(variable))
            for component, of_component in reals.items() for i, name, variable in of_component
        ]  # fmt: skip
        columns, names, nominals = zip(*outputs, strict=True) if outputs else ((), (), ())
        return divergence(names, nominals, sample[:, 0], sample[:, list(columns)])

    def _write_failed_start(self, status: str, error: object) -> str:
        """Write the summary of a run that has not begun; returns what to say of an earlier result."""
        with suppress(OutputError):
            return self.files.fail({"package": str(self.package), "status": status, "error": str(error), "steps": 0})
        return ""

    def _abandon_start(self, crash: str) -> None:
        error = self._hang_error("being loaded and initialised", crash)
        kept = self._write_failed_start("failed" if crash else "interrupted", error)
        self._end_process(type(error)(f"{error}{kept}"))

    def _abandon(self, runner: Runner, crash: str) -> None:
        start, step = self.plan.times.start, self.plan.times.step
        why = self.loop.abandon(runner, start, step, crash)
        self._write_and_end(SimulationError(why, self.loop.time) if crash else Interrupted(why, self.loop.time), crash)

    def _abandon_saving(self, crash: str) -> None:
        self._write_and_end(self._hang_error("giving its state", crash), crash)

    def _write_and_end(self, error: SimulationError, crash: str) -> None:
        """Write what there is, and end the process."""
        try:
            self.recording.flush()
            self.recording.close()
            write_summary(self.files.place, self._summary("failed" if crash else "interrupted", error))
        finally:
            self._end_process(error)

    def _abandon_end(self, crash: str) -> None:
        error = self._hang_error("being ended", crash)
        self._end_process(type(error)(f"{error}; what was simulated is written"))

    def _hang_error(self, phase: str, crash: str) -> SimulationError:
        """What to say of an FMU that does not come back, or has taken the process with it, outside of steps."""
        instance = next((s for s in self.plan.instances.values() if s.in_call), None)
        who = f"component '{instance.name}'" if instance else "an FMU"
        where = f"{phase} ({instance.in_call})" if instance else phase
        hint = "" if instance and not crash.startswith("a thread") else "; --isolate says which"
        if crash:
            return SimulationError(crash.format(who, where) + hint)
        return Interrupted(f"{who} does not come back from {where}{hint}")

    def _end_process(self, error: CosimError) -> None:
        assert self._on_hang is not None  # else nobody watches
        self._on_hang(error)


def _check_step(
    result: Result, package: Path, options: Options, log: Callable[[str, str, str], None],
    progress: Callable[[int, int], None], on_hang: OnHang | None,
) -> None:  # fmt: skip
    """Run once more with half the step, and put what that tells into the summary."""
    from .step_check import add_estimate, add_failure

    step = 0.5 * result.summary["step_s"]
    quiet = replace(options, results="", log="", log_level=None, log_categories=(), record_parameters=())
    half = replace(quiet, step=step, check_step=False, realtime=False, save_state=False, save_state_every=None)
    try:
        with scratch("half-step") as place:
            again = run(package, place / "run", half, log, progress, 2 * result.stride, on_hang)
    except CosimError as error:
        add_failure(result, step, error)
    else:
        add_estimate(result, again)
    write_summary(result.folder, result.summary)
