"""The tree of systems flattened: components, connections from outputs to inputs, and what every parameter is set to.

Systems, their connectors and signal dictionaries disappear here. What a value meets on its way (units, transformations)
is kept as hops, for only the FMUs know the types and units at the ends.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from ..core.errors import PackageError, did_you_mean, first_few
from ..core.units import alike
from .flat_system import (
    BoundParameter,
    ElementIndices,
    End,
    FlatComponent,
    FlatConnection,
    FlatSystem,
    Hop,
    Target,
    indices_text,
)
from .model import (
    Binding,
    Component,
    Connection,
    Connector,
    MappingEntry,
    SignalDictionaryReference,
    System,
    SystemStructure,
    Type,
)

SOURCE_KINDS = ("output", "calculatedParameter", "local", "constant")
SINK_KINDS = ("input", "parameter", "structuralParameter")
PARAMETER_KINDS = ("parameter", "structuralParameter", "calculatedParameter")
"""Kinds of connectors of parameters, whose values flow before a run begins."""

MAX_CONNECTORS = 300
"""Most connectors that a value may pass on its way."""

Node = tuple[str, str, str]
"""(what, path, connector): what is 'component', 'system' or 'dictionary', and where their connectors have other units
outside, 'border' of a system that a component refers to, or 'reference' to a dictionary."""

Causality = Callable[[Component, str], str | None]
"""What a component's FMU says of a variable: its causality; None where that is not known."""


def flatten(
    structure: SystemStructure, causality: Causality = lambda _component, _name: None, errors: list[str] | None = None
) -> FlatSystem:
    """The network of a system structure. Raises `PackageError` for what cannot be connected as it says.

    causality: asked where the package does not say which end of a connection gives the value.
    errors: where this is a list, what is wrong goes there, and the rest is connected.
    """
    return _Flattener(structure, causality, errors).network()


@dataclass
class _Edge:
    source: Node
    connection: Connection
    indices: ElementIndices = ()
    """The element of the source that is meant."""


@dataclass(frozen=True)
class _Way:
    """How a value comes to a node: from `start`, through `hops`, to the element `end_indices` of the node."""

    start: Node
    start_indices: ElementIndices = ()
    end_indices: ElementIndices = ()
    hops: tuple[Hop, ...] = ()


