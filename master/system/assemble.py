"""From a package to a system of FMUs that is ready to be loaded: descriptions, connections, values.

A run, a session and a check all begin so; what is wrong is raised or kept, as the findings say.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from pathlib import Path

from ...ssp.flat import End, Network
from ...ssp.model import Component
from ...ssp.network import EARLY
from ..options import Options
from ..slaves.base import FmuInstance
from .findings import Findings
from .instances import check_single, foreign_connectors, of_component, read_alone, smallest_step
from .package import read_package, with_parameters
from .recordable import internals
from .start_values import Value, bound_values, expanded, given_values, resolve
from .structural import configure
from .system import System

Prepare = Callable[[Network, dict[str, FmuInstance]], dict[str, FmuInstance]]
"""Gives the instances as they are to be run."""


@dataclass
class Assembly:
    """What a package is put together to. Where errors are kept, parts may be missing."""

    network: Network
    instances: dict[str, FmuInstance]
    built: System | None = None
    values: list[Value] = field(default_factory=list)
    """Start values and parameters in the order in which they are set: of the package, then of the options."""
    sizes: list[Value] = field(default_factory=list)
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
        return bool(self.instances) and len(self.instances) == len(self.network.parts)


def assemble(
    package: Path, options: Options, stack: ExitStack, found: Findings, only: Sequence[str] = (),
    prepare: Prepare = lambda _network, instances: instances,
) -> Assembly | None:  # fmt: skip
    """Read the package, and put it together; what it was unpacked into goes with the stack.

    only: components to take, all where it is empty; prepare: called before the instances are connected. None where the
    package cannot be read and errors are kept; raises `CosimError` where they are not.
    """
    known = len(found.errors)
    network = found.attempt(read_package, package, stack, options.variant, found.kept)
    if network is None:
        return None
    made = Assembly(network.only(list(only)) if only else network, {}, incomplete=len(found.errors) > known)
    aside = found.unless(made.incomplete)
    made.network = aside.attempt(with_parameters, made.network, options.parameters) or made.network
    _tell_remarks(made.network, found)
    made.network, made.instances = _described(made.network, found)
    if not made.network.parts and not found.errors:
        found.refuse("the system has no components")
    if made.has_all and not options.isolate:
        found.attempt(check_single, made.instances)
    own = [c for c in options.changes if c[0] in made.network.inputs]
    others = _expanded(made, [c for c in options.changes if c not in own], aside)
    sizes_hold = _set_sizes(made, others, found, aside)
    made.instances = prepare(made.network, made.instances)
    if made.network.structure.step_size is None:
        suggested = replace(made.network.structure, step_size=smallest_step(made.network, made.instances))
        made.network = replace(made.network, structure=suggested)
    if made.has_all and sizes_hold:
        _connect(made, own, (*options.record, *options.plot), found, aside)
    return made


def _tell_remarks(network: Network, found: Findings) -> None:
    """Where errors are kept, violations of the schema are some, unless they stand where one has been told."""
    violations = set(network.structure.remarks) if found.keeps else set()
    places = {error.partition(": ")[0] for error in found.errors}
    found.errors += [r for r in network.structure.remarks if r in violations and r.partition(": ")[0] not in places]
    found.warnings += [r for r in network.remarks if r not in violations]


def _described(network: Network, found: Findings) -> tuple[Network, dict[str, FmuInstance]]:
    """Instances by component path, not loaded yet, from the package's FMUs; the network without what these refute."""
    instances: dict[str, FmuInstance] = {}
    lacking: set[End] = set()
    for path, part in network.parts.items():
        instance = found.attempt(of_component, path, part.component)
        if instance is None:
            instance = read_alone(path, part.component)
        if instance is not None:
            instances[path] = instance
            lacking |= _lacking(part.component, instance, network, found)
    return network.without(lacking), instances


def _lacking(component: Component, instance: FmuInstance, network: Network, found: Findings) -> set[End]:
    """Ends that the FMU lacks, which are refused; those of parameters do no harm where nothing is connected to them."""
    refused: set[End] = set()
    for connector, fault in foreign_connectors(component, instance):
        end = (instance.name, connector.name)
        if connector.kind in EARLY and not network.connects(end):
            found.warnings.append(f"{fault}; nothing is connected to it, so it is ignored")
        else:
            found.refuse(fault)
            refused.add(end)
    return refused


def _expanded(made: Assembly, changes: Sequence[tuple[str, str]], found: Findings) -> list[tuple[str, str]]:
    """Changes with those of connectors of systems replaced by what these lead to."""
    if not made.has_all:
        return []
    reached: list[tuple[str, str]] = []
    for change in changes:
        reached += found.attempt(lambda *one: list(expanded(one, made.network, made.instances)), change) or []
    return reached


def _set_sizes(made: Assembly, changes: list[tuple[str, str]], found: Findings, aside: Findings) -> bool:
    """Structural parameters first, then the values that the package binds and that the user changes.

    Returns whether the sizes of arrays are as they are meant; where not, no connection can be judged.
    """
    network, instances = made.network, made.instances
    configured = found.attempt(configure, network, instances, changes)
    made.network, changes, made.sizes = configured or (network, changes, [])
    made.values = bound_values(made.network, instances, found)
    for change in changes:
        names = (*network.inputs, *network.connectors)
        made.values += aside.attempt(resolve, [change], instances, connectors=names) or []
    sized = any(v.causality == "structuralParameter" for i in instances.values() for v in i.variables.values())
    return configured is not None and not (made.incomplete and sized)


def _connect(
    made: Assembly, own: Sequence[tuple[str, str]], patterns: Sequence[str], found: Findings, aside: Findings
) -> None:
    """The system with all that is to be recorded of it, and the values of its own inputs."""
    recorded = internals(made.network, made.instances, patterns)
    system = made.built = found.attempt(System, made.network, made.instances, found, recorded)
    if system is None:
        return
    found.warnings += system.remarks
    given = found.attempt(given_values, made.network, system, found.warnings.append) or []
    made.values = [*given, *made.values]
    for change in own:
        made.values += aside.attempt(resolve, [change], made.instances, system=system) or []
