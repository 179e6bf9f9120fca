"""The system of slaves: who is connected to whom, in which order, and one array that holds every signal.

`read` holds all outputs, `given` all inputs, each slave's in a row, so that a record of a communication point is two
copies and an exchange a few assignments.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from graphlib import CycleError, TopologicalSorter

import numpy as np

from ..core.errors import SimulationError
from ..ssp.model import SystemStructure
from .slave import Signal, Slave

KINDS = ("Real", "Integer", "Boolean")
MAX_SWEEPS = 100
SETTLED = 1e-9


@dataclass(frozen=True)
class Link:
    """A connection as places: outputs' array -> inputs' array."""

    source: int
    target: int
    start: tuple[str, str]
    end: tuple[str, str]


class System:
    """Slaves, signals and connections of an SSP system, ready to be initialised and stepped."""

    def __init__(self, structure: SystemStructure, slaves: dict[str, Slave]):
        self.structure = structure
        self.slaves = slaves
        inputs, outputs = self._signals("input"), self._signals("output")
        self.given = np.zeros(sum(map(len, inputs.values())))
        self.read = np.zeros(sum(map(len, outputs.values())))
        self.inputs = {(c, s.name): s for c, signals in inputs.items() for s in signals}
        self.outputs = {(c, s.name): s for c, signals in outputs.items() for s in signals}
        self.reset_inputs()
        self.links = [
            Link(self.outputs[c.start].place, self.inputs[c.end].place, c.start, c.end) for c in structure.connections
        ]
        for name, slave in slaves.items():
            slave.lay_out(inputs[name], outputs[name], self.given, self.read)
        self._seen: set[str] = set()
        """Components whose outputs have been read since the initialisation began."""
        self.order = self._component_order()
        self.sequence = [(slaves[name], self._exchange_for([name])) for name in self.order]
        self.exchange_all = self._exchange_for(self.order)

    def _signals(self, causality: str) -> dict[str, list[Signal]]:
        place = 0
        signals: dict[str, list[Signal]] = {}
        for name, slave in self.slaves.items():
            chosen = [v for v in slave.description.modelVariables if v.causality == causality and v.type in KINDS]
            signals[name] = []
            for kind in KINDS:
                for variable in chosen:
                    if variable.type == kind:
                        signals[name].append(Signal(variable.name, variable.valueReference, kind, place))
                        place += 1
        return signals

    def reset_inputs(self) -> None:
        """Give every input its start value from the model description."""
        for (component, name), signal in self.inputs.items():
            start = self.slaves[component].variables[name].start
            if signal.kind == "Boolean":
                self.given[signal.place] = float(str(start).lower() in ("true", "1"))
            else:
                self.given[signal.place] = float(start or 0.0)

    def units(self) -> dict[str, str]:
        """Unit of every signal that has one, by component.variable."""
        found = {}
        for component, name in (*self.outputs, *self.inputs):
            if unit := self.slaves[component].unit(name):
                found[f"{component}.{name}"] = unit
        return found

    def set_input(self, component: str, name: str, value: float) -> None:
        """Set the value that an input has until a connection overwrites it."""
        self.given[self.inputs[component, name].place] = float(value)

    def _component_order(self) -> list[str]:
        """Order of the data flow; within a loop, and where nothing decides, that of the package."""
        names = list(self.slaves)
        reaches = {name: {link.end[0] for link in self.links if link.start[0] == name} for name in names}
        for via in names:
            for name in names:
                if via in reaches[name]:
                    reaches[name] |= reaches[via]
        order: list[str] = []
        while len(order) < len(names):
            waiting = [name for name in names if name not in order]
            # free: whatever still waits upstream of it is in one loop with it
            order.append(
                next(n for n in waiting if all(m in reaches[n] for m in waiting if m != n and n in reaches[m]))
            )
        return order

    def _exchange_for(self, components: Iterable[str]) -> Callable[[], None]:
        links = [link for name in components for link in self.links if link.end[0] == name]
        read, given = self.read, self.given
        if len(links) <= 4:
            pairs = [(link.target, link.source) for link in links]

            def few() -> None:
                for target, source in pairs:
                    given[target] = read[source]

            return few
        targets = np.array([link.target for link in links])
        sources = np.array([link.source for link in links])

        def many() -> None:
            given[targets] = read[sources]

        return many

    # initialisation

    def propagate(self) -> None:
        """Bring all outputs and inputs to agree in initialisation mode, in the order in which the data flow.

        The order comes from the dependencies that the FMUs declare. Where these form a loop, sweeps are repeated until
        nothing changes; a loop that does not settle is an error.
        """
        self._seen.clear()
        visits = self._visits()
        if visits is not None:
            self.sweep([*visits, *self.order])
            return
        for _ in range(MAX_SWEEPS):
            before = self.read.copy()
            self.sweep(self.order)
            change = np.abs(self.read - before)
            if np.all(change <= SETTLED * (1.0 + np.abs(before))):
                return
        worst = int(np.argmax(change / (1.0 + np.abs(before))))
        names = {signal.place: f"{c}.{n}" for (c, n), signal in self.outputs.items()}
        raise SimulationError(
            f"the algebraic loop at the start does not settle in {MAX_SWEEPS} sweeps; '{names[worst]}' still changes "
            f"by {change[worst]:g}"
        )

    def sweep(self, components: Iterable[str]) -> None:
        """Visit the components in turn: take the outputs that others have given as inputs, read the own outputs."""
        for name in components:
            for link in self.links:
                if link.end[0] == name and link.start[0] in self._seen:
                    self.given[link.target] = self.read[link.source]
            self._seen.add(name)
            self.slaves[name].set_inputs()
            self.slaves[name].get_outputs()

    def _visits(self) -> list[str] | None:
        """Components to visit in turn so that each output is read after the inputs it depends on; None in a loop."""
        graph: dict[tuple[str, str], set[tuple[str, str]]] = {}
        for link in self.links:
            graph.setdefault(link.end, set()).add(link.start)
            graph.setdefault(link.start, set()).update(self._initial_dependencies(*link.start))
        try:
            order = list(TopologicalSorter(graph).static_order())
        except CycleError:
            return None
        visits: list[str] = []
        for component, name in order:
            if (component, name) in self.outputs and (not visits or visits[-1] != component):
                visits.append(component)
        return visits

    def _initial_dependencies(self, component: str, output: str) -> set[tuple[str, str]]:
        slave = self.slaves[component]
        connected = {link.end for link in self.links if link.end[0] == component}
        for unknown in slave.description.initialUnknowns:
            if unknown.variable.name == output:
                if unknown.dependencies is None:
                    return connected
                return {(component, v.name) for v in unknown.dependencies} & connected
        return connected
