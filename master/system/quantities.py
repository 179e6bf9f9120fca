"""What is known of the values of signals: types, units and items, by the package's word, else by the FMU's."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace

from ...core.units import Unit, alike
from ...ssp.flat_system import End, FlatConnection, FlatSystem
from ...ssp.model import Connector
from ..engine.values import Signal
from ..slaves.base import FmuInstance
from .value_conversion import Quantity


class Quantities:
    """Type, unit and enumeration of each signal: of components' variables, and of the system's inputs and outputs."""

    def __init__(self, network: FlatSystem, instances: Mapping[str, FmuInstance], remarks: list[str]):
        self.network, self.instances, self.remarks = network, instances, remarks
        self._connectors = {c.name: c for c in reversed(network.structure.system.connectors)}
        self._own = {name: self._own_quantity(name) for name in network.inputs}
        self._said = {
            (path, c.name): c.type.unit
            for path, flat_component in network.components.items()
            for c in flat_component.component.connectors
            if c.type is not None and c.type.unit is not None
        }
        """Units that the package's connectors state."""
        self._compare_units()

    def quantity(self, end: End, unit: Unit | None = None, items: dict[str, int] | None = None) -> Quantity:
        """What is known of a variable; the package's unit and items count before the FMU's."""
        instance = self.instances[end[0]]
        kind = instance.variables[end[1]].type
        shown = f"'{end[0]}.{end[1]}'"
        items = items or instance.items(end[1])
        return Quantity(kind, instance.meant(unit, end[1]), items, shown, instance.relative(end[1]))

    def input_quantity(self, name: str) -> Quantity:
        """What is known of an input of the whole system."""
        return self._own[name]

    def _own_quantity(self, name: str) -> Quantity:
        """What the package says of an input of the whole system; what it leaves out is that of what it leads to."""
        type, shown = self.network.inputs[name].type, f"'{name}'"
        leads = []
        for flat_connection in self.network.from_inputs.get(name, ()):
            if flat_connection.end[1] in getattr(self.instances.get(flat_connection.end[0]), "variables", ()):
                leads.append(self._reached(flat_connection))
        if type is None:
            return leads[0] if leads else Quantity("Real", None, None, shown)
        unit, items = type.unit, type.enumeration
        if unit is None:
            units = {u.name: u for q in leads if (u := q.unit) is not None}
            unit = next(iter(units.values()), None)
            if unit is not None and len(units) > 1:
                where = self.network.inputs[name].where
                self.remarks.append(
                    f"{where}: input '{name}' has no unit and leads to {', '.join(units)}; taken to be in {unit.name}"
                )
        if items is None:
            items = next((q.items for q in leads if q.items is not None), None)
        return Quantity(type.kind, unit, items, shown)

    def _reached(self, flat_connection: FlatConnection) -> Quantity:
        """What the first thing on a way is: a connector where the package tells its unit, else the FMU's variable."""
        end = self.quantity(flat_connection.end)
        hop = next((h for h in flat_connection.hops if h.unit is not None or h.transformation is not None), None)
        if hop is None:
            return end if not any(h.suppress_unit_conversion for h in flat_connection.hops) else replace(end, unit=None)
        unit = (
            None
            if hop.suppress_unit_conversion
            else hop.unit or (end.unit if hop is flat_connection.hops[-1] else None)
        )
        items = None if hop.transformation is not None else hop.enumeration or end.items
        return replace(end, unit=unit, items=items)

    def _compare_units(self) -> None:
        """Remark outputs whose connector states another unit than the FMU; of inputs `value_conversion` does that."""
        for (component, name), stated in self._said.items():
            instance = self.instances[component]
            if name not in instance.variables or instance.variables[name].causality != "output":
                continue
            fmu = instance.unit(name)
            if fmu is not None and fmu.name != stated.name and not alike(instance.meant(stated, name) or stated, fmu):
                self.remarks.append(
                    f"the package says '{component}.{name}' is in {stated.name}, its FMU says {fmu.name}; the "
                    "package's word counts"
                )

    def connector(self, name: str) -> Connector:
        """A connector of the whole system."""
        return self._connectors[name]

    def unit_name(self, component: str, name: str) -> str | None:
        """Name of the unit of a component's variable."""
        package_unit = self._said.get((component, name))
        return package_unit.name if package_unit is not None else self.instances[component].unit_name(name)

    def unit_of(self, signal: Signal) -> str | None:
        """Name of a signal's unit."""
        if signal.component:
            return self.unit_name(signal.component, signal.name)
        type = self.connector(signal.name).type
        return type.unit.name if type is not None and type.unit is not None else None

    def units(self, signals: Iterable[Signal]) -> dict[str, str]:
        """Unit of every signal that has one, by address."""
        return {s.address: unit for s in signals if (unit := self.unit_of(s))}
