"""Runs a package from start to end: read, check everything, load, initialise, step, record, free."""

from __future__ import annotations

import json
import os
import platform
import signal
import tempfile
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, field
from importlib import metadata
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from ..core.errors import CosimError, Interrupted, OutputError, SimulationError, UsageError
from ..ssp.model import SystemStructure
from .algorithms import NAMES, algorithm
from .bonds import ResidualEnergy, find_bonds
from .recorder import BLOCK, CsvRecorder
from .setup import (
    bound_values,
    check_connections,
    initialise,
    load_descriptions,
    load_slaves,
    read_package,
    resolve,
)
from .slave import Slave
from .system import System

FILES = ("results.csv", "summary.json", "overview.png")
DEFAULT_STEPS = 1000
SAMPLE = 4000
TRUSTED = 0.1
"""Share of residual energy above which a run warns."""


@dataclass(frozen=True)
class Options:
    """What a run may be told. `changes` are (address, value) pairs, address = component.parameter or parameter."""

    step: float | None = None
    stop_time: float | None = None
    method: str = NAMES[0]
    changes: tuple[tuple[str, str], ...] = ()


@dataclass
class Result:
    """What a run left behind."""

    folder: Path
    summary: dict[str, Any]
    names: list[str] = field(default_factory=list)
    units: dict[str, str] = field(default_factory=dict)
    sample: np.ndarray | None = None
    """Communication points at even distances, at most about `SAMPLE` rows (n, columns), for plots."""
    extremes: np.ndarray | None = None
    """First, least, greatest and last value of each column (4, columns)."""
    connected: list[str] = field(default_factory=list)
    """Names of the outputs that drive an input."""
    outputs: list[str] = field(default_factory=list)


def parse_change(text: str) -> tuple[str, str]:
    """'component.parameter=value' as (address, value)."""
    address, equals, value = text.partition("=")
    if not equals or not address.strip() or not value.strip():
        raise UsageError(f"--set {text}: expected component.parameter=value, e.g. --set arm.load_weight=1000")
    return address.strip(), value.strip()


def _times(structure: SystemStructure, options: Options) -> tuple[float, float, float, int]:
    """Start, stop, step [s] and number of steps; the last one is shorter when the step does not divide the time."""
    start = structure.start_time
    stop = options.stop_time if options.stop_time is not None else structure.stop_time
    if stop is None:
        raise UsageError("the package has no DefaultExperiment with a stopTime; give one with --stop-time")
    if not (np.isfinite(stop) and stop > start):
        raise UsageError(f"stop time {stop:g} s: it has to be later than the start time {start:g} s")
    step = options.step if options.step is not None else structure.step_size
    if step is None:
        step = (stop - start) / DEFAULT_STEPS
    if not (np.isfinite(step) and step > 0.0):
        raise UsageError(f"step {step:g} s: it has to be positive")
    if step > stop - start:
        raise UsageError(f"step {step:g} s is longer than the whole run of {stop - start:g} s")
    count = (stop - start) / step
    if start + step == start or stop - step == stop:
        raise UsageError(f"step {step:g} s is less than what times around {stop:g} s resolve")
    if count > 1e10:
        raise UsageError(f"step {step:g} s would take {count:.1e} steps; choose a longer one")
    n = round(count) if abs(count - round(count)) < 1e-6 else int(count) + 1
    return start, stop, step, n


@contextmanager
def _interrupts() -> Iterator[list[int]]:
    """A list that Ctrl-C makes non-empty. An exception instead would end up in an FMU that is written in Python."""
    asked: list[int] = []
    if threading.current_thread() is not threading.main_thread():
        yield asked
        return
    before = signal.signal(signal.SIGINT, lambda number, _frame: asked.append(number))
    try:
        yield asked
    finally:
        signal.signal(signal.SIGINT, before)