@dataclass
class _Flattener:
    structure: SystemStructure
    causality: Causality
    errors: list[str] | None = None
    components: dict[str, FlatComponent] = field(default_factory=dict)
    types: dict[Node, Type | None] = field(default_factory=dict)
    kinds: dict[Node, str] = field(default_factory=dict)
    drivers: dict[Node, dict[ElementIndices, _Edge]] = field(default_factory=dict)
    """What drives a node: all of it, or some elements of an array."""
    drives: dict[Node, list[tuple[Node, Connection]]] = field(default_factory=dict)
    entries: dict[Node, Node] = field(default_factory=dict)
    """Entries of dictionaries behind the nodes of references that have nodes of their own."""
    clocked: set[Node] = field(default_factory=set)
    """Connectors that are clocks or belong to one."""
    undecided: list[tuple[Node, Node, Connection]] = field(default_factory=list)
    """Connections between ends that may both give or take."""
    remarks: list[str] = field(default_factory=list)
    undriven: dict[End, str] = field(default_factory=dict)
    _named: dict[int, tuple[Sequence[Any], dict[str, Any]]] = field(default_factory=dict)
    """Connectors or elements, and each by its name."""

    def refused(self, error: PackageError) -> None:
        """Collect what is wrong, or raise it."""
        if self.errors is None:
            raise error
        self.errors.append(str(error))

    def network(self) -> FlatSystem:
        root = self.structure.system
        self.walk(root, "", {})
        self.decide()
        bound_parameters: list[BoundParameter] = []
        bound_inputs: list[BoundParameter] = []
        self.bind(root, "", bound_parameters, bound_inputs)
        flat_connections: list[FlatConnection] = []
        parameter_connections: list[FlatConnection] = []
        kinds = ("input", "inout", "unspecified")
        candidates = {c.name: c for c in root.connectors if c.kind in kinds and not _is_clock(c)}
        for node in list(self.drivers):
            if node[0] == "component":
                for flat_connection in self.trace(node):
                    if flat_connection.start[0] or flat_connection.start[1] in candidates:
                        (parameter_connections if self.kinds.get(node) in PARAMETER_KINDS else flat_connections).append(
                            flat_connection
                        )
        outputs: list[FlatConnection] = []
        for connector in root.connectors:
            node = ("system", "", connector.name)
            if connector.kind in (*SOURCE_KINDS, "inout", "unspecified") and node in self.drivers:
                for flat_connection in self.trace(node):
                    if flat_connection.start[0] or flat_connection.start[1] in candidates:
                        outputs.append(flat_connection)
                        continue
                    self.refused(PackageError(
                        f"{flat_connection.where}: output '{connector.name}' would show '{flat_connection.start[1]}', "
                        "a parameter of the system; that is not supported"
                    ))  # fmt: skip
        driving = {w.start[1] for w in flat_connections if not w.start[0]}
        inputs = {name: c for name, c in candidates.items() if c.kind == "input" or name in driving}
        self.calculated(parameter_connections, bound_parameters)
        return FlatSystem(
            self.structure, self.components, tuple(flat_connections), tuple(parameter_connections), tuple(outputs),
            inputs, tuple(bound_parameters), tuple(bound_inputs),
            {name: tuple(self.behind(node, ())) for name, node in self.names().items() if name not in inputs},
            (*self.structure.remarks, *self.structure.notes, *self.remarks), self.undriven,
        )  # fmt: skip

    def calculated(
        self, parameter_connections: Sequence[FlatConnection], bound_parameters: Sequence[BoundParameter]
    ) -> None:
        """Remark values that are bound to parameters which other components calculate."""
        by_end = {connection.end: connection for connection in parameter_connections if connection.start[0]}
        for s in bound_parameters:
            if (connection := by_end.get((s.component, s.variable))) is not None:
                self.remarks.append(
                    f"{s.where}: '{s.component}.{s.variable}' is bound, and connected to "
                    f"'{'.'.join(connection.start)}'; the connection counts"
                )

    def names(self) -> dict[str, Node]:
        """Connectors of systems that can be given a value, by hierarchical name."""
        kinds = (*SINK_KINDS, "inout", "unspecified")
        return {f"{n[1]}{n[2]}": n for n, kind in self.kinds.items() if n[0] == "system" and kind in kinds}

    # the graph

    def walk(self, system: System, path: str, outer: dict[str, tuple[str, dict[str, Type]]]) -> None:
        """Register the nodes and edges of a system whose elements have paths that begin with `path`."""
        dictionaries = {**outer, **{n: (f"{path}{n}", entries) for n, entries in system.dictionaries.items()}}
        for connector in system.connectors:
            self.register(("system", path, connector.name), connector)
        used: dict[str, tuple[str, dict[str, Type]]] = {}
        lost: set[str | None] = set(system.broken)
        for element in system.elements:
            inner = f"{path}{element.name}"
            if isinstance(element, Component):
                if inner in self.components:
                    raise PackageError(f"{element.where}: two components have the path '{inner}'")
                self.components[inner] = FlatComponent(inner, element)
                for connector in element.connectors:
                    self.register(("component", inner, connector.name), connector)
            elif isinstance(element, System):
                self.walk(element, f"{inner}.", dictionaries)
                self.border(element, f"{inner}.")
            else:
                try:
                    used[element.name] = self.dictionary(element, dictionaries)
                except PackageError as error:
                    self.refused(error)
                    lost.add(element.name)
        names = {element.name for element in system.elements}
        for connection in system.connections:
            ends = {connection.start[0], connection.end[0]} - {None}
            if ends & lost or ("" in lost and ends - names):
                continue  # what follows from an error is not told, nor what may mean an element without a name
            try:
                self.connect(system, path, used, connection)
            except PackageError as error:
                self.refused(error)

    def dictionary(
        self, element: SignalDictionaryReference, dictionaries: dict[str, tuple[str, dict[str, Type]]]
    ) -> tuple[str, dict[str, Type]]:
        if element.dictionary not in dictionaries:
            hint = did_you_mean(element.dictionary, list(dictionaries))
            raise PackageError(f"{element.where}: there is no signal dictionary '{element.dictionary}'{hint}")
        name, entries = dictionaries[element.dictionary]
        for connector in element.connectors:
            if connector.name not in entries:
                hint = did_you_mean(connector.name, list(entries))
                raise PackageError(
                    f"{connector.where}: signal dictionary '{element.dictionary}' has no entry '{connector.name}'{hint}"
                )
        return name, entries

    def border(self, system: System, path: str) -> None:
        """Nodes of their own for connectors that have other units outside, where a component stands for the system."""
        for connector in system.connectors:
            kind, outer = connector.kind, system.outer.get(connector.name)
            if not _differ(outer, connector.type):
                continue
            if kind not in SOURCE_KINDS and kind not in SINK_KINDS:
                raise PackageError(
                    f"{connector.where}: connector '{path}{connector.name}' is of kind {kind} and has another unit "
                    "where its component is defined; it has to be an input or an output"
                )
            inside, outside = ("system", path, connector.name), ("border", path, connector.name)
            self.types[outside], self.kinds[outside] = outer, kind
            self.join(*((outside, inside) if kind in SINK_KINDS else (inside, outside)), connector.where)

    def join(self, source: Node, sink: Node, where: str) -> None:
        """Lead one node to another, as by a connection."""
        joint = Connection(("", ""), ("", ""), where=where)
        self.drivers.setdefault(sink, {})[()] = _Edge(source, joint)
        self.drives.setdefault(source, []).append((sink, joint))

    def register(self, node: Node, connector: Connector) -> None:
        if connector.clocked:
            self.clocked.add(node)
        if _is_clock(connector):
            return
        self.kinds[node], self.types[node] = connector.kind, connector.type

    def named(self, items: Sequence[Any], name: str) -> Any:
        """The first of the connectors or elements with that name; None if there is none."""
        if id(items) not in self._named:
            self._named[id(items)] = items, {item.name: item for item in reversed(items)}
        return self._named[id(items)][1].get(name)

    def end(
        self, system: System, path: str, used: dict[str, tuple[str, dict[str, Type]]], connection: Connection, side: str
    ) -> tuple[Node, str]:
        """(node, 'source', 'sink' or 'either') of one end of a connection, seen from inside the system."""
        element, name = getattr(connection, side)
        if element is None:
            connector = self.named(system.connectors, name)
            if connector is None:
                names = [c.name for c in system.connectors]
                raise PackageError(
                    f"{connection.where}: the system has no connector '{name}'{did_you_mean(name, names)}"
                )
            node = ("system", path, name)
            kind = connector.kind
            return node, "source" if kind in SINK_KINDS else "sink" if kind in SOURCE_KINDS else "either"
        inner = f"{path}{element}"
        if element in used:
            dictionary, entries = used[element]
            if name not in entries:
                raise PackageError(
                    f"{connection.where}: signal dictionary reference '{element}' has no entry '{name}'"
                    f"{did_you_mean(name, list(entries))}"
                )
            node = ("dictionary", dictionary, name)
            self.types[node] = entries[name]
            reference = next(e for e in system.elements if e.name == element)
            connector = self.named(reference.connectors, name)
            if connector is not None and _differ(connector.type, entries[name]):
                self.entries[("reference", inner, name)] = node
                node = ("reference", inner, name)
                self.types[node] = connector.type
        else:
            target = self.named(system.elements, element)
            if target is None:
                names = [e.name for e in system.elements]
                raise PackageError(
                    f"{connection.where}: there is no component '{element}'{did_you_mean(element, names)}"
                )
            if isinstance(target, System):
                node = ("border", f"{inner}.", name)
                node = node if node in self.kinds else ("system", f"{inner}.", name)
                if node not in self.kinds and node not in self.clocked:
                    names = [c.name for c in target.connectors]
                    raise PackageError(
                        f"{connection.where}: system '{element}' has no connector '{name}'{did_you_mean(name, names)}"
                    )
            else:
                node = ("component", inner, name)
            connector = self.named(target.connectors, name)
        kind = connector.kind if connector is not None else "unspecified"
        if node[0] == "component" and kind not in SOURCE_KINDS and kind not in SINK_KINDS:
            kind = self.causality(self.components[inner].component, name) or kind
        return node, "source" if kind in SOURCE_KINDS else "sink" if kind in SINK_KINDS else "either"

    def connect(
        self, system: System, path: str, used: dict[str, tuple[str, dict[str, Type]]], connection: Connection
    ) -> None:
        start, a = self.end(system, path, used, connection, "start")
        end, b = self.end(system, path, used, connection, "end")
        where = connection.where
        names = f"'{_shown(connection.start)}' and '{_shown(connection.end)}'"
        if start in self.clocked or end in self.clocked:
            reason = "is a clock or belongs to one; connected clocks are not supported"
            raise PackageError(f"{where}: one of {names} {reason}")
        if start == end:
            raise PackageError(f"{where}: {names} are the same")
        if a == b and a != "either":
            both = "outputs" if a == "source" else "inputs"
            of_system = None in (connection.start[0], connection.end[0])
            inside = ", seen from inside the system" if of_system else ""
            raise PackageError(f"{where}: {names} are both {both}{inside}; a connection needs an output and an input")
        parted = connection.start_indices or connection.end_indices
        if parted and any(self.kinds.get(node) in PARAMETER_KINDS for node in (start, end)):
            raise PackageError(f"{where}: connections of single elements of parameters are not supported")
        for node, indices, name in (
            (start, connection.start_indices, "startIndices"), (end, connection.end_indices, "endIndices")
        ):  # fmt: skip
            self.check_element(node, indices, f'{where}: {name}="{" ".join(map(str, indices))}"')
        if a == b:
            self.undecided.append((start, end, connection))
        elif a == "source" or b == "sink":
            self.lead(start, end, connection)
        else:
            self.lead(end, start, connection, back=True)

    def decide(self) -> None:
        """Find out which end gives a value where both may: the one that gets it from elsewhere."""

        def driven(node: Node) -> bool:
            return node[0] != "component" and self.entries.get(node, node) in self.drivers

        def asked(node: Node) -> bool:
            drives = node in self.drives or self.entries.get(node) in self.drives
            return node[0] != "component" and drives and not driven(node)

        while self.undecided:
            decidable = next((c for c in self.undecided if driven(c[0]) or driven(c[1])), None)
            start, end, connection = decidable or self.undecided[0]
            self.undecided.remove((start, end, connection))
            back = driven(end) and not driven(start) if decidable else asked(start) and not asked(end)
            try:
                self.lead(*((end, start) if back else (start, end)), connection, back)
            except PackageError as error:
                self.refused(error)

    def check_element(self, node: Node, indices: ElementIndices, where: str) -> None:
        """Refuse the indices of what is not an element of an array that may be connected."""
        if not indices:
            return
        if node in self.entries:
            raise PackageError(f"{where}: single elements of an entry that its reference has in another unit are not "
                               "supported")  # fmt: skip
        if min(indices) < 1:
            raise PackageError(f"{where}: indices begin with 1")
        type = self.types.get(node)
        if type is None or not type.dimensions:
            return  # its FMU knows
        beyond = any(isinstance(d, int) and k > d for k, d in zip(indices, type.dimensions, strict=False))
        if beyond or len(indices) != len(type.dimensions):
            raise PackageError(f"{where}: '{'.'.join(filter(None, node[1:]))}' is {type.shape} in size")

    def lead(self, source: Node, sink: Node, connection: Connection, back: bool = False) -> None:
        """Have a connection bring the value of one node to another; `back`: from its end to its start."""
        where = connection.where
        source_indices, sink_indices = connection.start_indices, connection.end_indices
        if back:
            source_indices, sink_indices = sink_indices, source_indices
        if source in self.entries and source not in self.drivers:
            self.join(self.entries[source], source, where)
        entry = self.entries.get(sink)
        if entry is not None and sink in self.drivers and self.drivers[sink][()].source == entry:  # only read till now
            self.drives[entry] = [d for d in self.drives[entry] if d[0] != sink]
            del self.drivers[sink]
        for node in filter(None, (sink, entry)):
            edges = self.drivers.get(node, {})
            other = (
                edges.get(sink_indices)
                or edges.get(())
                or (next(iter(edges.values()), None) if not sink_indices else None)
            )
            if other is not None:
                raise PackageError(
                    f"{where}: {_what(node, sink_indices)} is already driven by the connection in "
                    f"{_line(other.connection.where, where)}"
                )
        self.drivers.setdefault(sink, {})[sink_indices] = _Edge(source, connection, source_indices)
        self.drives.setdefault(source, []).append((sink, connection))
        if entry is not None:
            self.join(sink, entry, where)

    def hop(self, node: Node, connection: Connection, indices: ElementIndices = ()) -> Hop:
        """What a value meets on a connection that ends at a node, or at one element of it."""
        type = self.types.get(node)
        return Hop(
            connection.transformation, connection.suppress_unit_conversion,
            replace(type, dimensions=()) if type is not None and indices else type, connection.where,
            _what(node) if node[0] != "component" else "",
        )  # fmt: skip

    def ways(
        self, node: Node, indices: ElementIndices, passed: tuple[tuple[Node, ElementIndices], ...] = ()
    ) -> Iterator[_Way]:
        """How values come to a node or one element of it: one way, or one for each element that has a driver."""
        edges = self.drivers.get(node, {})
        if not edges or (indices and indices not in edges and () not in edges):
            yield _Way(node, indices)
            return
        for element, edge in edges.items():
            if indices and element and element != indices:
                continue
            if len(passed) > MAX_CONNECTORS:
                raise PackageError(f"{edge.connection.where}: more than {MAX_CONNECTORS} connectors in a row; refused")
            if (node, element) in passed:
                raise PackageError(f"{edge.connection.where}: the connections lead back to {_what(node)}")
            if indices and not element and edge.indices:
                raise PackageError(f"{edge.connection.where}: one element drives all of {_what(node)}")
            for way in self.ways(edge.source, edge.indices or (() if element else indices), (*passed, (node, element))):
                if element and way.end_indices:
                    raise PackageError(f"{edge.connection.where}: an array drives one element, {_what(node, element)}")
                reached = indices or element or way.end_indices
                hop = self.hop(node, edge.connection, reached)
                yield _Way(way.start, way.start_indices, () if indices else reached, (*way.hops, hop))

    def trace(self, sink: Node) -> list[FlatConnection]:
        """The flat connections that end at a node; none from what nothing gives a value."""
        flat_connections: list[FlatConnection] = []
        end = (sink[1] if sink[0] == "component" else "", sink[2])
        try:
            ways = list(self.ways(sink, ()))
        except PackageError as error:
            self.refused(error)
            return flat_connections
        for way in ways:
            node = way.start
            if node == sink:
                continue
            if node[0] in ("dictionary", "border") or (node[0] == "system" and node[1] != ""):
                ends = f"{_what(node, way.start_indices)} leads to {_what(sink, way.end_indices)}"
                self.undriven[end] = f"{way.hops[0].where}: {ends}, but nothing gives it a value"
                continue
            type = self.types.get(node)
            start = (node[1] if node[0] == "component" else "", node[2])
            flat_connections.append(FlatConnection(
                start, end, way.hops, type.unit if type else None, type.enumeration if type else None,
                way.start_indices, way.end_indices,
            ))  # fmt: skip
        return flat_connections

    # parameters

    def bind(
        self, system: System, path: str, bound_parameters: list[BoundParameter], bound_inputs: list[BoundParameter]
    ) -> None:
        """Bound parameters of a system: those of its elements first, its own override them."""
        for element in system.elements:
            inner = f"{path}{element.name}"
            if isinstance(element, Component):
                for binding in element.bindings:
                    for bound in self.values(binding):
                        bound_parameters.append(replace(bound, component=inner))
            elif isinstance(element, System):
                self.bind(element, f"{inner}.", bound_parameters, bound_inputs)
        direct: list[BoundParameter] = []
        connected: list[BoundParameter] = []
        for binding in system.bindings:
            for bound in self.values(binding):
                targets = list(self.targets(system, path, bound.variable, bound.hops))
                if not targets and not any(bound.variable.startswith(f"{name}.") for name in system.broken):
                    self.remarks.append(f"{bound.where}: {self.unbound(system, path, bound.variable)}")
                for component, variable, hops in targets:
                    bound_target = replace(bound, component=component, variable=variable, hops=hops)
                    chosen = connected if hops[len(bound.hops) :] else direct
                    (chosen if component else bound_inputs).append(bound_target)
        self.prefer(connected, direct)
        bound_parameters += [*direct, *connected]

    def prefer(self, connected: Sequence[BoundParameter], direct: Sequence[BoundParameter]) -> None:
        """Remark values that a system binds to what one of its connections brings another value to, which counts."""
        brought = {(s.component, s.variable): s for s in connected}
        for s in direct:
            other = brought.get((s.component, s.variable))
            if other is not None:
                self.remarks.append(
                    f"{s.where}: '{s.component}.{s.variable}' is bound, and connected to '{other.name}', which has a "
                    f"value in {other.where}; the connection counts"
                )

    def unbound(self, system: System, path: str, name: str) -> str:
        """Why a binding sets nothing."""
        if (kind := self.kinds.get(("system", path, name))) is None:
            hint = did_you_mean(name, [c.name for c in system.connectors])
            hint = hint or did_you_mean(name.partition(".")[0], [e.name for e in system.elements])
            return f"nothing is called '{path}{name}'; the value is ignored{hint}"
        reason = "is an output" if kind in SOURCE_KINDS else "leads nowhere"
        if any(c.start_indices or c.end_indices for _, c in self.drives.get(("system", path, name), ())):
            reason = "leads to single elements of arrays"
        return f"the system's connector '{path}{name}' {reason}; the value is ignored"

    def values(self, binding: Binding) -> Iterator[BoundParameter]:
        """The values of a binding under the names it gives them in its element; with a mapping, of what it maps."""
        parameters = {f"{binding.prefix}{p.name}": p for p in binding.parameters}
        if binding.mapping is None:
            for name, p in parameters.items():
                yield BoundParameter("", name, p.value, p.type, (), p.where, name)
            return
        entries: dict[str, list[MappingEntry]] = {}
        targets: dict[str, str] = {}
        for entry in binding.mapping:
            if entry.source not in parameters:
                self.remarks.append(f"{entry.where}: the parameter set has no '{entry.source}'")
                continue
            entries.setdefault(entry.source, []).append(entry)
            if (other := targets.setdefault(entry.target, entry.source)) != entry.source:
                text = f"'{other}' and '{entry.source}' are both mapped to '{entry.target}'; the later parameter counts"
                self.remarks.append(f"{entry.where}: {text}")
        for name, p in parameters.items():
            for entry in entries.get(name, ()):
                hop = Hop(entry.transformation, entry.suppress_unit_conversion, None, entry.where)
                yield BoundParameter("", entry.target, p.value, p.type, (hop,), p.where, entry.target, entry.where)
        if unmapped := [name for name in parameters if name not in entries]:
            names = first_few(unmapped, 5)
            self.remarks.append(f"{binding.where}: not applied, for the mapping does not name them: {names}")

    def targets(self, system: System, path: str, name: str, hops: tuple[Hop, ...]) -> Iterator[Target]:
        """(component, variable, hops) of everything that a hierarchical name of a system stands for."""
        if self.named(system.connectors, name) is not None:
            node = ("system", path, name)
            if path == "" and self.kinds.get(node) == "input":
                yield "", name, hops
            yield from self.behind(node, hops)
        dots = [i for i, letter in enumerate(name[:-1]) if letter == "."]
        for element in (self.named(system.elements, name[:dot]) for dot in dots):
            if isinstance(element, Component):
                yield f"{path}{element.name}", name[len(element.name) + 1 :], hops
            elif isinstance(element, System):
                yield from self.targets(element, f"{path}{element.name}.", name[len(element.name) + 1 :], hops)

    def behind(self, node: Node, hops: tuple[Hop, ...]) -> Iterator[Target]:
        """Everything that a system's connector leads to."""
        type = self.types.get(node)
        if type is not None:
            hops = (*hops[:-1], replace(hops[-1] if hops else Hop(), type=type, reached_name=_what(node)))
        for sink, connection in self.drives.get(node, ()):
            if connection.start_indices or connection.end_indices:
                continue  # values of parameters and starts are given to all of a variable
            further = (*hops, self.hop(sink, connection))
            if sink[0] == "component":
                yield sink[1], sink[2], further
            elif len(further) < 1000:
                yield from self.behind(sink, further)


def _shown(end: tuple[str | None, str]) -> str:
    return end[1] if end[0] is None else f"{end[0]}.{end[1]}"


def _what(node: Node, indices: ElementIndices = ()) -> str:
    name = f"{node[2]}{indices_text(indices)}"
    if node[0] == "component":
        return f"input '{node[1]}.{name}'"
    if node[0] in ("dictionary", "reference"):
        return f"entry '{name}' of signal dictionary '{node[1]}'"
    return f"connector '{node[1]}{name}'"


def _is_clock(connector: Connector) -> bool:
    """Whether it is a clock itself, which has no value."""
    return connector.type is not None and connector.type.kind == "Clock"


def _differ(one: Type | None, other: Type | None) -> bool:
    """Whether values have to be converted between two ends of what is one connector."""
    if one is None or other is None or one.unit is None or other.unit is None or one.unit.name == other.unit.name:
        return False
    return not alike(one.unit, other.unit)


def _line(where: str, other: str) -> str:
    """A place, without the file that another place names already."""
    file, _, line = where.partition(", ")
    return line if line and other.startswith(f"{file},") else where
