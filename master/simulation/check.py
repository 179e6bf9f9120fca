"""Looks for everything that is wrong with a package, without loading an FMU: schema first, then meaning."""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path

from ...core.errors import PackageError, ParameterError
from ...ssp.flat_system import FlatSystem
from ...ssp.model import Component
from ..algorithms import choose_method
from ..coupling.algebraic_loops import loops
from ..engine.values import TEXT
from ..options import Options
from ..results.columns import RecordLayout
from ..slaves.base import FmuInstance
from ..system.assemble import Assembly, assemble
from ..system.findings import Findings
from ..system.instances import mixed_libraries
from ..system.start_values import StartValue, idle
from ..system.system import System
from . import stimuli
from .plan import answers_of, check_categories, check_coupling, check_options, check_saving, set_substeps, step_remarks
from .time_grid import TimeGrid, time_grid


@dataclass
class Checked(Findings):
    """What a check found, and what could be read of the package."""

    collects: bool = True
    network: FlatSystem | None = None
    system: System | None = None
    values: list[StartValue] = field(default_factory=list)
    """What would be set before a run, in that order."""
    incomplete: bool = False
    """Whether parts of the package are not in `network`, for they could not be read or connected."""


def check(package: Path, wanted: Options | None = None) -> Checked:
    """Read a package and everything in it; nothing is raised for what is wrong with it, or with how it is to be run."""
    wanted = wanted or Options()
    report = Checked()
    report.attempt(check_options, wanted)

    def as_run(_network: FlatSystem, instances: dict[str, FmuInstance]) -> dict[str, FmuInstance]:
        Findings(collects=True).attempt(set_substeps, wanted, instances)  # what is wrong with them is told below
        return instances

    with ExitStack() as stack:
        assembly = assemble(package, wanted, stack, report, prepare=as_run)
        if assembly is None:
            report.tell_once()
            return report
        report.network, report.system, report.incomplete = assembly.network, assembly.built, assembly.incomplete
        report.values = [*assembly.structural_values, *assembly.values]
        if_complete = report.muted_if(assembly.incomplete)  # what may follow from parts that are missing is not told
        times = _times(report, assembly, wanted)
        for path, flat_component in assembly.network.components.items():
            if path in assembly.instances:
                _connectors(report, flat_component.component, assembly.instances[path], path)
        if assembly.has_all:
            if_complete.attempt(set_substeps, wanted, assembly.instances)
            if_complete.attempt(check_categories, wanted, assembly.instances)
            if_complete.attempt(check_saving, wanted, assembly.instances)
            if not wanted.isolate:
                report.warnings += mixed_libraries(assembly.instances)
            if times is not None:
                report.warnings += step_remarks(assembly.network, assembly.instances, times)
            for path, instance in assembly.instances.items():
                report.warnings += _starts(path, instance)
        if assembly.built is not None:
            _run(report, if_complete, assembly, wanted, times)
    report.tell_once()
    return report


def _times(findings: Findings, assembly: Assembly, wanted: Options) -> TimeGrid | None:
    structure = assembly.network.structure
    if structure.stop_time is None and wanted.stop_time is None:
        findings.notes.append("the package has no stop time; a run needs --stop-time")
        return None
    return findings.attempt(time_grid, structure, wanted.stop_time, wanted.step)


def _run(
    findings: Findings, if_complete: Findings, assembly: Assembly, wanted: Options, times: TimeGrid | None
) -> None:
    """What a run of the system would meet."""
    system = assembly.system
    if_no_errors = findings.muted_if(bool(findings.errors))  # what follows from an error is not told
    layout = if_no_errors.attempt(RecordLayout, system)
    if layout is not None:
        if_no_errors.attempt(layout.chosen, wanted.record)
        if_no_errors.attempt(layout.chosen, wanted.plot, "--plot")
        findings.warnings += answers_of(assembly, layout)[1]
    method = if_no_errors.attempt(choose_method, wanted.method, assembly.network.structure.method)
    if method is not None:
        if_complete.attempt(check_coupling, system, method, wanted.isolate)
    if_complete.warnings += idle(assembly.network, assembly.values)
    given = {(v.component, v.variable) for v in assembly.values if not v.component}
    connected = {
        flat_connection.end for flat_connection in assembly.network.flat_connections
    }  # of which some may have been refused
    _inputs(if_complete, system, _driven(if_complete, system, wanted, times) | given | connected)
    _loops(findings, system)


