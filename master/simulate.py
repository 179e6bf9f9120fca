"""Runs a package from start to end: read, check everything, load, initialise, step, record, free."""

from __future__ import annotations

import os
import platform
import tempfile
from collections.abc import Callable, Iterable
from contextlib import ExitStack, suppress
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from ..core.errors import CosimError, Interrupted, OutputError, SimulationError, UsageError
from . import stimuli
from .algorithms import AT_START, algorithm
from .bonds import find_bonds
from .direct import at_once, probe
from .engine.runner import Runner
from .initialise import Initialiser
from .interrupts import Interrupts, interrupts
from .manifest import manifest, write_manifest
from .options import Options, as_path, options_of
from .output import result_folder, versions, write_summary
from .recording import SAMPLE, Recording
from .results import SUFFIXES
from .results.columns import Layout, elements
from .setup import (
    bound_values,
    check_single,
    configure,
    expanded,
    given_values,
    load_descriptions,
    load_slaves,
    read_package,
    resolve,
    targets,
    with_parameters,
)
from .slaves.base import Slave
from .slaves.isolated import IsolatedSlave
from .system import System
from .times import times_of
from .trust import TRUSTED, ResidualEnergy, said, sloped

SLICE = 0.05
"""Wall time after which the engine comes back to look for Ctrl-C and to write [s]."""


@dataclass
class Result:
    """What a run left behind."""

    folder: Path
    summary: dict[str, Any]
    names: list[str] = field(default_factory=list)
    units: dict[str, str] = field(default_factory=dict)
    sample: np.ndarray | None = None
    """Communication points at even distances, at most about `recording.SAMPLE` rows (n, columns), for plots."""
    extremes: np.ndarray | None = None
    """First, least, greatest and last value of each column (4, columns)."""
    connected: list[str] = field(default_factory=list)
    """Names of the outputs that drive an input."""
    outputs: list[str] = field(default_factory=list)
    file: Path | None = None

    @property
    def frame(self) -> Any:
        """The record as a pandas frame, read from its file; units are in frame.attrs["units"]."""
        from .results.frame import frame

        if self.file is None:
            raise UsageError("this run kept no record")
        made = frame(self.file)
        made.attrs["units"] = dict(self.units)
        return made


