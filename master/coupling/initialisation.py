"""Initialisation: start values, parameters that FMUs compute for each other, and inputs and outputs that agree.

The order comes from the dependencies that the FMUs declare. Where these form a loop, sweeps are repeated until nothing
changes; a loop that does not settle so is solved by Newton's method, and refused if that fails too.

FMI 2.0 lets an FMU refuse to be read between an input and the step that follows; some refuse that in the initialisation
too. One that does is told apart (`FmuVariables.readable`), and all begin anew.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from graphlib import CycleError

from ...core.errors import PackageError, SimulationError
from ...ssp.flat_system import End, FlatConnection
from ..engine.runner import Runner
from ..engine.values import TEXT, Signal
from ..slaves.base import FmuInstance
from ..slaves.variables import AFTER_STEPS, ALWAYS, BEFORE_INPUTS, INITIALISED
from ..system.start_values import StartValue
from ..system.strongly_connected import in_order
from ..system.system import System
from ..system.value_conversion import converted
from .algebraic_loops import ANY
from .loop_solver import AlgebraicLoop, reader, visit_order


def parameter_order(system: System) -> list[str]:
    """Components in an order in which each gets the parameters that others calculate; `PackageError` for a circle."""
    graph: dict[str, set[str]] = {name: set() for name in system.instances}
    for flat_connection in system.connections.parameter_connections:
        graph[flat_connection.end[0]].add(flat_connection.start[0])
    try:
        return in_order(graph)
    except CycleError as error:
        raise PackageError(f"calculated parameters depend on each other: {' -> '.join(error.args[1])}") from None


@dataclass
class _Refusal(Exception):
    """An FMU does not let itself be read where that was tried."""

    instance: FmuInstance
    error: SimulationError


class Initialiser:
    """The initialisation of a system; may be used again after a reset."""

    def __init__(self, system: System):
        self.system = system
        self._order = list(system.order)  # that of the system changes by what is found out, and later runs are alike
        self._loop = AlgebraicLoop(system, self._order)
        self._parameter_order = parameter_order(system)
        self._computed: dict[str, list[FlatConnection]] = {name: [] for name in self._parameter_order}
        for flat_connection in system.connections.parameter_connections:
            self._computed[flat_connection.end[0]].append(flat_connection)
        self._visits = self._visit_order()
        self._seen: set[str] = set()
        self.remarks: list[str] = []
        """What is worth telling of the last initialisation."""
        self.brought: dict[End, object] = {}
        """What connections have brought to parameters in it."""
        shown = system.writer.program()
        system.writer.show(shown)
        self._shown = Runner(shown)

    def __call__(self, values: Sequence[StartValue], start: float, stop: float) -> None:
        """Set start values, initialise all instances, and leave inputs and outputs consistent at the start time."""
        system = self.system
        buffer, inputs_without_start = system.buffer, dict(system.values.inputs_without_start)
        reals, texts = buffer.reals.copy(), list(buffer.texts)
        while True:
            self.remarks.clear()
            self._loop.forget()
            try:
                self._initialise(values, start, stop)
                break
            except _Refusal as refused:
                self._begin_anew(refused)
                buffer.reals[:], buffer.texts[:], system.values.inputs_without_start = (
                    reals,
                    texts,
                    dict(inputs_without_start),
                )
        self.remarks += [
            _late_remark(instance) for instance in system.instances.values() if instance.readable != ALWAYS
        ]
        system.values.show_start_values()
        self.show()

    def _begin_anew(self, refused: _Refusal) -> None:
        """All FMUs as before the initialisation, the one that has refused to be read marked."""
        refused.instance.readable += 1
        try:
            for instance in self.system.instances.values():
                instance.reset()
        except SimulationError:
            raise refused.error from None
        self._loop = AlgebraicLoop(self.system, self._order)

    def _initialise(self, values: Sequence[StartValue], start: float, stop: float) -> None:
        system = self.system
        system.buffer.ended[:] = 0
        system.stop = stop
        for v in values:
            if v.component == "":
                system.values.put(system.system_inputs[v.variable], v.value)
                continue
            instance = system.instances[v.component]
            try:
                instance.set_start(v.variable, v.value)
            except SimulationError as error:
                raise SimulationError(f"{v.where}: {error}") from None
            if instance.variables[v.variable].causality == "input":
                system.values.set_input(v.component, v.variable, v.value)
                system.values.inputs_without_start.pop(system.inputs[v.component, v.variable].home, None)
        for name in self._parameter_order:
            for flat_connection in self._computed[name]:
                self._compute(flat_connection)
            system.instances[name].enter_initialisation(start, stop)
        for signal in system.values.inputs_without_start.values():
            system.values.put(signal, self._own_value(signal))
        self._propagate()
        for instance in system.instances.values():
            if instance.version != "1.0":
                instance.exit_initialisation()
        self._read_first(initialised=True)
        self.sweep(self._order)

    def show(self) -> None:
        """Bring the outputs of the whole system up to date."""
        self._shown.once()

    def _own_value(self, signal: Signal) -> object:
        """What an FMU itself has for an input whose start value is not given."""
        try:
            return self.system.instances[signal.component].get(signal.name)
        except SimulationError as error:
            instance = self.system.instances[signal.component]
            if instance.is_lost:
                raise
            if instance.version != "1.0" and instance.readable < AFTER_STEPS:
                raise _Refusal(instance, error) from None
            return (b"" if signal.type == "Binary" else "" if signal.family == TEXT else 0,) * signal.size

    # parameters that are computed

    def _compute(self, flat_connection: FlatConnection) -> None:
        source, target = self.system.instances[flat_connection.start[0]], self.system.instances[flat_connection.end[0]]
        if source.version == "1.0" and source._state == "initialising":  # which calculates in fmiInitializeSlave
            source.exit_initialisation()
        source_quantity = self.system.quantities.quantity(
            flat_connection.start, flat_connection.unit, flat_connection.enumeration
        )
        target_quantity = self.system.quantities.quantity(flat_connection.end)
        value = converted(
            source.get(flat_connection.start[1]),
            source_quantity,
            flat_connection.hops,
            target_quantity,
            flat_connection.where,
        )
        self.brought[flat_connection.end] = checked = target.checked(
            flat_connection.end[1], value, flat_connection.where
        )
        target.set_start(flat_connection.end[1], checked)

    # inputs and outputs

    def _read_first(self, initialised: bool) -> None:
        """Read what lets itself be read only before its inputs are set; what does not even that keeps what its FMU
        declares as its start."""
        for name, instance in self.system.instances.items():
            readable_now = (BEFORE_INPUTS, INITIALISED) if initialised else (BEFORE_INPUTS,)
            if instance.readable in readable_now and instance.version != "1.0":
                self._read(instance, reader(self.system, name))
            elif instance.readable == AFTER_STEPS:
                for signal in instance.outputs:
                    if (value := instance.start(signal.name)) is not None:
                        self.system.values.put(signal, value)

    def _read(self, instance: FmuInstance, outputs: Runner) -> None:
        try:
            outputs.once()
        except SimulationError as error:
            if instance.is_lost or instance.readable == AFTER_STEPS:
                raise
            raise _Refusal(instance, error) from None

    def _propagate(self) -> None:
        self._seen.clear()
        self._read_first(initialised=False)
        if self._visits is not None:
            self.sweep([*self._visits, *self._order])
            return
        near = self._loop.inputs()
        self.sweep(self._order)  # after this one all have been seen
        if (remark := self._loop.solve(" at the start", near)) is not None:
            self.remarks.append(remark)

    def sweep(self, components: Iterable[str]) -> None:
        """Visit the components in turn: take the outputs that others have given as inputs, read the own outputs."""
        for name in components:
            instance = self.system.instances[name]
            links, inputs, outputs = self._loop.visits[name]
            for link, carry in links:
                giver = link.source.component
                if giver in self._seen or (giver == "" and self.system.values.has_value(link)):
                    carry.once()
            inputs.once()
            if instance.version == "1.0" and instance._state == "initialising":
                instance.exit_initialisation()
                if instance.readable in (BEFORE_INPUTS, INITIALISED):
                    outputs = reader(self.system, name)
            self._seen.add(name)
            self._read(instance, outputs)

    def _visit_order(self) -> list[str] | None:
        """Components to visit in turn so that each output is read after the inputs it depends on; None in a loop."""
        system = self.system
        graph: dict[End, set[End]] = {}
        declared: dict[str, dict[str, set[End]]] = {}
        for link in system.links:
            if link.start[0] == "":
                continue
            graph.setdefault(link.end, set()).add(link.start)
            component, output = link.start
            if component not in declared:
                instance, connected = (
                    system.instances[component],
                    {link.end for link in system.connections.into(component)},
                )
                declared[component] = {
                    unknown: {(component, name) for name in known} & connected
                    for unknown, known in instance.dependencies(instance.description.initialUnknowns).items()
                }
                graph[component, ANY] = connected
            graph.setdefault(link.start, set()).update(declared[component].get(output, {(component, ANY)}))
        try:
            order = in_order(graph)
        except CycleError:
            return None
        return visit_order(node for node in order if node in system.outputs)


def _late_remark(instance: FmuInstance) -> str:
    """What to say of an FMU that does not let itself be read whenever something is set."""
    starts = "from before its inputs were set"
    if instance.readable == AFTER_STEPS:
        starts = "what its modelDescription.xml has as their starts, else 0"
    return (
        f"component '{instance.name}' refuses getXXX between setting an input and the next doStep: at the start its "
        f"outputs are {starts}, and one with direct feedthrough is a step late"
    )
