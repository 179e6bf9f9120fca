"""From a package to a system of FMUs that is ready to be loaded: descriptions, connections, values.

A run, a session and a check all begin so; what is wrong is raised or collected, as the findings say.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from pathlib import Path

from ...ssp.flat_system import End, FlatSystem
from ...ssp.flatten import PARAMETER_KINDS
from ...ssp.model import Component
from ..options import Options
from ..slaves.base import FmuInstance
from .findings import Findings
from .instances import check_single, foreign_connectors, of_component, read_alone, smallest_step
from .package import read_package, with_parameters
from .recordable import internals
from .start_values import StartValue, bound_input_values, bound_values, expanded, resolve
from .structural_parameters import configure
from .system import System

Prepare = Callable[[FlatSystem, dict[str, FmuInstance]], dict[str, FmuInstance]]
"""Gives the instances as they are to be run."""


@dataclass
class Assembly:
    """What a package is put together to. Where errors are collected, parts may be missing."""

    network: FlatSystem
    instances: dict[str, FmuInstance]
    built: System | None = None
    values: list[StartValue] = field(default_factory=list)
    """Start values and parameters in the order in which they are set: of the package, then of the options."""
    structural_values: list[StartValue] = field(default_factory=list)
    """The same for structural parameters, which the instances have been given already."""
    incomplete: bool = False
    """Whether parts of the package are not in `network`, for they could not be read or connected."""

    @property
    def system(self) -> System:
        """The system; there is one where errors are raised."""
        assert self.built is not None
        return self.built

    @property
    def has_all(self) -> bool:
        """Whether every component's FMU could be read."""
        return bool(self.instances) and len(self.instances) == len(self.network.components)


def assemble(
    package: Path, options: Options, stack: ExitStack, findings: Findings, only: Sequence[str] = (),
    prepare: Prepare = lambda _network, instances: instances,
) -> Assembly | None:  # fmt: skip
    """Read the package, and put it together; what it was unpacked into goes with the stack.

    only: components to take, all where it is empty; prepare: called before the instances are connected. None where the
    package cannot be read and errors are collected; raises `CosimError` where they are not.
    """
    errors_before = len(findings.errors)
    network = findings.attempt(read_package, package, stack, options.variant, findings.collected)
    if network is None:
        return None
    assembly = Assembly(
        network.only(list(only)) if only else network, {}, incomplete=len(findings.errors) > errors_before
    )
    if_complete = findings.muted_if(assembly.incomplete)
    assembly.network = if_complete.attempt(with_parameters, assembly.network, options.parameters) or assembly.network
    _tell_remarks(assembly.network, findings)
    assembly.network, assembly.instances = _described(assembly.network, findings)
    if not assembly.network.components and not findings.errors:
        findings.refuse("the system has no components")
    if assembly.has_all and not options.isolate:
        findings.attempt(check_single, assembly.instances)
    input_changes = [c for c in options.changes if c[0] in assembly.network.inputs]
    other_changes = _expanded(assembly, [c for c in options.changes if c not in input_changes], if_complete)
    sizes_known = _set_structural_parameters(assembly, other_changes, findings, if_complete)
    assembly.instances = prepare(assembly.network, assembly.instances)
    if assembly.network.structure.step_size is None:
        suggested = replace(assembly.network.structure, step_size=smallest_step(assembly.network, assembly.instances))
        assembly.network = replace(assembly.network, structure=suggested)
    if assembly.has_all and sizes_known:
        _connect(assembly, input_changes, (*options.record, *options.plot), findings, if_complete)
    return assembly


def _tell_remarks(network: FlatSystem, findings: Findings) -> None:
    """Where errors are collected, violations of the schema are some, unless they stand where one has been told."""
    violations = set(network.structure.remarks) if findings.collects else set()
    places = {error.partition(": ")[0] for error in findings.errors}
    findings.errors += [r for r in network.structure.remarks if r in violations and r.partition(": ")[0] not in places]
    findings.warnings += [r for r in network.remarks if r not in violations]


def _described(network: FlatSystem, findings: Findings) -> tuple[FlatSystem, dict[str, FmuInstance]]:
    """Instances by component path, not loaded yet, from the package's FMUs; the network without what these refute."""
    instances: dict[str, FmuInstance] = {}
    lacking: set[End] = set()
    for path, flat_component in network.components.items():
        instance = findings.attempt(of_component, path, flat_component.component)
        if instance is None:
            instance = read_alone(path, flat_component.component)
        if instance is not None:
            instances[path] = instance
            lacking |= _lacking(flat_component.component, instance, network, findings)
    return network.without(lacking), instances


def _lacking(component: Component, instance: FmuInstance, network: FlatSystem, findings: Findings) -> set[End]:
    """Ends that the FMU lacks, which are refused; those of parameters do no harm where nothing is connected to them."""
    refused: set[End] = set()
    for connector, fault in foreign_connectors(component, instance):
        end = (instance.name, connector.name)
        if connector.kind in PARAMETER_KINDS and not network.connects(end):
            findings.warnings.append(f"{fault}; nothing is connected to it, so it is ignored")
        else:
            findings.refuse(fault)
            refused.add(end)
    return refused


def _expanded(assembly: Assembly, changes: Sequence[tuple[str, str]], findings: Findings) -> list[tuple[str, str]]:
    """Changes with those of connectors of systems replaced by what these lead to."""
    if not assembly.has_all:
        return []
    reached: list[tuple[str, str]] = []
    for change in changes:
        reached += (
            findings.attempt(lambda *pair: list(expanded(pair, assembly.network, assembly.instances)), change) or []
        )
    return reached


def _set_structural_parameters(
    assembly: Assembly, changes: list[tuple[str, str]], findings: Findings, if_complete: Findings
) -> bool:
    """Structural parameters first, then the values that the package binds and that the user changes.

    Returns whether the sizes of arrays are as they are meant; where not, no connection can be judged.
    """
    network, instances = assembly.network, assembly.instances
    configured = findings.attempt(configure, network, instances, changes)
    assembly.network, changes, assembly.structural_values = configured or (network, changes, [])
    assembly.values = bound_values(assembly.network, instances, findings)
    for change in changes:
        names = (*network.inputs, *network.connectors)
        assembly.values += if_complete.attempt(resolve, [change], instances, connectors=names) or []
    sized = any(v.causality == "structuralParameter" for i in instances.values() for v in i.variables.values())
    return configured is not None and not (assembly.incomplete and sized)


def _connect(
    assembly: Assembly, input_changes: Sequence[tuple[str, str]], patterns: Sequence[str], findings: Findings,
    if_complete: Findings,
) -> None:  # fmt: skip
    """The system with all that is to be recorded of it, and the values of its own inputs."""
    recorded = internals(assembly.network, assembly.instances, patterns)
    system = assembly.built = findings.attempt(System, assembly.network, assembly.instances, findings, recorded)
    if system is None:
        return
    findings.warnings += system.remarks
    values = findings.attempt(bound_input_values, assembly.network, system, findings.warnings.append) or []
    assembly.values = [*values, *assembly.values]
    for change in input_changes:
        assembly.values += if_complete.attempt(resolve, [change], assembly.instances, system=system) or []
