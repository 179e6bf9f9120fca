"""What a flattened system is made of: flat connections, the hops on their way, and what parameters are set to."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, field, replace
from functools import cached_property

from ..core.errors import UnknownNameError, did_you_mean
from ..core.units import Unit
from .model import Component, Connector, SystemStructure, Transformation, Type, Value

ElementIndices = tuple[int, ...]
"""Indices of one element of an array, the first 1; () for all of a connector."""


def indices_text(indices: ElementIndices) -> str:
    """The indices of an element as they stand behind a name."""
    return f"[{','.join(map(str, indices))}]" if indices else ""


End = tuple[str, str]
"""(path of a component, variable); the path is '' for a connector of the top-level system."""


@dataclass(frozen=True)
class Hop:
    """One connection or mapping on the way of a value."""

    transformation: Transformation | None = None
    suppress_unit_conversion: bool = False
    type: Type | None = None
    """Type of the connector that is reached, where the package gives one."""
    where: str = ""
    reached_name: str = ""
    """What is reached, for messages; '' for a component's connector, whose FMU knows its type and size."""

    @property
    def unit(self) -> Unit | None:
        """Unit of what is reached, where the package gives one."""
        return self.type.unit if self.type is not None else None

    @property
    def enumeration(self) -> dict[str, int] | None:
        """Its items, likewise."""
        return self.type.enumeration if self.type is not None else None


Target = tuple[str, str, tuple[Hop, ...]]
"""(component, variable, hops on the way to it)."""


@dataclass(frozen=True)
class FlatConnection:
    """The way of a value from where it is made to where it is used."""

    start: End
    end: End
    hops: tuple[Hop, ...]
    unit: Unit | None = None
    """Unit at the start, where the package gives one."""
    enumeration: dict[str, int] | None = None
    start_indices: ElementIndices = ()
    """The element of the start that is meant, and of the end."""
    end_indices: ElementIndices = ()

    @property
    def where(self) -> str:
        """The connection at the end."""
        return self.hops[-1].where if self.hops else ""


@dataclass(frozen=True)
class BoundParameter:
    """A parameter or start value that the package or the user binds: `value` has the type `type` and passes the hops
    before it reaches the variable."""

    component: str
    variable: str
    value: Value
    type: Type
    hops: tuple[Hop, ...] = ()
    where: str = ""
    name: str = ""
    """The name in the package, which may stand for several variables."""
    mapped: str = ""
    """Where a mapping brings it to that name; empty where none does."""
    by_user: bool = False
    """Whether the user gives it, not the package."""


@dataclass(frozen=True)
class FlatComponent:
    """A component of the flattened system."""

    path: str
    component: Component


@dataclass(frozen=True)
class FlatSystem:
    """A system of FMUs without hierarchy."""

    structure: SystemStructure
    components: dict[str, FlatComponent]
    flat_connections: tuple[FlatConnection, ...]
    """To inputs, during a run; a start at path '' is an input of the whole system."""
    parameter_connections: tuple[FlatConnection, ...]
    """From calculated parameters to parameters, before it."""
    outputs: tuple[FlatConnection, ...]
    """What the top-level system's outputs show; the end is ('', connector)."""
    inputs: dict[str, Connector]
    """The top-level system's inputs."""
    bound_parameters: tuple[BoundParameter, ...]
    """In the order in which they are set; later ones win."""
    bound_inputs: tuple[BoundParameter, ...]
    """The same for inputs of the top-level system: the component is ''."""
    connectors: dict[str, tuple[Target, ...]] = field(default_factory=dict)
    """What a value for a connector of a system sets, by its name with the path of its system; not for system inputs."""
    remarks: tuple[str, ...] = ()
    """What is harmless but hardly meant: bindings of names that nothing has, connectors that lead nowhere."""
    undriven: dict[End, str] = field(default_factory=dict)
    """What to tell of the inputs at the end of ways that nothing drives, unless they are given a value."""
    cut: frozenset[str] = frozenset()
    """Connectors of systems that lead only to components that have been left out: a value for them sets nothing."""

    def connects(self, end: End) -> bool:
        """Whether a connection brings something to a variable of a component, or takes something from it."""
        flat_connections = (*self.flat_connections, *self.parameter_connections, *self.outputs)
        ways = (way for targets in self.connectors.values() for way in targets)
        return any(end in (w.start, w.end) for w in flat_connections) or any(end == way[:2] for way in ways)

    def without(self, ends: Collection[End]) -> FlatSystem:
        """The network without the flat connections that begin or end at some variables of components."""

        def remains(flat_connection: FlatConnection) -> bool:
            return flat_connection.start not in ends and flat_connection.end not in ends

        return replace(
            self,
            flat_connections=tuple(filter(remains, self.flat_connections)),
            parameter_connections=tuple(filter(remains, self.parameter_connections)),
            outputs=tuple(filter(remains, self.outputs)),
        )

    @cached_property
    def from_inputs(self) -> dict[str, list[FlatConnection]]:
        """The flat connections that begin at each of the top-level system's inputs."""
        by_input: dict[str, list[FlatConnection]] = {}
        for flat_connection in self.flat_connections:
            if not flat_connection.start[0]:
                by_input.setdefault(flat_connection.start[1], []).append(flat_connection)
        return by_input

    def only(self, paths: list[str]) -> FlatSystem:
        """The network with some of its components only; raises `UnknownNameError` for one that is not there."""
        for path in paths:
            if path not in self.components:
                raise UnknownNameError(f"no component '{path}'{did_you_mean(path, list(self.components))}")

        def is_inside(flat_connection: FlatConnection) -> bool:
            return all(path == "" or path in paths for path in (flat_connection.start[0], flat_connection.end[0]))

        connectors = {name: tuple(t for t in targets if t[0] in paths) for name, targets in self.connectors.items()}
        return replace(
            self,
            components={path: flat_component for path, flat_component in self.components.items() if path in paths},
            flat_connections=tuple(filter(is_inside, self.flat_connections)),
            parameter_connections=tuple(filter(is_inside, self.parameter_connections)),
            outputs=tuple(filter(is_inside, self.outputs)),
            bound_parameters=tuple(s for s in self.bound_parameters if s.component in paths),
            connectors=connectors,
            undriven={end: text for end, text in self.undriven.items() if end[0] in paths},
            cut=self.cut | {name for name, targets in self.connectors.items() if targets and not connectors[name]},
        )
