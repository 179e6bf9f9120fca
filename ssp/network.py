"""The tree of systems flattened: components, wires from outputs to inputs, and what every parameter is set to.

Systems, their connectors and signal dictionaries disappear here. What a value meets on its way (units, transformations)
is kept as hops, for only the FMUs know the types and units at the ends.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from ..core.errors import PackageError, UnknownNameError, did_you_mean
from ..core.units import Unit, alike
from .model import (
    Binding,
    Component,
    Connection,
    Connector,
    MappingEntry,
    SignalDictionaryReference,
    System,
    SystemStructure,
    Transformation,
    Type,
    Value,
)

GIVES = ("output", "calculatedParameter", "local", "constant")
TAKES = ("input", "parameter", "structuralParameter")
EARLY = ("parameter", "structuralParameter", "calculatedParameter")
"""Kinds of connectors whose values flow before a run begins."""

Node = tuple[str, str, str]
"""(what, path, connector): what is 'component', 'system' or 'dictionary', and where their connectors have other units
outside, 'border' of a system that a component refers to, or 'reference' to a dictionary."""

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
    between: str = ""
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
class Wire:
    """The way of a value from where it is made to where it is used."""

    start: End
    end: End
    hops: tuple[Hop, ...]
    unit: Unit | None = None
    """Unit at the start, where the package gives one."""
    enumeration: dict[str, int] | None = None

    @property
    def where(self) -> str:
        """The connection at the end."""
        return self.hops[-1].where if self.hops else ""


@dataclass(frozen=True)
class Setting:
    """A parameter or start value: `value` has the type `type` and passes the hops before it reaches the variable."""

    component: str
    variable: str
    value: Value
    type: Type
    hops: tuple[Hop, ...] = ()
    where: str = ""
    name: str = ""
    """The name in the package, which may stand for several variables."""


@dataclass(frozen=True)
class Part:
    """A component of the flattened system."""

    path: str
    component: Component


@dataclass(frozen=True)
class Network:
    """A system of FMUs without hierarchy."""

    structure: SystemStructure
    parts: dict[str, Part]
    wires: tuple[Wire, ...]
    """To inputs, during a run; a start at path '' is an input of the whole system."""
    early: tuple[Wire, ...]
    """From calculated parameters to parameters, before it."""
    outputs: dict[str, Wire]
    """What the top-level system's outputs show; the end is ('', connector)."""
    inputs: dict[str, Connector]
    """The top-level system's inputs."""
    settings: tuple[Setting, ...]
    """In the order in which they are made; later ones win."""
    given: tuple[Setting, ...]
    """The same for inputs of the top-level system: the component is ''."""
    connectors: dict[str, tuple[Target, ...]] = field(default_factory=dict)
    """What a value for a connector of a system sets, by its name with the path of its system; not for own inputs."""
    remarks: tuple[str, ...] = ()
    """What is harmless but hardly meant: bindings of names that nothing has, connectors that lead nowhere."""
    idle: dict[End, str] = field(default_factory=dict)
    """What to tell of the inputs at the end of ways that nothing drives, unless they are given a value."""

    def only(self, paths: list[str]) -> Network:
        """The network with some of its components only."""
        for path in paths:
            if path not in self.parts:
                raise UnknownNameError(f"no component '{path}'{did_you_mean(path, list(self.parts))}")

        def kept(wire: Wire) -> bool:
            return all(path == "" or path in paths for path in (wire.start[0], wire.end[0]))

        return replace(
            self,
            parts={path: part for path, part in self.parts.items() if path in paths},
            wires=tuple(filter(kept, self.wires)),
            early=tuple(filter(kept, self.early)),
            outputs={name: wire for name, wire in self.outputs.items() if kept(wire)},
            settings=tuple(s for s in self.settings if s.component in paths),
        )


Causality = Callable[[Component, str], str | None]
"""What a component's FMU says of a variable: its causality; None where that is not known."""


