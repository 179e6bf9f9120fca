"""A package that is loaded once and run many times, for whoever needs thousands of runs: estimation, sweeps.

Each run resets the FMUs, which is a matter of milliseconds, and keeps only the signals that were asked for.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np

from ..core.errors import SimulationError, UnknownNameError, UsageError, did_you_mean
from ..ssp.model import SystemStructure
from .algorithms import NAMES, algorithm
from .setup import (
    bound_values,
    check_connections,
    initialise,
    load_descriptions,
    load_slaves,
    read_package,
    resolve,
    settable,
    split,
)
from .system import System

Series = tuple[np.ndarray, np.ndarray]
"""Times [s] (n,) and values (n,)."""


class Session:
    """The system of an SSP package, loaded; a context manager. Not for use from several threads.

    only: names of the components to load; the inputs that the others would give can then be driven.
    """

    def __init__(
        self, package: Path, log: Callable[[str, str, str], None] = lambda *_: None, only: Sequence[str] = ()
    ):
        self._stack = ExitStack()
        try:
            self.structure = read_package(package, self._stack)
            if only:
                self.structure = _part(self.structure, only)
            slaves = load_descriptions(self.structure)
            check_connections(self.structure, slaves)
            self._bound = bound_values(self.structure, slaves)
            load_slaves(slaves, self._stack, log)
            self.system = System(self.structure, slaves)
        except BaseException:
            self._stack.close()
            raise
        self._fresh = True

    def __enter__(self) -> Session:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._stack.close()

    def place(self, address: str) -> tuple[bool, int]:
        """(is an output, place in its array) of the signal component.variable."""
        component, name = split(address, self.system.slaves)
        for signals, is_output in ((self.system.outputs, True), (self.system.inputs, False)):
            if (component, name) in signals:
                return is_output, signals[component, name].place
        known = [f"{c}.{n}" for c, n in (*self.system.outputs, *self.system.inputs)]
        raise UnknownNameError(f"no connector '{address}'{did_you_mean(address, known)}")

    def values(self, changes: Mapping[str, Any] | None = None) -> dict[str, Any]:
        """Every parameter and start value in force with these changes, by component.variable."""
        slaves = self.system.slaves
        found = {
            f"{c}.{v.name}": slave.checked(v.name, v.start, v.name)
            for c, slave in slaves.items()
            for v in slave.description.modelVariables
            if v.start is not None and settable(slave, v.name)
        }
        for component, name, value, _ in [*self._bound, *resolve((changes or {}).items(), slaves, "")]:
            found[f"{component}.{name}"] = value
        return found

    def run(
        self,
        record: Sequence[str],
        stop: float,
        step: float,
        changes: Mapping[str, Any] | None = None,
        inputs: Mapping[str, Series] | None = None,
        method: str = NAMES[0],
    ) -> tuple[np.ndarray, np.ndarray]:
        """Times (n,) and recorded signals (n, len(record)) of a run from the package's start time to `stop` [s].

        changes: parameters by address, on top of the package's; inputs: series by address of unconnected inputs, joined
        by straight lines and held beyond their ends. Raises `SimulationError` when an FMU fails or a recorded value is
        not finite; the session can be used again afterwards.
        """
        system = self.system
        start = self.structure.start_time
        n = round((stop - start) / step)
        if n < 1:
            raise UsageError(f"a run from {start:g} s to {stop:g} s has no step of {step:g} s")
        outputs = [self.place(address) for address in record]
        connected = {link.target for link in system.links}
        driven = []
        times = start + np.arange(n + 1) * step
        for address, (t, values) in (inputs or {}).items():
            is_output, place = self.place(address)
            if is_output or place in connected:
                raise UsageError(f"'{address}' cannot be driven: it is {'an output' if is_output else 'connected'}")
            driven.append((place, np.interp(times, t, values)))
        values = [*self._bound, *resolve((changes or {}).items(), system.slaves, "")]
        if not self._fresh:
            for slave in system.slaves.values():
                slave.reset()
        self._fresh = False
        system.reset_inputs()
        for place, series in driven:
            system.given[place] = series[0]
        initialise(system, values, start, stop)
        advance = algorithm(method)
        rows = np.empty((n + 1, len(record)))
        read, given = system.read, system.given
        for k in range(n):
            for place, series in driven:
                given[place] = series[k]
            rows[k] = [read[place] if is_output else given[place] for is_output, place in outputs]
            advance(system, times[k], step)
        for place, series in driven:
            given[place] = series[n]
        rows[n] = [read[place] if is_output else given[place] for is_output, place in outputs]
        if not np.isfinite(rows).all():
            k, i = np.argwhere(~np.isfinite(rows))[0]
            raise SimulationError(f"'{record[i]}' is not finite at t = {times[k]:g} s", float(times[k]))
        return times, rows


def _part(structure: SystemStructure, names: Sequence[str]) -> SystemStructure:
    """The system without the other components, their connections and parameters."""
    known = [c.name for c in structure.components]
    for name in names:
        if name not in known:
            raise UnknownNameError(f"no component '{name}'{did_you_mean(name, known)}")
    owner = {p.name: next((c for c in sorted(known, key=len)[::-1] if p.name.startswith(f"{c}.")), "")
             for p in structure.parameters}  # fmt: skip
    return replace(
        structure,
        components=tuple(c for c in structure.components if c.name in names),
        connections=tuple(c for c in structure.connections if c.start[0] in names and c.end[0] in names),
        parameters=tuple(p for p in structure.parameters if owner[p.name] in names),
    )