def run(
    package: Path,
    folder: Path,
    options: Options | None = None,
    log: Callable[[str, str, str], None] = lambda *_: None,
    progress: Callable[[int, int], None] = lambda *_: None,
    stride: int | None = None,
    give_up: Callable[[str], object] | None = None,
) -> Result:
    """Run the SSP file `package`, write the results, summary.json and manifest.json into `folder`.

    `log` gets (component, status, text) of every message of an FMU, `progress` (steps done, steps in all) at the start
    and now and then. `stride` is the distance of sampled points in steps, else what gives a few thousand. `give_up` is
    called when the run was asked to end and an FMU does not come back, in another thread and with everything written;
    it gets what to say and has to end the process.
    Raises `CosimError`; what was recorded until then is kept on disk.
    """
    options = options or Options()
    begin = perf_counter()
    write = algorithm(options.method)
    if options.record_every < 1:
        raise UsageError(f"--record-every {options.record_every}: it has to be at least 1")
    if options.results and Path(options.results).suffix.lower() not in SUFFIXES:
        raise UsageError(f"{options.results}: results can be written as {', '.join(SUFFIXES)}")
    with ExitStack() as stack:
        interrupt = stack.enter_context(interrupts(give_up is not None))
        network = with_parameters(read_package(package, stack, options.variant), options.parameters)
        remarks = list(network.remarks)
        start, stop, step, n = times_of(network.structure, options.stop_time, options.step)
        slaves = load_descriptions(network)
        own = [c for c in options.changes if c[0] in network.inputs]
        others = [c for c in options.changes if c not in own]
        network, changes = configure(network, slaves, list(expanded(others, network, slaves)))
        values = [*bound_values(network, slaves, remarks.append), *resolve(changes, slaves)]
        if options.isolate:
            if options.method == "extrapolation" and any(s.takes_slopes for s in slaves.values()):
                remarks.append("--isolate: no slopes of inputs are handed over; without it the results differ a little")
            slaves = {n: IsolatedSlave(s, options.step_timeout, interrupt) for n, s in slaves.items()}
        elif options.step_timeout is not None:
            raise UsageError("--step-timeout needs --isolate: only a process of its own can be stopped")
        else:
            check_single(slaves)
        set_substeps(options, slaves)
        system = System(network, slaves)
        remarks += system.remarks
        values = [*given_values(network, system, remarks.append), *values, *resolve(own, slaves, system=system)]
        remarks += [*_uneven(slaves, start, stop, step, n), *_inner(slaves, step), *_overruled(changes, system)]
        layout = Layout(system)
        which = layout.chosen(options.record)
        layout.chosen(options.plot, "--plot")
        drives = stimuli.read(options.stimuli, system) if options.stimuli is not None else []
        stack.enter_context(result_folder(folder, options.results))
        write_manifest(folder, manifest(package, network, options))

        def unborn(status: str, error: object) -> None:
            with suppress(OutputError):
                write_summary(folder, {"package": str(package), "status": status, "error": str(error), "steps": 0})

        def abandon_start() -> None:
            why = "an FMU does not come back from being loaded and initialised; --isolate says which"
            unborn("interrupted", why)
            give_up(why)  # type: ignore[misc]

        def abandon_end() -> None:
            give_up("an FMU does not come back from being ended; what was simulated is written")  # type: ignore[misc]

        try:
            with interrupt.away(abandon_start):
                load_slaves(slaves, stack, log)
                stack.callback(interrupt.go, abandon_end)
                program = system.program()
                driven = {(drive.signal.component, drive.signal.name) for drive in drives}
                values = [v for v in values if (v.component, v.variable) not in driven]
                system.mute({v.variable for v in values if not v.component} | {n for c, n in driven if not c})
                averaged = options.method not in AT_START
                for column, drive in enumerate(drives):
                    mean = len(drives) + column if averaged and drive.straight else None
                    program.drive(drive.place, column, drive.signal.family, mean)
                    system.put(drive.signal, drive.at(np.array([start]))[0], drive.element)
                Initialiser(system)(values, start, stop)
                remarks += probe(system, options.method)
                write(system, program)
                system.show(program)
                bonds = find_bonds(system)
                answers = [at_once(system, bond) for bond in bonds]
                if interrupt:
                    raise Interrupted("interrupted before the first step", start)
                carrying = sloped(options.method, slaves.values())
                energy = ResidualEnergy(bonds, layout.outputs, layout.inputs, answers, carrying)
                file = folder / options.results if options.results else None
                stride = stride or max(1, n // SAMPLE)
                recording = Recording(system, layout, which, file, options.record_every, energy, stride)
        except CosimError as error:
            unborn("interrupted" if isinstance(error, Interrupted) else "failed", error)
            raise
        stack.callback(recording.close)
        started = perf_counter()
        failure: CosimError | None = None
        loop = _Loop(system, program, layout, recording, drives, averaged, options.realtime)

        def summary_of(status: str, error: object) -> dict[str, Any]:
            wall = perf_counter() - started
            simulated = loop.time - start
            return {
                "package": str(package),
                "variant": network.structure.file.name,
                "status": status,
                "error": str(error) if error else None,
                "method": options.method,
                "order": system.order,
                "start_time_s": start,
                "stop_time_s": loop.time,
                "step_s": step,
                "steps": loop.done,
                "setup_time_s": started - begin,
                "wall_time_s": wall,
                "real_time_factor": simulated / wall if wall > 0 else None,
                "fmu_time_s": {
                    name: slave.seconds + float(loop.runner.seconds[i])
                    for i, (name, slave) in enumerate(slaves.items())
                },
                "coupling": energy.summary(),
                "warnings": list(dict.fromkeys([*said(slaves.values()), *energy.warnings(), *remarks])),
                "changes": dict(options.changes),
                "columns": recording.names,
                "versions": versions(),
                "machine": {"system": platform.system(), "cpus": os.cpu_count()},
            }

        def abandon(runner: Runner) -> None:
            why = loop.abandon(runner, start, step)
            try:
                recording.flush()
                recording.close()
                write_summary(folder, summary_of("interrupted", why))
            finally:
                give_up(why)  # type: ignore[misc]

        try:
            loop.run(start, stop, step, n, progress, interrupt, abandon)
            remarks += loop.ending(stop)
            recording.flush()
            recording.finish()
        except OutputError as caught:  # nothing more can be written
            failure = SimulationError(f"stopped at t = {loop.time:g} s: {caught}", loop.time)
        except CosimError as caught:
            failure = caught
            with suppress(OutputError):
                recording.flush()
        status = "interrupted" if isinstance(failure, Interrupted) else "failed" if failure else "ok"
        summary = summary_of("ended" if loop.ended_by is not None and not failure else status, failure)
        try:
            write_summary(folder, summary)
        except OutputError:
            if failure is None:
                raise
        if failure:
            raise failure
        result = Result(
            folder,
            summary,
            [c.name for c in layout.columns],
            system.units(),
            recording.sampled(),
            recording.extremes(),
            [name for link in system.links for name in elements(link.source)],
            [name for s in (*system.outputs.values(), *system.own_outputs.values()) for name in elements(s)],
            file,
        )
    if options.check_step:
        _check_step(result, package, options, step, stride, log, progress, give_up)
    return result


def _check_step(
    result: Result, package: Path, options: Options, step: float, stride: int, log: Callable[[str, str, str], None],
    progress: Callable[[int, int], None], give_up: Callable[[str], object] | None,
) -> None:  # fmt: skip
    """Run once more with half the step, and put the estimated errors into the summary."""
    from .check_step import estimate, worst

    with tempfile.TemporaryDirectory(prefix="cosim_") as scratch:
        half = replace(options, step=0.5 * step, results="", check_step=False, realtime=False)
        again = run(package, Path(scratch), half, log, progress, 2 * stride, give_up)
    assert result.sample is not None
    assert again.sample is not None
    errors = estimate(options.method, result.names, result.sample, again.sample)
    outputs = set(result.outputs)  # an input that is held belongs to no point in time
    result.summary["step_check"] = {
        "step_s": 0.5 * step, "errors": {n: e for n, e in errors.items() if n in outputs},
    }  # fmt: skip
    found = worst(result.summary["step_check"]["errors"])
    if found is not None and found[1]["relative"] > TRUSTED:
        result.summary["warnings"].append(
            f"--check-step: '{found[0]}' is off by about {found[1]['relative']:.0%} of its range: do not trust this "
            "run; take a shorter step"
        )
    write_summary(result.folder, result.summary)


def simulate(path: str | Path, out: str | Path | None = None, **options: Any) -> Result:
    """Run a package from Python; `options` are those of `Options`, `changes` may be a mapping.

    >>> result = simulate("deepsea_11km.ssp", changes={"arm.load_weight": 1000})   # doctest: +SKIP
    >>> result.frame["arm.x_h"].plot()                                              # doctest: +SKIP

    Without `out` the results go to results/<name of the package>, as those of the command do.
    """
    package = as_path("package", path)
    folder = as_path("out", out) if out is not None else Path("results") / package.stem
    return run(package, folder, options_of(options))


def set_substeps(options: Options, slaves: dict[str, Slave]) -> None:
    """Give the slaves their steps of their own in a macro step; `UsageError` for what cannot be."""
    for component, ratio in options.substeps:
        if component not in slaves:
            raise UsageError(f"--substeps {component}={ratio}: there is no component '{component}'")
        if not 1 <= ratio <= 1_000_000:
            raise UsageError(f"--substeps {component}={ratio}: it has to be from 1 to a million")
        slaves[component].ratio = ratio


def _uneven(slaves: dict[str, Slave], start: float, stop: float, step: float, n: int) -> list[str]:
    """FMUs that are not made for the shorter step at the end."""
    if abs(start + n * step - stop) <= 1e-9 * max(abs(stop), step):
        return []
    able = "canHandleVariableCommunicationStepSize"
    return [
        f"component '{name}' does not say that it can handle steps of different length ({able}); the last one is "
        "shorter: choose a step that divides the time"
        for name, slave in slaves.items()
        if not getattr(slave.description.coSimulation, able, False)
    ]


def _inner(slaves: dict[str, Slave], step: float) -> list[str]:
    """FMUs whose own step does not fit into the macro step."""
    made = []
    for name, slave in slaves.items():
        own = getattr(slave.description.coSimulation, "fixedInternalStepSize", None)
        count = step / slave.ratio / float(own) if own else 1.0
        if abs(count - round(count)) > 1e-6 * count or round(count) < 1:
            made.append(
                f"component '{name}' has an inner step of {float(own):g} s; its step of {step / slave.ratio:g} s is no "
                "multiple of that"
            )
    return made


def _overruled(changes: Iterable[tuple[str, str]], system: System) -> list[str]:
    """Changes of inputs that connections give their values."""
    driven = {link.target.home: link for link in system.links}
    made = []
    for address, value in changes:
        for end in targets(address, system.slaves):
            link = driven.get(system.inputs[end].home) if end in system.inputs else None
            if link is not None:
                shown = f"'{'.'.join(end)}' is connected to '{link.source.address}', which counts"
                made.append(f"--set {address}={value}: {shown}")
    return made


class _Loop:
    """The macro steps, a slice of time at once."""

    def __init__(
        self, system: System, program: Any, layout: Layout, recording: Recording, drives: list[stimuli.Drive],
        averaged: bool, realtime: bool,
    ):  # fmt: skip
        self.system, self.layout, self.recording, self.drives = system, layout, recording, drives
        self.averaged, self.realtime = averaged, realtime
        if layout.has_texts:
            recording.take_texts(program)
        linked = [link.target for link in system.links]
        finite = [s for s in (*system.outputs.values(), *linked, *system.own_outputs.values()) if s.family == "real"]
        self.runner = Runner(program, layout.outputs, layout.inputs, finite)
        exchange = system.program()
        system.exchange(exchange, system.order)
        system.show(exchange)
        self._exchange = Runner(exchange)
        self._finite = finite
        self.ended_by: Slave | None = None
        """The FMU that has asked to end the run before its time."""
        self.done = 0
        self.time = system.network.structure.start_time

    def run(
        self, start: float, stop: float, h: float, n: int, progress: Callable[[int, int], None], interrupt: Interrupts,
        abandon: Callable[[Runner], None],
    ) -> None:  # fmt: skip
        """Take n steps of h from start, the last one to stop; `abandon` is for an FMU that does not come back."""
        recording = self.recording
        self.time = start
        progress(0, n)
        self._check_start(start)
        begin = perf_counter()
        while self.done < n:
            count = min(recording.room(), n - self.done)
            if self.realtime:
                count = self._wait(begin, start, h, count)
            driven = None
            if self.drives:
                t = np.minimum(start + (self.done + np.arange(count + 1)) * h, stop)
                driven = stimuli.driven_rows(self.drives, t, self.averaged)
            try:
                with interrupt.away(partial(abandon, self.runner)):
                    self.runner.run(recording.rows(count), start, h, self.done, count, n, stop, driven, SLICE)
            except SimulationError as error:
                failed_in_step = self.runner._report[0] == 1
                recording.took(start, h, self.done, self.runner.taken + failed_in_step)
                self._reach(start, stop, h, n)
                if error.time is None:
                    error.time = self.time
                raise
            recording.took(start, h, self.done, self.runner.taken)
            self._reach(start, stop, h, n)
            if recording.due():
                recording.flush()
                progress(self.done, n)
            if interrupt:
                raise Interrupted(f"interrupted at t = {self.time:g} s", self.time)
            if self.runner.ended is not None and self.done < n:
                self.ended_by = self.runner.ended
                stop, n = self.time, self.done
        for drive in self.drives:
            self.system.put(drive.signal, drive.at(np.array([stop]))[0], drive.element)
        with interrupt.away(partial(abandon, self._exchange)):
            self._exchange.once()
        recording.last(self.time)
        progress(n, n)

    def abandon(self, runner: Runner, start: float, h: float) -> str:
        """Take what is complete of the steps that do not end, and say who it is that does not come back."""
        complete, why = runner.stuck()
        self.recording.took(start, h, self.done, complete)
        self.done += complete
        if complete:
            self.time = start + self.done * h
        return f"{why} at t = {self.time:g} s; --isolate with --step-timeout ends such a run by itself"

    def ending(self, stop: float) -> list[str]:
        """What is to be said of an FMU that has ended the run."""
        slave = self.ended_by
        if slave is None:
            return []
        last = slave.last_successful_time()
        early = f", and came to t = {last:g} s in its last step" if last is not None and last < self.time else ""
        return [f"component '{slave.name}' ended the run at t = {self.time:g} s, before {stop:g} s{early}"]

    def _reach(self, start: float, stop: float, h: float, n: int) -> None:
        self.done += self.runner.taken
        self.time = start + self.done * h if self.done < n else stop

    def _check_start(self, start: float) -> None:
        reals = self.system.board.reals
        if any(not np.isfinite(reals[s.place : s.place + s.size]).all() for s in self._finite):
            raise self.runner.not_finite(start)

    def _wait(self, begin: float, start: float, h: float, count: int) -> int:
        """Wait until the next step is due; how many steps may be taken at once."""
        from time import sleep

        ahead = self.done * h - (perf_counter() - begin)
        if ahead > 0.0:
            sleep(min(ahead, 0.2))
        due = int((perf_counter() - begin) / h) + 1 - self.done
        return max(1, min(count, due))