def versions() -> dict[str, str]:
    """Versions of what a run depends on."""
    found = {"python": platform.python_version()}
    for package in ("deepsea-cosim", "fmpy", "numpy", "numba", "mujoco", "pythonfmu"):
        try:
            found[package] = metadata.version(package)
        except metadata.PackageNotFoundError:
            continue
    return found


def _warnings(energy: ResidualEnergy, slaves: Mapping[str, Slave]) -> list[str]:
    """What the user should know although the run came to its end."""
    found = [f"{name}: {text}" for name, slave in slaves.items() for kind, text in slave.messages if kind == "warning"]
    for bond in energy.summary():
        if bond["relative"] > TRUSTED:
            found.append(
                f"the coupling created or destroyed {bond['relative']:.0%} of the energy exchanged over "
                f"{bond['bond']}: do not trust this run; take a shorter step"
            )
    return list(dict.fromkeys(found))


def write_summary(folder: Path, summary: Mapping[str, Any]) -> None:
    """Write summary.json."""
    try:
        (folder / "summary.json").write_text(json.dumps(summary, indent=2) + "\n")
    except OSError as error:
        raise OutputError(f"{folder / 'summary.json'}: cannot be written ({error.strerror})") from None


def prepare_folder(folder: Path) -> None:
    """Make the result folder, or say why that is not possible."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name in FILES:  # what an earlier run left would pass for this one's
            (folder / name).unlink(missing_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise OutputError(f"result folder {folder}: cannot be written ({error.strerror})") from None


def run(
    package: Path,
    folder: Path,
    options: Options | None = None,
    log: Callable[[str, str, str], None] = lambda *_: None,
    progress: Callable[[int, int], None] = lambda *_: None,
) -> Result:
    """Run the SSP file `package`, write results.csv and summary.json into `folder`.

    `log` gets (component, status, text) of every message of an FMU, `progress` (steps done, steps in all) at the start
    and now and then.
    Raises `CosimError`; what was recorded until then is kept on disk.
    """
    options = options or Options()
    begin = perf_counter()
    step_algorithm = algorithm(options.method)
    with ExitStack() as stack:
        interrupt = stack.enter_context(_interrupts())
        structure = read_package(package, stack)
        start, stop, step, n = _times(structure, options)
        slaves = load_descriptions(structure)
        check_connections(structure, slaves)
        values = [*bound_values(structure, slaves), *resolve(options.changes, slaves)]
        prepare_folder(folder)
        try:
            load_slaves(slaves, stack, log)
            system = System(structure, slaves)
            initialise(system, values, start, stop)
            if interrupt:
                raise Interrupted("interrupted before the first step", start)
        except CosimError as error:
            write_summary(folder, {"package": str(package), "status": "failed", "error": str(error), "steps": 0})
            raise
        energy = ResidualEnergy(find_bonds(system))
        recorder = CsvRecorder(folder / "results.csv", system)
        stack.callback(recorder.close)
        started = perf_counter()
        loop = _Loop(system, recorder, energy, max(1, n // SAMPLE))
        failure: CosimError | None = None
        try:
            with np.errstate(invalid="ignore", over="ignore"):
                loop.run(step_algorithm, start, stop, step, n, progress, interrupt)
            loop.flush()
        except OutputError as caught:  # nothing more can be written
            failure = SimulationError(f"stopped at t = {loop.time:g} s: {caught}", loop.time)
        except CosimError as caught:
            failure = caught
            with suppress(OutputError):
                loop.flush()
        wall = perf_counter() - started
        simulated = loop.time - start
        summary = {
            "package": str(package),
            "status": "interrupted" if isinstance(failure, Interrupted) else "failed" if failure else "ok",
            "error": str(failure) if failure else None,
            "method": options.method,
            "order": system.order,
            "start_time_s": start,
            "stop_time_s": loop.time,
            "step_s": step,
            "steps": loop.done,
            "setup_time_s": started - begin,
            "wall_time_s": wall,
            "real_time_factor": simulated / wall if wall > 0 else None,
            "fmu_time_s": {name: slave.seconds for name, slave in slaves.items()},
            "coupling": energy.summary(),
            "warnings": _warnings(energy, slaves),
            "changes": dict(options.changes),
            "columns": recorder.names,
            "versions": versions(),
            "machine": {"system": platform.system(), "cpus": os.cpu_count()},
        }
        try:
            write_summary(folder, summary)
        except OutputError:
            if failure is None:
                raise
        if failure:
            raise failure
        return Result(
            folder,
            summary,
            recorder.names,
            system.units(),
            recorder.in_order(np.concatenate(loop.sample)),
            recorder.in_order(np.array([loop.first, loop.least, loop.greatest, loop.last])),
            [".".join(link.start) for link in system.links],
            [f"{component}.{name}" for component, name in system.outputs],
        )


class _Loop:
    """The macro steps, with a block of rows in memory at a time."""

    def __init__(self, system: System, recorder: CsvRecorder, energy: ResidualEnergy, stride: int):
        self.system, self.recorder, self.energy = system, recorder, energy
        self.sample: list[np.ndarray] = []
        self.stride = stride
        self.flushed = 0
        self.block = np.zeros((BLOCK, 1 + len(system.read) + len(system.given)))
        self.filled = 0
        self.done = 0
        self.time = system.structure.start_time

    def flush(self) -> None:
        """Write the rows of the block that are complete."""
        rows = self.block[: self.filled]
        split = 1 + len(self.system.read)
        self.energy.add(rows[:, 0], rows[:, 1:split], rows[:, split:])
        self.recorder.write(rows)
        if self.filled:
            self.sample.append(rows[-self.flushed % self.stride :: self.stride].copy())
            if self.flushed == 0:
                self.first = self.least = self.greatest = rows[0].copy()
            self.least = np.minimum(self.least, rows.min(axis=0))
            self.greatest = np.maximum(self.greatest, rows.max(axis=0))
            self.last = rows[-1].copy()
        self.flushed += self.filled
        self.filled = 0

    def run(
        self, step: Callable[..., None], start: float, stop: float, h: float, n: int,
        progress: Callable[[int, int], None], interrupt: list[int],
    ) -> None:  # fmt: skip
        """Take n steps of h from start, the last one to stop."""
        system, block = self.system, self.block
        read, given = system.read, system.given
        split = 1 + len(read)
        zeros = np.zeros(len(read))
        self.time = start
        progress(0, n)
        if read.dot(zeros) != 0.0:
            raise self._not_finite(start)
        for k in range(n):
            t = start + k * h
            row = block[self.filled]
            row[0] = t
            row[1:split] = read
            try:
                step(system, t, h if k < n - 1 else stop - t)
            finally:  # the point at t is complete, whatever becomes of the step
                row[split:] = given
                self.filled += 1
            self.done = k + 1
            self.time = start + (k + 1) * h if k < n - 1 else stop
            if read.dot(zeros) != 0.0:  # 0 * inf and 0 * NaN are NaN
                raise self._not_finite(self.time)
            if self.filled == BLOCK:
                self.flush()
                progress(self.done, n)
            if interrupt:
                raise Interrupted(f"interrupted at t = {self.time:g} s", self.time)
        system.exchange_all()
        row = block[self.filled]
        row[0], row[1:split], row[split:] = self.time, read, given
        self.filled += 1
        if n % self.stride:
            self.sample.append(row[None].copy())
        progress(n, n)

    def _not_finite(self, t: float) -> SimulationError:
        bad = [
            f"{component}.{name} = {self.system.read[signal.place]:g}"
            for (component, name), signal in self.system.outputs.items()
            if not np.isfinite(self.system.read[signal.place])
        ]
        return SimulationError(f"not finite at t = {t:g} s: {', '.join(bad)}", t)
