"""Who is connected to whom: the package's flat connections as links between places in the buffer."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from ...core.errors import CosimError, PackageError, did_you_mean
from ...ssp.flat_system import ElementIndices, End, FlatConnection, FlatSystem, indices_text
from ..engine.program import SlotConversion
from ..engine.values import TEXT, Signal
from ..slaves.base import FmuInstance
from .findings import Findings
from .layout import SignalLayout
from .quantities import Quantities
from .sizes import Extent, check_sizes, stated
from .value_conversion import Quantity, value_conversion


@dataclass(frozen=True)
class SignalConnection:
    """A connection between two signals of the buffer, with the conversion on the way."""

    source: Signal
    target: Signal
    conversion: SlotConversion
    flat_connection: FlatConnection

    @property
    def start(self) -> End:
        """(component, output)."""
        return self.flat_connection.start

    @property
    def end(self) -> End:
        """(component, input)."""
        return self.flat_connection.end


class Connections:
    """The links of a network; what does not fit goes to the findings."""

    def __init__(
        self, network: FlatSystem, instances: Mapping[str, FmuInstance], layout: SignalLayout, quantities: Quantities,
        system_inputs: Mapping[str, Signal], findings: Findings, remarks: list[str],
    ):  # fmt: skip
        self.instances, self._findings = instances, findings
        self._layout, self._quantities = layout, quantities
        self.network = network = network.without(self._check_dimensions(network))
        self.remarks = remarks
        self.inputs = {(s.component, s.name): s for instance in instances.values() for s in instance.inputs}
        self.outputs = {(s.component, s.name): s for instance in instances.values() for s in instance.outputs}
        self.system_inputs = system_inputs
        self.system_outputs: dict[str, Signal] = {}
        """The outputs of the whole system."""
        signal_connections: list[FlatConnection] = []
        to_parameters: list[FlatConnection] = []
        for flat_connection in network.flat_connections:
            (to_parameters if self._is_parameter(flat_connection.end) else signal_connections).append(flat_connection)
        self.links = self._apart(self._build(self._link, signal_connections))
        self._into: dict[str, list[SignalConnection]] = {name: [] for name in instances}
        for link in self.links:
            self._into[link.target.component].append(link)
        self._of_system_inputs: dict[str, list[SignalConnection]] = {}
        for link in self.links:
            if not link.source.component:
                self._of_system_inputs.setdefault(link.source.name, []).append(link)
        self._drivers: dict[tuple[bool, int], dict[int | None, SignalConnection]] = {}
        """What drives an input, or single values of it, by where it lies."""
        self._check_aliases()
        to_parameters = [*network.parameter_connections, *to_parameters]
        self.parameter_connections = [flat_connection for flat_connection in to_parameters if flat_connection.start[0]]
        """Connections from calculated parameters to parameters; their values are set before the run."""
        self._check_parameter_connections()
        for flat_connection in to_parameters:
            if not flat_connection.start[0] and network.inputs[flat_connection.start[1]].kind == "input":
                end = ".".join(flat_connection.end)
                start = flat_connection.start[1]
                findings.refuse(f"{flat_connection.where}: the input '{start}' cannot drive the parameter '{end}'")
        self.shown = self._build(self._shown, network.outputs)
        self._passed_on: dict[str, set[int]] = {}
        for link in self.shown:
            if not link.source.component:
                first = link.target.place - self.system_outputs[link.target.name].place
                self._passed_on.setdefault(link.target.name, set()).update(range(first, first + link.target.size))

    def into(self, name: str) -> list[SignalConnection]:
        """The links to a component."""
        return self._into[name]

    def of_input(self, name: str) -> list[SignalConnection]:
        """The links from an input of the whole system."""
        return self._of_system_inputs.get(name, [])

    def ends(self) -> list[tuple[str, str]]:
        """Names of the two ends of every connection, those to the outputs of the whole system included."""
        return [(link.source.label, link.target.label) for link in (*self.links, *self.shown)]

    def _build(
        self, make: Callable[[FlatConnection], SignalConnection], flat_connections: Iterable[FlatConnection]
    ) -> list[SignalConnection]:
        links = (self._findings.attempt(make, flat_connection) for flat_connection in flat_connections)
        return [link for link in links if link is not None]

    def _check_aliases(self) -> None:
        """No two connections lead to one input, by whatever name."""
        for link in self.links:
            drivers, element = self._drivers.setdefault(link.target.home, {}), link.target.element
            other = (
                drivers.get(element)
                or drivers.get(None)
                or (next(iter(drivers.values()), None) if element is None else None)
            )
            drivers.setdefault(element, link)
            if other is not None:
                self._findings.refuse(
                    f"{link.flat_connection.where}: '{link.target.address}' is another name of "
                    f"'{other.target.address}', which is driven already"
                )

    def driver(self, end: End) -> SignalConnection | None:
        """The connection that drives an input or an element of it, by whatever name; None for what none drives."""
        drivers = self._drivers.get(self.inputs[end].home, {}) if end in self.inputs else {}
        return next(iter(drivers.values()), None)

    def _check_dimensions(self, network: FlatSystem) -> set[End]:
        """Arrays are as large as their connectors say; those that are not, which no connection can be judged by."""
        wrong: set[End] = set()
        for path, flat_component in network.components.items():
            for connector in flat_component.component.connectors:
                type = connector.type
                if type is None or type.count is None:
                    continue
                if path not in self.instances or connector.name not in self.instances[path].variables:
                    continue
                size = self.instances[path].size(connector.name)
                if type.count != size:
                    wrong.add((path, connector.name))
                    self._findings.refuse(
                        f"{connector.where}: connector '{path}.{connector.name}' is {type.shape}, its FMU's "
                        f"variable has {size} values"
                    )
        return wrong

    def _is_parameter(self, end: End) -> bool:
        instance = self.instances.get(end[0])
        variable = instance.variables.get(end[1]) if instance is not None else None
        fixed = ("parameter", "structuralParameter", "calculatedParameter")
        return variable is not None and variable.causality in fixed

    def _check_parameter_connections(self) -> None:
        """What flat connections to parameters need: variables that exist, types and units that fit."""
        for flat_connection in self.parameter_connections:
            try:
                for end in (flat_connection.start, flat_connection.end):
                    if end[0] not in self.instances:
                        raise PackageError(f"{flat_connection.where}: component '{end[0]}' cannot be used")
                    self.instances[end[0]].variable(end[1])
                    if self.instances[end[0]].fmi_type(end[1]) is None:
                        raise PackageError(f"{flat_connection.where}: '{'.'.join(end)}': its type is not supported")
                source = self.instances[flat_connection.start[0]].variables[flat_connection.start[1]]
                if not self._is_parameter(flat_connection.start) and source.variability not in ("constant", "fixed"):
                    raise PackageError(
                        f"{flat_connection.where}: '{'.'.join(flat_connection.start)}' changes during a run and cannot "
                        f"drive the parameter '{'.'.join(flat_connection.end)}'"
                    )
                target = self.instances[flat_connection.end[0]].variables[flat_connection.end[1]]
                if flat_connection.start_indices or flat_connection.end_indices:
                    raise PackageError("connections of single elements of parameters are not supported")
                if target.causality == "structuralParameter":
                    raise PackageError(
                        f"'{'.'.join(flat_connection.end)}' gives arrays their size and cannot be driven; bind its "
                        "value"
                    )
                if not self.instances[flat_connection.end[0]].settable(flat_connection.end[1]):
                    raise PackageError(f"{flat_connection.where}: '{'.'.join(flat_connection.end)}' cannot be set")
                ends = [Extent(f"'{c}.{v}'", self.instances[c].size(v), self.instances[c].shape(v))
                        for c, v in (flat_connection.start, flat_connection.end)]  # fmt: skip
                check_sizes(ends[0], flat_connection.hops, ends[1], flat_connection.where)
                gives = self._quantities.quantity(
                    flat_connection.start, flat_connection.unit, flat_connection.enumeration
                )
                takes = self._quantities.quantity(flat_connection.end)
                self.remarks += value_conversion(gives, flat_connection.hops, takes, flat_connection.where).remarks
            except CosimError as error:
                text = (
                    str(error) if str(error).startswith(flat_connection.where) else f"{flat_connection.where}: {error}"
                )
                self._findings.refuse(text)

    def _variable(self, flat_connection: FlatConnection, end: End, causality: str) -> Signal:
        where = flat_connection.where
        if end[0] not in self.instances:
            raise PackageError(f"{where}: component '{end[0]}' cannot be used")
        instance = self.instances[end[0]]
        variable = instance.variables.get(end[1])
        if variable is None:
            hint = did_you_mean(end[1], list(instance.variables))
            raise PackageError(f"{where}: component '{end[0]}' has no variable '{end[1]}'{hint}")
        if variable.type not in instance.types:
            raise PackageError(f"{where}: '{end[0]}.{end[1]}': type {variable.type} is not supported")
        if causality == "input" and variable.causality != "input":
            raise PackageError(f"{where}: '{end[0]}.{end[1]}' is not an input, its causality is '{variable.causality}'")
        if causality == "output" and variable.causality not in ("output", "local", "calculatedParameter", None):
            raise PackageError(
                f"{where}: '{end[0]}.{end[1]}' is not an output, its causality is '{variable.causality}'"
            )
        return (self.inputs if causality == "input" else self.outputs)[end]

    def _source(self, flat_connection: FlatConnection) -> tuple[Signal, Quantity]:
        if flat_connection.start[0] == "":
            return self.system_inputs[flat_connection.start[1]], self._quantities.input_quantity(
                flat_connection.start[1]
            )
        signal = self._variable(flat_connection, flat_connection.start, "output")
        return signal, self._quantities.quantity(
            flat_connection.start, flat_connection.unit, flat_connection.enumeration
        )

    def _part(self, signal: Signal, indices: ElementIndices, where: str) -> Signal:
        """One value of an array, which its indices name; () for all of a signal."""
        if not indices:
            return signal
        shown = f"'{signal.address}'"
        if signal.component:
            shape, why = self.instances[signal.component].shape(signal.name), "is no array"
        else:
            extent = stated(self._quantities.connector(signal.name).type, shown)
            shape, why = (extent.shape if extent else None) or (), "has no sizes in the package (<ssc:Dimension size=>)"
        if not shape:
            raise PackageError(f"{where}: {shown} {why}, but indices are given for it")
        if len(indices) != len(shape) or not all(1 <= k <= size for k, size in zip(indices, shape, strict=True)):
            sizes = " x ".join(map(str, shape))
            raise PackageError(f"{where}: {shown} is {sizes} in size and has no element {indices_text(indices)}")
        return signal.part(int(np.ravel_multi_index([k - 1 for k in indices], shape)))

    def _apart(self, links: list[SignalConnection]) -> list[SignalConnection]:
        """Links of whole arrays in single values where others carry single values of the same source."""
        parted = {link.source.address for link in links if link.source.element is not None}
        parts = []
        for link in links:
            if link.source.address not in parted or link.source.element is not None:
                parts.append(link)
                continue
            for k in range(link.source.size):
                parts.append(replace(link, source=link.source.part(k), target=link.target.part(k)))
        return parts

    def _link(self, flat_connection: FlatConnection) -> SignalConnection:
        target = self._part(
            self._variable(flat_connection, flat_connection.end, "input"),
            flat_connection.end_indices,
            flat_connection.where,
        )
        source, gives = self._source(flat_connection)
        source = self._part(source, flat_connection.start_indices, flat_connection.where)
        takes = self._quantities.quantity(flat_connection.end)
        way = value_conversion(gives, flat_connection.hops, takes, flat_connection.where)
        self.remarks += way.remarks
        check_sizes(self._extent(source), flat_connection.hops, self._extent(target), flat_connection.where)
        conversion = SlotConversion() if target.family == TEXT else way.over_slots(gives, takes, flat_connection.where)
        return SignalConnection(source, target, conversion, flat_connection)

    def _extent(self, signal: Signal) -> Extent:
        shown = f"'{signal.address}'"
        if signal.element is not None:
            return Extent(f"one element of {shown}", 1)
        if signal.component:
            return Extent(shown, signal.size, self.instances[signal.component].shape(signal.name))
        return stated(self.network.inputs[signal.name].type, shown) or Extent(shown, signal.size)

    def _shown(self, flat_connection: FlatConnection) -> SignalConnection:
        name = flat_connection.end[1]
        source, gives = self._source(flat_connection)
        source = self._part(source, flat_connection.start_indices, flat_connection.where)
        last = flat_connection.hops[-1] if flat_connection.hops else None
        type = self._quantities.connector(name).type
        kind = type.kind if type is not None else gives.type
        takes = Quantity(kind, last.unit if last else None, last.enumeration if last else None, f"'{name}'")
        way = value_conversion(gives, flat_connection.hops, takes, flat_connection.where)
        self.remarks += way.remarks
        check_sizes(self._extent(source), flat_connection.hops, None, flat_connection.where)
        conversion = SlotConversion() if takes.family == TEXT else way.over_slots(gives, takes, flat_connection.where)
        target = self.system_outputs.get(name)
        if target is None:
            size = (type.count if type is not None else None) or 1 if flat_connection.end_indices else source.size
            place = self._layout.place(takes.family, size)
            target = Signal("", name, kind, takes.family, 0, place, size, bool(flat_connection.end_indices))
            self.system_outputs[name] = target
        return SignalConnection(
            source, self._part(target, flat_connection.end_indices, flat_connection.where), conversion, flat_connection
        )

    def passed_on(self, name: str) -> set[int]:
        """Which values of an output of the whole system show its inputs, which belong to a step, not to its start."""
        return self._passed_on.get(name, set())