def _connectors(findings: Findings, component: Component, instance: FmuInstance, path: str) -> None:
    """Connectors against the FMU's variables: names, kinds and types."""
    for c in component.connectors:
        v = instance.variables.get(c.name)
        if v is None:
            continue
        cause = v.causality or "local"
        if c.kind in ("input", "output", "parameter", "calculatedParameter", "structuralParameter") and c.kind != cause:
            findings.warnings.append(
                f"{c.where}: connector '{path}.{c.name}' is of kind {c.kind}, its FMU says {cause}"
            )
        if c.type is not None and not _fits(c.type.kind, v.type):
            findings.warnings.append(f"{c.where}: connector '{path}.{c.name}' is {c.type.kind}, its FMU says {v.type}")


def _starts(path: str, instance: FmuInstance) -> list[str]:
    """Start values of the model description that are beyond its own limits."""
    warnings = []
    for v in instance.description.modelVariables:
        fmi_type = instance.types.get(v.type)
        if v.name not in instance.variables:  # a negated alias that nobody asks for (FMI 1.0)
            continue
        if v.start in (None, "") or fmi_type is None or fmi_type.family == TEXT or v.dimensions:
            continue
        try:
            instance.checked(v.name, v.start, "")
        except ParameterError as error:
            warnings.append(f"the model description of '{path}' contradicts itself: {str(error).removeprefix(': ')}")
        except PackageError as error:  # a run may never ask for that limit
            warnings.append(str(error))
    return warnings


def _fits(said: str, own: str) -> bool:
    same = {"Real": "Float64", "Integer": "Int32"}
    return same.get(said, said) == same.get(own, own)


def _driven(findings: Findings, system: System, wanted: Options, times: TimeGrid | None) -> set[tuple[str, str]]:
    """Check what a table drives; the inputs that it drives."""
    if wanted.stimuli is None:
        return set()
    path = wanted.stimuli
    drives: list[stimuli.InputSeries] = findings.attempt(stimuli.read, path, system) or []
    if times is not None:
        findings.warnings += stimuli.remarks(path, drives, system, times.start, times.stop)
    return {(d.signal.component, d.signal.name) for d in drives}


def _inputs(findings: Findings, system: System, others: set[tuple[str, str]]) -> None:
    driver = system.connections.driver
    driven = {signal.home for end, signal in system.inputs.items() if end in others or driver(end) is not None}
    idle: dict[str, list[str]] = {}
    for (component, name), signal in system.inputs.items():
        if signal.home not in driven:
            idle.setdefault(component, []).append(name)
    for component, names in idle.items():
        if len(names) == 1:
            findings.notes.append(f"input '{component}.{names[0]}' is driven by nothing; it keeps its start value")
        else:
            shown = ", ".join(f"'{component}.{name}'" for name in names)
            findings.notes.append(f"inputs are driven by nothing and keep their start values: {shown}")
    for name in system.system_inputs:
        if ("", name) not in others:
            findings.notes.append(
                f"the system's input '{name}' is given nothing; what it leads to keeps its start value"
            )


def _loops(findings: Findings, system: System) -> None:
    certain = loops(system)
    for loop in certain:
        findings.warnings.append(f"algebraic loop: {' -> '.join(loop)}")
    if not certain:
        for loop in loops(system, doubtful=True):
            findings.notes.append(
                f"possible algebraic loop, for an FMU does not say what its outputs depend on: {' -> '.join(loop)}"
            )
