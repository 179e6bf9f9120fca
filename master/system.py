"""The system of slaves: who is connected to whom, in which order, and one array that holds every signal.

`read` holds all outputs, `given` all inputs, each slave's in a row, so that a record of a communication point is two
copies and an exchange a few assignments.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from graphlib import CycleError, TopologicalSorter

import numpy as np

from ..core.errors import PackageError, SimulationError
from ..ssp.model import SystemStructure
from .slave import Signal, Slave

_KINDS = ("Real", "Integer", "Boolean")
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
        self._check_connections()
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
        self.order = self._component_order()
        self.sequence = [(slaves[name], self._exchange_for([name])) for name in self.order]
        self.exchange_all = self._exchange_for(self.order)

    def _check_connections(self) -> None:
        driven: dict[tuple[str, str], int] = {}
        for c in self.structure.connections:
            where = f"SystemStructure.ssd, line {c.line}"
            for (component, connector), causality in ((c.start, "output"), (c.end, "input")):
                if component not in self.slaves:
                    raise PackageError(f"{where}: there is no component '{component}'")
                variable = self.slaves[component].variables.get(connector)
                if variable is None:
                    raise PackageError(f"{where}: component '{component}' has no variable '{connector}'")
                if variable.causality != causality:
                    raise PackageError(
                        f"{where}: '{component}.{connector}' is not an {causality} but has causality "
                        f"'{variable.causality}'"
                    )
                if variable.type not in _KINDS:
                    raise PackageError(f"{where}: '{component}.{connector}': type {variable.type} is not supported yet")
            if c.end in driven:
                raise PackageError(
                    f"{where}: input '{'.'.join(c.end)}' is already driven by the connection in line {driven[c.end]}"
                )
            driven[c.end] = c.line

    def _signals(self, causality: str) -> dict[str, list[Signal]]:
        place = 0
        signals: dict[str, list[Signal]] = {}
        for name, slave in self.slaves.items():
            chosen = [v for v in slave.description.modelVariables if v.causality == causality and v.type in _KINDS]
            signals[name] = []
            for kind in _KINDS:
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
            variable = self.slaves[component].variables[name]
            unit = variable.unit or (variable.declaredType.unit if variable.declaredType is not None else None)
            if unit:
                found[f"{component}.{name}"] = unit
        return found

    def set_input(self, component: str, name: str, value: float) -> None:
        """Set the value that an input has until a connection overwrites it."""
        self.given[self.inputs[component, name].place] = float(value)

    def _component_order(self) -> list[str]:
        """Order of the data flow; where components form a loop, the first one in the package's order starts."""
        waiting = list(self.slaves)
        sources = {name: {link.start[0] for link in self.links if link.end[0] == name} - {name} for name in waiting}
        order: list[str] = []
        while waiting:
            free = [name for name in waiting if not sources[name] & set(waiting)]
            order.append(free[0] if free else waiting[0])
            waiting.remove(order[-1])
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
        waves = self._waves()
        if waves is not None:
            for wave in waves:
                self.sweep(wave)
            self.sweep(self.order)
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
        """Visit the components in turn: take the newest outputs of others as inputs, read the own outputs."""
        for name in components:
            for link in self.links:
                if link.end[0] == name:
                    self.given[link.target] = self.read[link.source]
            self.slaves[name].set_inputs()
            self.slaves[name].get_outputs()

    def _waves(self) -> list[list[str]] | None:
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
        return [[component] for component in visits]

    def _initial_dependencies(self, component: str, output: str) -> set[tuple[str, str]]:
        slave = self.slaves[component]
        connected = {link.end for link in self.links if link.end[0] == component}
        for unknown in slave.description.initialUnknowns:
            if unknown.variable.name == output:
                if unknown.dependencies is None:
                    return connected
                return {(component, v.name) for v in unknown.dependencies} & connected
        return connected