def flatten(structure: SystemStructure, causality: Causality = lambda _component, _name: None) -> Network:
    """The network of a system structure. Raises `PackageError` for what cannot be connected as it says.

    causality: asked where the package does not say which end of a connection gives the value.
    """
    return _Flattener(structure, causality).network()


@dataclass
class _Edge:
    source: Node
    connection: Connection


@dataclass
class _Flattener:
    structure: SystemStructure
    causality: Causality
    parts: dict[str, Part] = field(default_factory=dict)
    types: dict[Node, Type | None] = field(default_factory=dict)
    kinds: dict[Node, str] = field(default_factory=dict)
    driver: dict[Node, _Edge] = field(default_factory=dict)
    drives: dict[Node, list[tuple[Node, Connection]]] = field(default_factory=dict)
    entries: dict[Node, Node] = field(default_factory=dict)
    """Entries of dictionaries behind the nodes of references that have nodes of their own."""
    undecided: list[tuple[Node, Node, Connection]] = field(default_factory=list)
    """Connections between ends that may both give or take."""
    remarks: list[str] = field(default_factory=list)
    idle: dict[End, str] = field(default_factory=dict)
    _named: dict[int, tuple[Sequence[Any], dict[str, Any]]] = field(default_factory=dict)
    """Connectors or elements, and each by its name."""

    def network(self) -> Network:
        root = self.structure.system
        self.walk(root, "", {})
        self.decide()
        settings: list[Setting] = []
        given: list[Setting] = []
        self.bind(root, "", settings, given)
        wires: list[Wire] = []
        early: list[Wire] = []
        taken = {c.name: c for c in root.connectors if c.kind in ("input", "inout", "unspecified")}
        for node in list(self.driver):
            if node[0] == "component":
                wire = self.trace(node)
                if wire is not None and (wire.start[0] or wire.start[1] in taken):
                    (early if self.kinds.get(node) in EARLY else wires).append(wire)
        outputs = {}
        for connector in root.connectors:
            node = ("system", "", connector.name)
            if connector.kind in (*GIVES, "inout", "unspecified") and node in self.driver:
                wire = self.trace(node)
                if wire is not None and not wire.start[0] and wire.start[1] not in taken:
                    raise PackageError(
                        f"{wire.where}: output '{connector.name}' would show '{wire.start[1]}', a parameter of the "
                        "system; that is not supported"
                    )
                if wire is not None:
                    outputs[connector.name] = wire
        driving = {w.start[1] for w in wires if not w.start[0]}
        inputs = {name: c for name, c in taken.items() if c.kind == "input" or name in driving}
        return Network(
            self.structure, self.parts, tuple(wires), tuple(early), outputs, inputs, tuple(settings), tuple(given),
            {name: tuple(self.behind(node, ())) for name, node in self.names().items() if name not in inputs},
            (*self.structure.remarks, *self.remarks), self.idle,
        )  # fmt: skip

    def names(self) -> dict[str, Node]:
        """Connectors of systems that can be given a value, by hierarchical name."""
        takes = (*TAKES, "inout", "unspecified")
        return {f"{n[1]}{n[2]}": n for n, kind in self.kinds.items() if n[0] == "system" and kind in takes}

    # the graph

    def walk(self, system: System, path: str, outer: dict[str, tuple[str, dict[str, Type]]]) -> None:
        """Register the nodes and edges of a system whose elements have paths that begin with `path`."""
        dictionaries = {**outer, **{n: (f"{path}{n}", entries) for n, entries in system.dictionaries.items()}}
        for connector in system.connectors:
            self.register(("system", path, connector.name), connector)
        used: dict[str, tuple[str, dict[str, Type]]] = {}
        for element in system.elements:
            inner = f"{path}{element.name}"
            if isinstance(element, Component):
                if inner in self.parts:
                    raise PackageError(f"{element.where}: two components have the path '{inner}'")
                self.parts[inner] = Part(inner, element)
                for connector in element.connectors:
                    self.register(("component", inner, connector.name), connector)
            elif isinstance(element, System):
                self.walk(element, f"{inner}.", dictionaries)
                self.border(element, f"{inner}.")
            else:
                used[element.name] = self.dictionary(element, dictionaries)
        for connection in system.connections:
            self.connect(system, path, used, connection)

    def dictionary(
        self, element: SignalDictionaryReference, known: dict[str, tuple[str, dict[str, Type]]]
    ) -> tuple[str, dict[str, Type]]:
        if element.dictionary not in known:
            hint = did_you_mean(element.dictionary, list(known))
            raise PackageError(f"{element.where}: there is no signal dictionary '{element.dictionary}'{hint}")
        name, entries = known[element.dictionary]
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
            if kind not in GIVES and kind not in TAKES:
                raise PackageError(
                    f"{connector.where}: connector '{path}{connector.name}' is of kind {kind} and has another unit "
                    "where its component is defined; it has to be an input or an output"
                )
            inside, outside = ("system", path, connector.name), ("border", path, connector.name)
            self.types[outside], self.kinds[outside] = outer, kind
            self.join(*((outside, inside) if kind in TAKES else (inside, outside)), connector.where)

    def join(self, source: Node, sink: Node, where: str) -> None:
        """Lead one node to another, as by a connection."""
        between = Connection(("", ""), ("", ""), where=where)
        self.driver[sink] = _Edge(source, between)
        self.drives.setdefault(source, []).append((sink, between))

    def register(self, node: Node, connector: Connector) -> None:
        self.kinds[node], self.types[node] = connector.kind, connector.type

    def named(self, things: Sequence[Any], name: str) -> Any:
        """The first of the connectors or elements with that name; None if there is none."""
        if id(things) not in self._named:
            self._named[id(things)] = things, {thing.name: thing for thing in reversed(things)}
        return self._named[id(things)][1].get(name)

    def end(
        self, system: System, path: str, used: dict[str, tuple[str, dict[str, Type]]], connection: Connection, side: str
    ) -> tuple[Node, str]:
        """(node, 'gives', 'takes' or 'either') of one end of a connection, seen from inside the system."""
        element, name = getattr(connection, side)
        if element is None:
            connector = self.named(system.connectors, name)
            if connector is None:
                known = [c.name for c in system.connectors]
                raise PackageError(
                    f"{connection.where}: the system has no connector '{name}'{did_you_mean(name, known)}"
                )
            node = ("system", path, name)
            return node, "gives" if connector.kind in TAKES else "takes" if connector.kind in GIVES else "either"
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
                known = [e.name for e in system.elements]
                raise PackageError(
                    f"{connection.where}: there is no component '{element}'{did_you_mean(element, known)}"
                )
            if isinstance(target, System):
                node = ("border", f"{inner}.", name)
                node = node if node in self.kinds else ("system", f"{inner}.", name)
                if node not in self.kinds:
                    known = [c.name for c in target.connectors]
                    raise PackageError(
                        f"{connection.where}: system '{element}' has no connector '{name}'{did_you_mean(name, known)}"
                    )
            else:
                node = ("component", inner, name)
            connector = self.named(target.connectors, name)
        kind = connector.kind if connector is not None else "unspecified"
        if node[0] == "component" and kind not in GIVES and kind not in TAKES:
            kind = self.causality(self.parts[inner].component, name) or kind
        return node, "gives" if kind in GIVES else "takes" if kind in TAKES else "either"

    def connect(
        self, system: System, path: str, used: dict[str, tuple[str, dict[str, Type]]], connection: Connection
    ) -> None:
        start, a = self.end(system, path, used, connection, "start")
        end, b = self.end(system, path, used, connection, "end")
        where = connection.where
        names = f"'{_shown(connection.start)}' and '{_shown(connection.end)}'"
        if start == end:
            raise PackageError(f"{where}: {names} are the same")
        if a == b and a != "either":
            what = "give a value" if a == "gives" else "take one"
            raise PackageError(f"{where}: {names} both {what}; a connection needs one that gives and one that takes")
        if connection.start_indices or connection.end_indices:
            raise PackageError(
                f"{where}: connections of single array elements (startIndices, endIndices) are not supported"
            )
        if a == b:
            self.undecided.append((start, end, connection))
        elif a == "gives" or b == "takes":
            self.lead(start, end, connection)
        else:
            self.lead(end, start, connection)

    def decide(self) -> None:
        """Find out which end gives a value where both may: the one that gets it from elsewhere."""

        def driven(node: Node) -> bool:
            return node[0] != "component" and self.entries.get(node, node) in self.driver

        def asked(node: Node) -> bool:
            wanted = node in self.drives or self.entries.get(node) in self.drives
            return node[0] != "component" and wanted and not driven(node)

        while self.undecided:
            known = next((c for c in self.undecided if driven(c[0]) or driven(c[1])), None)
            start, end, connection = known or self.undecided[0]
            self.undecided.remove((start, end, connection))
            back = driven(end) and not driven(start) if known else asked(start) and not asked(end)
            self.lead(*((end, start) if back else (start, end)), connection)

    def lead(self, source: Node, sink: Node, connection: Connection) -> None:
        """Have a connection bring the value of one node to another."""
        where = connection.where
        if source in self.entries and source not in self.driver:
            self.join(self.entries[source], source, where)
        entry = self.entries.get(sink)
        if entry is not None and sink in self.driver and self.driver[sink].source == entry:  # it was only read till now
            self.drives[entry] = [d for d in self.drives[entry] if d[0] != sink]
            del self.driver[sink]
        for node in filter(None, (sink, entry)):
            if node in self.driver:
                raise PackageError(
                    f"{where}: {_what(node)} is already driven by the connection in "
                    f"{_line(self.driver[node].connection.where, where)}"
                )
        self.driver[sink] = _Edge(source, connection)
        self.drives.setdefault(source, []).append((sink, connection))
        if entry is not None:
            self.join(sink, entry, where)

    def hop(self, node: Node, connection: Connection) -> Hop:
        """What a value meets on a connection that ends at a node."""
        return Hop(
            connection.transformation, connection.suppress_unit_conversion, self.types.get(node), connection.where,
            _what(node) if node[0] != "component" else "",
        )  # fmt: skip

    def trace(self, sink: Node) -> Wire | None:
        """The wire that ends at a node; None if nothing gives the value."""
        hops: list[Hop] = []
        node, seen = sink, {sink}
        while node in self.driver:
            edge = self.driver[node]
            hops.insert(0, self.hop(node, edge.connection))
            node = edge.source
            if node in seen:
                raise PackageError(f"{edge.connection.where}: the connections lead back to {_what(node)}")
            seen.add(node)
        if node[0] in ("dictionary", "border") or (node[0] == "system" and node[1] != ""):
            told = f"{_what(node)} leads to {_what(sink)}, but nothing gives it a value"
            self.idle[sink[1] if sink[0] == "component" else "", sink[2]] = f"{hops[0].where}: {told}"
            return None
        type = self.types.get(node)
        end = (sink[1] if sink[0] == "component" else "", sink[2])
        start = (node[1] if node[0] == "component" else "", node[2])
        return Wire(start, end, tuple(hops), type.unit if type else None, type.enumeration if type else None)

    # parameters

    def bind(self, system: System, path: str, settings: list[Setting], given: list[Setting]) -> None:
        """Settings of a system: those of its elements first, its own override them."""
        for element in system.elements:
            inner = f"{path}{element.name}"
            if isinstance(element, Component):
                for binding in element.bindings:
                    for setting in self.values(binding):
                        settings.append(replace(setting, component=inner))
            elif isinstance(element, System):
                self.bind(element, f"{inner}.", settings, given)
        for binding in system.bindings:
            for setting in self.values(binding):
                targets = list(self.targets(system, path, setting.variable, setting.hops))
                if not targets:
                    self.remarks.append(f"{setting.where}: {self.unbound(system, path, setting.variable)}")
                for component, variable, hops in targets:
                    made = replace(setting, component=component, variable=variable, hops=hops)
                    (settings if component else given).append(made)

    def unbound(self, system: System, path: str, name: str) -> str:
        """Why a binding sets nothing."""
        if (kind := self.kinds.get(("system", path, name))) is None:
            hint = did_you_mean(name, [e.name for e in system.elements])
            return f"nothing is called '{path}{name}'; the value is ignored{hint}"
        what = "is an output" if kind in GIVES else "leads nowhere"
        return f"the system's connector '{path}{name}' {what}; the value is ignored"

    def values(self, binding: Binding) -> Iterator[Setting]:
        """The values of a binding under the names it gives them in its element; with a mapping, of what it maps."""
        parameters = {f"{binding.prefix}{p.name}": p for p in binding.parameters}
        if binding.mapping is None:
            for name, p in parameters.items():
                yield Setting("", name, p.value, p.type, (), p.where, name)
            return
        entries: dict[str, list[MappingEntry]] = {}
        targets: dict[str, str] = {}
        for entry in binding.mapping:
            if entry.source not in parameters:
                self.remarks.append(f"{entry.where}: the parameter set has no '{entry.source}'")
                continue
            entries.setdefault(entry.source, []).append(entry)
            if (other := targets.setdefault(entry.target, entry.source)) != entry.source:
                told = f"'{other}' and '{entry.source}' are both mapped to '{entry.target}'; the later parameter counts"
                self.remarks.append(f"{entry.where}: {told}")
        for name, p in parameters.items():
            for entry in entries.get(name, ()):
                hop = Hop(entry.transformation, entry.suppress_unit_conversion, None, entry.where)
                yield Setting("", entry.target, p.value, p.type, (hop,), p.where, entry.target)
        if left := [name for name in parameters if name not in entries]:
            shown = ", ".join(left[:5]) + (f" and {len(left) - 5} more" if len(left) > 5 else "")
            self.remarks.append(f"{binding.where}: not applied, for the mapping does not name them: {shown}")

    def targets(self, system: System, path: str, name: str, hops: tuple[Hop, ...]) -> Iterator[Target]:
        """(component, variable, hops) of everything that a hierarchical name of a system stands for."""
        if any(c.name == name for c in system.connectors):
            node = ("system", path, name)
            if path == "" and self.kinds[node] == "input":
                yield "", name, hops
            yield from self.behind(node, hops)
        for element in system.elements:
            if name.startswith(f"{element.name}.") and len(name) > len(element.name) + 1:
                rest = name[len(element.name) + 1 :]
                if isinstance(element, Component):
                    yield f"{path}{element.name}", rest, hops
                elif isinstance(element, System):
                    yield from self.targets(element, f"{path}{element.name}.", rest, hops)

    def behind(self, node: Node, hops: tuple[Hop, ...]) -> Iterator[Target]:
        """Everything that a system's connector leads to."""
        type = self.types.get(node)
        if type is not None:
            hops = (*hops[:-1], replace(hops[-1] if hops else Hop(), type=type, between=_what(node)))
        for sink, connection in self.drives.get(node, ()):
            further = (*hops, self.hop(sink, connection))
            if sink[0] == "component":
                yield sink[1], sink[2], further
            elif len(further) < 1000:
                yield from self.behind(sink, further)


def _shown(end: tuple[str | None, str]) -> str:
    return end[1] if end[0] is None else f"{end[0]}.{end[1]}"


def _what(node: Node) -> str:
    if node[0] == "component":
        return f"input '{node[1]}.{node[2]}'"
    if node[0] in ("dictionary", "reference"):
        return f"entry '{node[2]}' of signal dictionary '{node[1]}'"
    return f"connector '{node[1]}{node[2]}'"


def _differ(one: Type | None, other: Type | None) -> bool:
    """Whether values have to be converted between two ends of what is one connector."""
    if one is None or other is None or one.unit is None or other.unit is None or one.unit.name == other.unit.name:
        return False
    return not alike(one.unit, other.unit)


def _line(where: str, other: str) -> str:
    """A place, without the file that another place names already."""
    file, _, line = where.partition(", ")
    return line if line and other.startswith(f"{file},") else where
