"""The system of slaves: where every signal lies, who is connected to whom, and in which order data flow.

All inputs and outputs lie on one board (`engine.program`), those of a slave and a type in a row.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...core.errors import CosimError, PackageError, ParameterError, did_you_mean
from ...core.units import Unit, alike
from ...ssp.model import Connector
from ...ssp.wires import At, End, Network, Wire, shown_at
from ..engine.loop import U8
from ..engine.program import Board, Cast, Program
from ..slaves.base import MOST_VALUES, REAL, TEXT, Group, Signal, Slave
from .execution_order import component_order
from .sizes import Extent, check_sizes, stated
from .value_conversion import Quantity, parsed, passage


@dataclass(frozen=True)
class Link:
    """A wire with the places at its ends."""

    source: Signal
    target: Signal
    cast: Cast
    wire: Wire

    @property
    def start(self) -> End:
        """(component, output)."""
        return self.wire.start

    @property
    def end(self) -> End:
        """(component, input)."""
        return self.wire.end


class System:
    """Slaves, signals and connections of a network, loaded and ready to be initialised and stepped."""

    def __init__(self, network: Network, slaves: dict[str, Slave], wrong: list[str] | None = None):
        """Raises `PackageError` for a connection that does not fit; with a list `wrong`, all of these go there."""
        self.network, self.slaves = network, slaves
        self.remarks: list[str] = []
        self._wrong = wrong
        self._count = {"slots": 0, "texts": 0}
        self._staged: dict[int, int] = {}
        wanted: dict[str, set[str]] = {name: set() for name in slaves}
        for wire in (*network.wires, *network.outputs):
            if wire.start[0] in wanted:
                wanted[wire.start[0]].add(wire.start[1])
        for name, slave in slaves.items():
            self._lay_out(slave, wanted[name])
        self.inputs = {(s.component, s.name): s for slave in slaves.values() for s in slave.inputs}
        self.outputs = {(s.component, s.name): s for slave in slaves.values() for s in slave.outputs}
        self._own_quantities = {name: self._own_quantity(name) for name in network.inputs}
        self.own_inputs = {name: self._own(name) for name in network.inputs}
        """The inputs of the whole system."""
        self.own_outputs: dict[str, Signal] = {}
        """The outputs of the whole system."""
        self._said = {
            (path, c.name): c.type.unit
            for path, part in network.parts.items()
            for c in part.component.connectors
            if c.type is not None and c.type.unit is not None
        }
        """Units that the package's connectors state."""
        self._compare_units()
        late, early = [], []
        for wire in network.wires:
            (early if self._is_parameter(wire.end) else late).append(wire)
        self.links = self._apart(self._all(self._link, [(wire,) for wire in late]))
        self._into: dict[str, list[Link]] = {name: [] for name in slaves}
        self._sources = {(link.source.component, link.source.name) for link in self.links}
        for link in self.links:
            self._into[link.target.component].append(link)
        self._drivers: dict[tuple[bool, int], dict[int | None, Link]] = {}
        """What drives an input, or single values of it, by where it lies."""
        self._check_aliases()
        early = [*network.early, *early]
        self.early = [wire for wire in early if wire.start[0]]
        """Wires to parameters, which carry what calculated parameters are before the run."""
        self._check_early()
        self._check_dimensions()
        for wire in early:
            if not wire.start[0] and network.inputs[wire.start[1]].kind == "input":
                end = ".".join(wire.end)
                self._refuse(f"{wire.where}: the input '{wire.start[1]}' cannot drive the parameter '{end}'")
        self.shown = self._all(self._shown, [(wire,) for wire in network.outputs])
        for link in (*self.links, *self.shown):
            for signal in (link.source, link.target):
                if signal.family == TEXT and signal.component:
                    slaves[signal.component].texts.add(signal.name)
        ends = [link.target for link in (*self.links, *self.shown)]
        others = [s for s in (*self.inputs.values(), *self.own_inputs.values()) if s.family != TEXT]
        spare = 8 * sum(s.size for s in ends) + 4 * sum(s.size for s in others) + 64
        self._free = self._own_slots = self._count["slots"]
        self.muted: set[str] = set()
        """Own inputs that nobody gives a value: what they are connected to keeps its start value."""
        self.watched: frozenset[End] | None = None
        """Outputs that are looked at from outside; None: all."""
        self.stop = float("inf")
        """The end of the run that the FMUs have been told [s]."""
        self.board = Board(self._count["slots"] + spare, self._count["texts"], self._staged)
        self.order = component_order(slaves, self.links)
        self.reset_inputs()

    # places

    def _place(self, family: str, size: int) -> int:
        key = "texts" if family == TEXT else "slots"
        self._count[key] += size
        return self._count[key] - size

    def _lay_out(self, slave: Slave, wanted: set[str]) -> None:
        inputs = [v for v in slave.variables.values() if v.causality == "input" and v.type in slave.forms]
        outputs = [
            v for v in slave.variables.values()
            if (v.causality == "output" or v.name in wanted) and v.type in slave.forms
        ]  # fmt: skip
        places: dict[tuple[str, int], int] = {}  # aliases are one input
        for chosen, signals, groups in (
            (inputs, slave.inputs, slave.input_groups),
            (outputs, slave.outputs, slave.output_groups),
        ):
            for kind in slave.forms:
                form = slave.forms[kind]
                members = []
                for v in (v for v in chosen if v.type == kind):
                    size, key = slave.size(v.name), (form.verb, v.valueReference)
                    is_alias = chosen is inputs and key in places
                    place = places[key] if is_alias else self._place(form.family, size)
                    signal = Signal(
                        slave.name, v.name, kind, form.family, v.valueReference, place, size, bool(v.dimensions)
                    )
                    signals.append(signal)
                    if not is_alias:
                        members.append(signal)
                        places[key] = place
                if not members:
                    continue
                count = sum(m.size for m in members)
                stage = 0
                if form.width is not None:
                    stage = self._staged.get(form.width, 0)
                    self._staged[form.width] = stage + count
                references = np.array([m.reference for m in members], np.uint32)
                groups.append(Group(form, references, members[0].place, count, stage, members))
        if slave.version != "1.0":
            begin = -(-self._staged.get(U8, 0) // 8) * 8
            slave.told = begin
            self._staged[U8] = begin + 16

    def scratch(self, size: int = 1) -> int:
        """First of so many free slots, for what an algorithm has to remember."""
        if self._free + size > len(self.board.reals):
            raise MemoryError("the board has no free slots left")
        self._free += size
        return self._free - size

    def release(self) -> None:
        """All scratch is free again; programs that use some must not be run any more."""
        self._free = self._own_slots

    def _own(self, name: str) -> Signal:
        """An input of the whole system; the sizes of an array are the package's, else those of what it leads to."""
        quantity, type = self.input_quantity(name), self.network.inputs[name].type
        parted = any(w.start == ("", name) and w.start_at for w in self.network.wires)
        size = type.count if type is not None else None
        if size is not None:
            if size > MOST_VALUES:
                raise PackageError(f"{self.network.inputs[name].where}: '{name}' has {size:.1e} values; refused")
        else:
            ends = (w.end for w in self.network.wires if w.start == ("", name) and not w.end_at)
            sizes = [self.slaves[c].size(v) for c, v in ends if c in self.slaves and v in self.slaves[c].variables]
            size = sizes[0] if sizes else 1
        return Signal("", name, quantity.type, quantity.family, 0, self._place(quantity.family, size), size, parted)

    def input_quantity(self, name: str) -> Quantity:
        """What is known of an input of the whole system."""
        return self._own_quantities[name]

    def _own_quantity(self, name: str) -> Quantity:
        """What the package says of an input of the whole system; what it leaves out is that of what it leads to."""
        type, shown = self.network.inputs[name].type, f"'{name}'"
        leads = []
        for wire in self.network.wires:
            if wire.start == ("", name) and wire.end[1] in getattr(self.slaves.get(wire.end[0]), "variables", ()):
                leads.append(self._reached(wire))
        if type is None:
            return leads[0] if leads else Quantity("Real", None, None, shown)
        unit, items = type.unit, type.enumeration
        if unit is None:
            units = {u.name: u for q in leads if (u := q.unit) is not None}
            unit = next(iter(units.values()), None)
            if len(units) > 1:
                where = self.network.inputs[name].where
                self.remarks.append(
                    f"{where}: input '{name}' has no unit and leads to {', '.join(units)}; taken to be in {unit.name}"
                )
        if items is None:
            items = next((q.items for q in leads if q.items is not None), None)
        return Quantity(type.kind, unit, items, shown)

    def _reached(self, wire: Wire) -> Quantity:
        """What the first thing on a way is: a connector where the package tells its unit, else the FMU's variable."""
        end = self.quantity(wire.end)
        hop = next((h for h in wire.hops if h.unit is not None or h.transformation is not None), None)
        if hop is None:
            return end if not any(h.suppress_unit_conversion for h in wire.hops) else replace(end, unit=None)
        unit = None if hop.suppress_unit_conversion else hop.unit or (end.unit if hop is wire.hops[-1] else None)
        items = None if hop.transformation is not None else hop.enumeration or end.items
        return replace(end, unit=unit, items=items)

    # connections

    def _check_aliases(self) -> None:
        """No two connections lead to one input, by whatever name."""
        for link in self.links:
            there, which = self._drivers.setdefault(link.target.home, {}), link.target.element
            other = there.get(which) or there.get(None) or (next(iter(there.values()), None) if which is None else None)
            there.setdefault(which, link)
            if other is not None:
                self._refuse(
                    f"{link.wire.where}: '{link.target.address}' is another name of '{other.target.address}', "
                    "which is driven already"
                )

    def driver(self, end: End) -> Link | None:
        """The connection that drives an input or an element of it, by whatever name; None for what none drives."""
        there = self._drivers.get(self.inputs[end].home, {}) if end in self.inputs else {}
        return next(iter(there.values()), None)

    def _refuse(self, told: str) -> None:
        if self._wrong is None:
            raise PackageError(told)
        self._wrong.append(told)

    def _check_dimensions(self) -> None:
        """Arrays are as large as their connectors say."""
        for path, part in self.network.parts.items():
            for connector in part.component.connectors:
                count = connector.type.count if connector.type is not None else None
                if count is None or path not in self.slaves or connector.name not in self.slaves[path].variables:
                    continue
                size = self.slaves[path].size(connector.name)
                if count != size:
                    self._refuse(
                        f"{connector.where}: connector '{path}.{connector.name}' is {connector.type.shape}, its FMU's "
                        f"variable has {size} values"
                    )

    def _is_parameter(self, end: End) -> bool:
        slave = self.slaves.get(end[0])
        variable = slave.variables.get(end[1]) if slave is not None else None
        fixed = ("parameter", "structuralParameter", "calculatedParameter")
        return variable is not None and variable.causality in fixed

    def _check_early(self) -> None:
        """What wires to parameters need: variables that exist, types and units that fit."""
        for wire in self.early:
            try:
                for end in (wire.start, wire.end):
                    if end[0] not in self.slaves:
                        raise PackageError(f"{wire.where}: component '{end[0]}' cannot be used")
                    self.slaves[end[0]].variable(end[1])
                    if self.slaves[end[0]].form(end[1]) is None:
                        raise PackageError(f"{wire.where}: '{'.'.join(end)}': its type is not supported")
                source = self.slaves[wire.start[0]].variables[wire.start[1]]
                if not self._is_parameter(wire.start) and source.variability not in ("constant", "fixed"):
                    raise PackageError(
                        f"{wire.where}: '{'.'.join(wire.start)}' changes during a run and cannot drive the parameter "
                        f"'{'.'.join(wire.end)}'"
                    )
                target = self.slaves[wire.end[0]].variables[wire.end[1]]
                if wire.start_at or wire.end_at:
                    raise PackageError("connections of single elements of parameters are not supported")
                if target.causality == "structuralParameter":
                    raise PackageError(
                        f"'{'.'.join(wire.end)}' gives arrays their size and cannot be driven; bind its value"
                    )
                if not self.slaves[wire.end[0]].settable(wire.end[1]):
                    raise PackageError(f"{wire.where}: '{'.'.join(wire.end)}' cannot be set")
                ends = [Extent(f"'{c}.{v}'", self.slaves[c].size(v), self.slaves[c].shape(v))
                        for c, v in (wire.start, wire.end)]  # fmt: skip
                check_sizes(ends[0], wire.hops, ends[1], wire.where)
                given = self.quantity(wire.start, wire.unit, wire.enumeration)
                self.remarks += passage(given, wire.hops, self.quantity(wire.end), wire.where).remarks
            except CosimError as error:
                told = str(error) if str(error).startswith(wire.where) else f"{wire.where}: {error}"
                self._refuse(told)

    def quantity(self, end: End, unit: Unit | None = None, items: dict[str, int] | None = None) -> Quantity:
        """What is known of a variable; the package's unit and items count before the FMU's."""
        slave = self.slaves[end[0]]
        kind = slave.variables[end[1]].type
        shown = f"'{end[0]}.{end[1]}'"
        return Quantity(kind, slave.meant(unit, end[1]), items or slave.items(end[1]), shown, slave.relative(end[1]))

    def _variable(self, wire: Wire, end: End, causality: str) -> Signal:
        where = wire.where
        if end[0] not in self.slaves:
            raise PackageError(f"{where}: component '{end[0]}' cannot be used")
        slave = self.slaves[end[0]]
        variable = slave.variables.get(end[1])
        if variable is None:
            hint = did_you_mean(end[1], list(slave.variables))
            raise PackageError(f"{where}: component '{end[0]}' has no variable '{end[1]}'{hint}")
        if variable.type not in slave.forms:
            raise PackageError(f"{where}: '{end[0]}.{end[1]}': type {variable.type} is not supported")
        if causality == "input" and variable.causality != "input":
            raise PackageError(f"{where}: '{end[0]}.{end[1]}' is not an input, its causality is '{variable.causality}'")
        if causality == "output" and variable.causality not in ("output", "local", "calculatedParameter", None):
            raise PackageError(
                f"{where}: '{end[0]}.{end[1]}' is not an output, its causality is '{variable.causality}'"
            )
        return (self.inputs if causality == "input" else self.outputs)[end]

    def _all(self, make: Callable[..., Link], arguments: Sequence[tuple[Any, ...]]) -> list[Link]:
        made = []
        for given in arguments:
            try:
                made.append(make(*given))
            except CosimError as error:
                if self._wrong is None:
                    raise
                self._wrong.append(str(error))
        return made

    def _source(self, wire: Wire) -> tuple[Signal, Quantity]:
        if wire.start[0] == "":
            return self.own_inputs[wire.start[1]], self.input_quantity(wire.start[1])
        return self._variable(wire, wire.start, "output"), self.quantity(wire.start, wire.unit, wire.enumeration)

    def _part(self, signal: Signal, at: At, where: str) -> Signal:
        """One value of an array, which its indices name; () for all of a signal."""
        if not at:
            return signal
        shown = f"'{signal.address}'"
        if signal.component:
            shape, why = self.slaves[signal.component].shape(signal.name), "is no array"
        else:
            extent = stated(self._connector(signal.name).type, shown)
            shape, why = (extent.shape if extent else None) or (), "has no sizes in the package (<ssc:Dimension size=>)"
        if not shape:
            raise PackageError(f"{where}: {shown} {why}, but indices are given for it")
        if len(at) != len(shape) or not all(1 <= k <= size for k, size in zip(at, shape, strict=True)):
            sizes = " x ".join(map(str, shape))
            raise PackageError(f"{where}: {shown} is {sizes} in size and has no element {shown_at(at)}")
        return signal.part(int(np.ravel_multi_index([k - 1 for k in at], shape)))

    def _apart(self, links: list[Link]) -> list[Link]:
        """Links of whole arrays in single values where others carry single values of the same source."""
        parted = {link.source.address for link in links if link.source.element is not None}
        made = []
        for link in links:
            if link.source.address not in parted or link.source.element is not None:
                made.append(link)
                continue
            for k in range(link.source.size):
                made.append(replace(link, source=link.source.part(k), target=link.target.part(k)))
        return made

    def _connector(self, name: str) -> Connector:
        """A connector of the whole system."""
        return next(c for c in self.network.structure.system.connectors if c.name == name)

    def _link(self, wire: Wire) -> Link:
        target = self._part(self._variable(wire, wire.end, "input"), wire.end_at, wire.where)
        source, given = self._source(wire)
        source = self._part(source, wire.start_at, wire.where)
        taken = self.quantity(wire.end)
        way = passage(given, wire.hops, taken, wire.where)
        self.remarks += way.remarks
        check_sizes(self._extent(source), wire.hops, self._extent(target), wire.where)
        cast = Cast() if target.family == TEXT else way.cast(given, taken, wire.where)
        return Link(source, target, cast, wire)

    def _extent(self, signal: Signal) -> Extent:
        shown = f"'{signal.address}'"
        if signal.element is not None:
            return Extent(f"one element of {shown}", 1)
        if signal.component:
            return Extent(shown, signal.size, self.slaves[signal.component].shape(signal.name))
        return stated(self.network.inputs[signal.name].type, shown) or Extent(shown, signal.size)

    def _compare_units(self) -> None:
        """Remark outputs whose connector states another unit than the FMU; of inputs `passage` does that."""
        for (component, name), said in self._said.items():
            slave = self.slaves[component]
            if name not in slave.variables or slave.variables[name].causality != "output":
                continue
            own = slave.unit(name)
            if own is not None and own.name != said.name and not alike(slave.meant(said, name) or said, own):
                self.remarks.append(
                    f"the package says '{component}.{name}' is in {said.name}, its FMU says {own.name}; the package's "
                    "word counts"
                )

    def _shown(self, wire: Wire) -> Link:
        name = wire.end[1]
        source, given = self._source(wire)
        source = self._part(source, wire.start_at, wire.where)
        last = wire.hops[-1] if wire.hops else None
        type = self._connector(name).type
        kind = type.kind if type is not None else given.type
        taken = Quantity(kind, last.unit if last else None, last.enumeration if last else None, f"'{name}'")
        way = passage(given, wire.hops, taken, wire.where)
        self.remarks += way.remarks
        check_sizes(self._extent(source), wire.hops, None, wire.where)
        cast = Cast() if taken.family == TEXT else way.cast(given, taken, wire.where)
        target = self.own_outputs.get(name)
        if target is None:
            size = (type.count if type is not None else None) or 1 if wire.end_at else source.size
            target = Signal("", name, kind, taken.family, 0, self._place(taken.family, size), size, bool(wire.end_at))
            self.own_outputs[name] = target
        return Link(source, self._part(target, wire.end_at, wire.where), cast, wire)

    def passed_on(self, name: str) -> set[int]:
        """Which values of an output of the whole system show its inputs, which belong to a step, not to its start."""
        begin = self.own_outputs[name].place
        shown = (link.target for link in self.shown if link.target.name == name and not link.source.component)
        return {target.place - begin + k for target in shown for k in range(target.size)}

    def units(self) -> dict[str, str]:
        """Unit of every signal that has one, by address."""
        signals = [*self.outputs.values(), *self.inputs.values(), *self.own_inputs.values(), *self.own_outputs.values()]
        return {s.address: unit for s in signals if (unit := self.unit_of(s))}

    def unit_of(self, signal: Signal) -> str | None:
        """Name of a signal's unit."""
        if signal.component:
            said = self._said.get((signal.component, signal.name))
            return said.name if said is not None else self.slaves[signal.component].unit_name(signal.name)
        type = self._connector(signal.name).type
        return type.unit.name if type is not None and type.unit is not None else None

    # values

    def reset_inputs(self) -> None:
        """Give every input its start value from the model description; `unstarted` are those that have none there."""
        self.unstarted = {signal.home: signal for signal in self.inputs.values()}
        for component, name in self.inputs:
            value = self.slaves[component].start(name)
            if value is not None:
                self.set_input(component, name, value)
                self.unstarted.pop(self.inputs[component, name].home, None)
        for signal in self.own_inputs.values():
            self.put(signal, ("" if signal.family == TEXT else 0,) * signal.size)

    def begin_with(self, signal: Signal, value: object, element: int | None = None) -> None:
        """Give an input, or one element of it, the value of what drives it; it needs no start value then."""
        self.put(signal, value, element)
        self.unstarted.pop(signal.home, None)

    def set_input(self, component: str, name: str, value: object) -> None:
        """Set the value that an input has until a connection overwrites it; '' is the whole system."""
        self.put(self.inputs[component, name] if component else self.own_inputs[name], value)

    def mute(self, given: set[str]) -> None:
        """Only these of the system's own inputs have a value."""
        self.muted = set(self.own_inputs) - given

    def reflect(self) -> None:
        """Show muted inputs of the system as what they are connected to has it."""
        reals, integers = self.board.reals, self.board.integers
        for link in reversed(self.links):
            if self.speaks(link):
                continue
            there, here = (slice(s.place, s.place + s.size) for s in (link.target, link.source))
            if link.target.family == TEXT:
                self.board.texts[here] = self.board.texts[there]
            elif link.cast.plain:
                integers[here] = integers[there]
            else:
                seen = reals if link.target.family == REAL else integers
                for i, value in enumerate(seen[there].tolist(), here.start):
                    if (start := link.cast.back(value)) is not None:
                        (reals if link.source.family == REAL else integers)[i] = start

    def is_read(self, end: End) -> bool:
        """Whether somebody reads an output: another component, or who looks on."""
        return self.watched is None or end in self.watched or end in self._sources

    def speaks(self, link: Link) -> bool:
        """Whether somebody gives the value that a link carries."""
        return bool(link.source.component) or link.source.name not in self.muted

    def checked_input(self, name: str, value: object, where: str) -> object:
        """A value for an own input in its type, a tuple for an array, or a `ParameterError`."""
        quantity, size = self.input_quantity(name), self.own_inputs[name].size
        shown = f"the system's input '{name}'"
        if size > 1 or isinstance(value, tuple):
            parts = value.replace(",", " ").split() if isinstance(value, str) else value
            values = list(parts) if isinstance(parts, (tuple, list)) else [parts] * size
            if len(values) != size:
                raise ParameterError(f"{where}: {shown} has {size} values, not {len(values)}")
            return tuple(parsed(v, quantity, shown, where) for v in values)
        return parsed(value, quantity, shown, where)

    def check_reached(self, name: str, value: object, where: str) -> None:
        """Raise `ParameterError` where a value of an own input is none that the variables behind it may take."""
        source = self.own_inputs[name]
        for link in self.links:
            if link.source.component or link.source.name != name or source.family == TEXT:
                continue
            values = value if isinstance(value, tuple) else (value,)
            for one in values if link.source.element is None else (values[link.source.element],):
                reached = link.cast.forth(one)  # type: ignore[arg-type]
                self.slaves[link.target.component]._scalar(link.target.name, reached, where)

    def put(self, signal: Signal, value: object, element: int | None = None) -> None:
        """Write a value, or a tuple of an array's, to a signal's place; or one element of an array."""
        values = value if isinstance(value, tuple) else (value,)
        if len(values) != (signal.size if element is None else 1):
            raise ParameterError(f"'{signal.address}' has {signal.size} values, not {len(values)}")
        for place, v in enumerate(values, signal.place + (element or 0)):
            if signal.family == TEXT:
                self.board.texts[place] = v  # type: ignore[call-overload]
            elif signal.family == REAL:
                self.board.reals[place] = float(v)  # type: ignore[arg-type]
            else:
                number = int(v)  # type: ignore[call-overload]
                self.board.integers[place] = number if number < 2**63 else number - 2**64

    # programs

    def program(self) -> Program:
        """An empty program for this system."""
        return Program(self.board, list(self.slaves.values()))

    def links_into(self, name: str) -> list[Link]:
        """The links to a component."""
        return self._into[name]

    def links_to(self, name: str) -> list[Link]:
        """The links that carry something to a component."""
        return [k for k in self._into[name] if self.speaks(k)]

    def is_continuous(self, link: Link) -> bool:
        """Whether a link carries a continuous real from an output, which may be carried on and averaged."""
        ends = (link.source, link.target)
        return bool(link.source.component) and all(
            s.family == REAL and self.slaves[s.component].variables[s.name].variability in (None, "continuous")
            for s in ends
        )

    def is_averaged(self, link: Link) -> bool:
        """Whether what a link carries may be handed over as its mean over the step.

        Not so where another connected input is its rate (FMI: `derivative`): an FMU that is told how fast an input
        moves carries it on by itself, from what it is at the step's start.
        """
        if not self.is_continuous(link) or not link.target.component:
            return False
        variables = self.slaves[link.target.component].variables
        own = variables[link.target.name]
        return not any(
            variables[k.target.name].derivative is own and self.is_continuous(k)
            for k in self.links_to(link.target.component)
        )

    def exchange(self, program: Program, names: Iterable[str], instead: dict[int, int] | None = None) -> None:
        """Bring the inputs of these slaves up to date. `instead` gives the slots that stand for some sources."""
        for name in names:
            for link in self.links_to(name):
                self.pass_on(program, link, instead)

    def pass_on(self, program: Program, link: Link, instead: dict[int, int] | None = None) -> None:
        """One link."""
        source = link.source.place
        if link.target.family == TEXT:
            for k in range(link.target.size):
                program.copy_text(link.target.place + k, source + k)
            return
        if instead:
            source = instead.get(source, source)
        program.cast(link.target.place, source, link.target.size, link.cast, link.wire.where)

    def show(self, program: Program) -> None:
        """Bring the outputs of the whole system up to date."""
        for link in self.shown:
            self.pass_on(program, link)
