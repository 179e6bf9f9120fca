"""Looks for everything that is wrong with a package, without loading an FMU: schema first, then meaning."""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path

from ...core.errors import PackageError, ParameterError
from ...ssp.flat_system import FlatSystem
from ...ssp.model import Component
from ..algorithms import chosen
from ..coupling.algebraic_loops import loops
from ..engine.values import TEXT
from ..options import Options
from ..results.columns import Layout
from ..slaves.base import FmuInstance
from ..system.assemble import Assembly, assemble
from ..system.findings import Findings
from ..system.instances import mixed_libraries
from ..system.start_values import Value, idle
from ..system.system import System
from . import stimuli
from .plan import check_categories, check_coupling, check_options, check_saving, set_substeps, step_remarks
from .time_grid import Times, times_of


@dataclass
class Checked(Findings):
    """What a check found, and what could be read of the package."""

    collects: bool = True
    network: FlatSystem | None = None
    system: System | None = None
    values: list[Value] = field(default_factory=list)
    """What would be set before a run, in that order."""
    incomplete: bool = False
    """Whether parts of the package are not in `network`, for they could not be read or connected."""


def check(package: Path, wanted: Options | None = None) -> Checked:
    """Read a package and everything in it; nothing is raised for what is wrong with it, or with how it is to be run."""
    wanted = wanted or Options()
    found = Checked()
    found.attempt(check_options, wanted)

    def as_run(_network: FlatSystem, instances: dict[str, FmuInstance]) -> dict[str, FmuInstance]:
        Findings(collects=True).attempt(set_substeps, wanted, instances)  # what is wrong with them is told below
        return instances

    with ExitStack() as stack:
        made = assemble(package, wanted, stack, found, prepare=as_run)
        if made is None:
            found.tell_once()
            return found
        found.network, found.system, found.incomplete = made.network, made.built, made.incomplete
        found.values = [*made.sizes, *made.values]
        if_complete = found.muted_if(made.incomplete)  # what may follow from parts that are missing is not told
        times = _times(found, made, wanted)
        for path, part in made.network.parts.items():
            if path in made.instances:
                _connectors(found, part.component, made.instances[path], path)
        if made.has_all:
            if_complete.attempt(set_substeps, wanted, made.instances)
            if_complete.attempt(check_categories, wanted, made.instances)
            if_complete.attempt(check_saving, wanted, made.instances)
            if not wanted.isolate:
                found.warnings += mixed_libraries(made.instances)
            if times is not None:
                found.warnings += step_remarks(made.network, made.instances, times)
            for path, instance in made.instances.items():
                found.warnings += _starts(path, instance)
        if made.built is not None:
            _run(found, if_complete, made, wanted, times)
    found.tell_once()
    return found


def _times(found: Findings, made: Assembly, wanted: Options) -> Times | None:
    structure = made.network.structure
    if structure.stop_time is None and wanted.stop_time is None:
        found.notes.append("the package has no stop time; a run needs --stop-time")
        return None
    return found.attempt(times_of, structure, wanted.stop_time, wanted.step)


def _run(found: Findings, if_complete: Findings, made: Assembly, wanted: Options, times: Times | None) -> None:
    """What a run of the system would meet."""
    system = made.system
    told = found.muted_if(bool(found.errors))  # what follows from an error is not told
    layout = told.attempt(Layout, system)
    if layout is not None:
        told.attempt(layout.chosen, wanted.record)
        told.attempt(layout.chosen, wanted.plot, "--plot")
    method = told.attempt(chosen, wanted.method, made.network.structure.method)
    if method is not None:
        if_complete.attempt(check_coupling, system, method, wanted.isolate)
    if_complete.warnings += idle(made.network, made.values)
    given = {(v.component, v.variable) for v in made.values if not v.component}
    connected = {
        flat_connection.end for flat_connection in made.network.flat_connections
    }  # of which some may have been refused
    _inputs(if_complete, system, _driven(if_complete, system, wanted, times) | given | connected)
    _loops(found, system)


def _connectors(found: Findings, component: Component, instance: FmuInstance, path: str) -> None:
    """Connectors against the FMU's variables: names, kinds and types."""
    for c in component.connectors:
        v = instance.variables.get(c.name)
        if v is None:
            continue
        cause = v.causality or "local"
        if c.kind in ("input", "output", "parameter", "calculatedParameter", "structuralParameter") and c.kind != cause:
            found.warnings.append(f"{c.where}: connector '{path}.{c.name}' is of kind {c.kind}, its FMU says {cause}")
        if c.type is not None and not _fits(c.type.kind, v.type):
            found.warnings.append(f"{c.where}: connector '{path}.{c.name}' is {c.type.kind}, its FMU says {v.type}")


def _starts(path: str, instance: FmuInstance) -> list[str]:
    """Start values of the model description that are beyond its own limits."""
    made = []
    for v in instance.description.modelVariables:
        form = instance.forms.get(v.type)
        if v.start in (None, "") or form is None or form.family == TEXT or v.dimensions:
            continue
        try:
            instance.checked(v.name, v.start, "")
        except ParameterError as error:
            made.append(f"the model description of '{path}' contradicts itself: {str(error).removeprefix(': ')}")
        except PackageError as error:  # a run may never ask for that limit
            made.append(str(error))
    return made


def _fits(said: str, own: str) -> bool:
    same = {"Real": "Float64", "Integer": "Int32"}
    return same.get(said, said) == same.get(own, own)


def _driven(found: Findings, system: System, wanted: Options, times: Times | None) -> set[tuple[str, str]]:
    """Check what a table drives; the inputs that it drives."""
    if wanted.stimuli is None:
        return set()
    path = wanted.stimuli
    drives: list[stimuli.Drive] = found.attempt(stimuli.read, path, system) or []
    if times is not None:
        found.warnings += stimuli.remarks(path, drives, system, times[0], times[1])
    return {(d.signal.component, d.signal.name) for d in drives}


def _inputs(found: Findings, system: System, others: set[tuple[str, str]]) -> None:
    driver = system.connections.driver
    driven = {signal.home for end, signal in system.inputs.items() if end in others or driver(end) is not None}
    idle: dict[str, list[str]] = {}
    for (component, name), signal in system.inputs.items():
        if signal.home not in driven:
            idle.setdefault(component, []).append(name)
    for component, names in idle.items():
        if len(names) == 1:
            found.notes.append(f"input '{component}.{names[0]}' is driven by nothing; it keeps its start value")
        else:
            shown = ", ".join(f"'{component}.{name}'" for name in names)
            found.notes.append(f"inputs are driven by nothing and keep their start values: {shown}")
    for name in system.system_inputs:
        if ("", name) not in others:
            found.notes.append(f"the system's input '{name}' is given nothing; what it leads to keeps its start value")


def _loops(found: Findings, system: System) -> None:
    certain = loops(system)
    for loop in certain:
        found.warnings.append(f"algebraic loop: {' -> '.join(loop)}")
    if not certain:
        for loop in loops(system, doubtful=True):
            found.notes.append(
                f"possible algebraic loop, for an FMU does not say what its outputs depend on: {' -> '.join(loop)}"
            )
