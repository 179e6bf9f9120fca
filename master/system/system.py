"""The system of instances: where every signal lies, who is connected to whom, and in which order data flow."""

from __future__ import annotations

from collections.abc import Sequence

from ...ssp.flat_system import End, FlatSystem
from ..engine.values import TEXT, Signal
from ..slaves.base import FmuInstance
from .connections import Connections
from .execution_order import component_order
from .findings import Findings
from .input_values import InputValues
from .layout import SignalLayout
from .program_writer import ProgramWriter
from .quantities import Quantities


class System:
    """The instances of a flat system, their signals and connections; built before any FMU is loaded."""

    def __init__(
        self, network: FlatSystem, instances: dict[str, FmuInstance], findings: Findings | None = None,
        recorded: Sequence[End] = (),
    ):  # fmt: skip
        """Raises `PackageError` for a connection that does not fit, unless the findings collect what is wrong.

        recorded: variables that are read like outputs, for somebody wants to see them.
        """
        self.network, self.instances = network, instances
        self.remarks: list[str] = []
        self.layout = SignalLayout()
        to_record: dict[str, set[str]] = {name: set() for name in instances}
        for component, name in (
            *(flat_connection.start for flat_connection in (*network.flat_connections, *network.outputs)),
            *recorded,
        ):
            if component in to_record:
                to_record[component].add(name)
        for name, instance in instances.items():
            self.layout.lay_out(instance, to_record[name])
        self.quantities = quantities = Quantities(network, instances, self.remarks)
        self.system_inputs = {
            name: self.layout.system_input(name, quantities.input_quantity(name), network, instances)
            for name in network.inputs
        }
        """The inputs of the whole system."""
        self.connections = Connections(
            network, instances, self.layout, quantities, self.system_inputs, findings or Findings(), self.remarks
        )
        self.inputs, self.outputs = self.connections.inputs, self.connections.outputs
        self.system_outputs, self.links = self.connections.system_outputs, self.connections.links
        self._hand_over_texts()
        ends = [link.target for link in (*self.links, *self.connections.shown)]
        self.layout.make_buffer(ends, (*self.inputs.values(), *self.system_inputs.values()))
        self.buffer = self.layout.buffer
        self.stop = float("inf")
        """The end of the run that the FMUs have been told [s]."""
        self.order = component_order(instances, self.links)
        self.values = InputValues(instances, self.connections, quantities, self.buffer)
        self.writer = ProgramWriter(instances, self.connections, self.values, self.buffer)

    def _hand_over_texts(self) -> None:
        """Texts at ends of connections are exchanged at every step."""
        for link in (*self.links, *self.connections.shown):
            for signal in (link.source, link.target):
                if signal.family == TEXT and signal.component:
                    self.instances[signal.component].texts.add(signal.name)

    @property
    def signals(self) -> list[Signal]:
        """All of them."""
        return [
            *self.outputs.values(), *self.inputs.values(), *self.system_inputs.values(), *self.system_outputs.values()
        ]  # fmt: skip

    def units(self) -> dict[str, str]:
        """Unit of every signal that has one, by address."""
        return self.quantities.units(self.signals)
