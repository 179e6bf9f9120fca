"""Initialisation: start values, parameters that FMUs compute for each other, and inputs and outputs that agree.

The order comes from the dependencies that the FMUs declare. Where these form a loop, sweeps are repeated until nothing
changes; a loop that does not settle so is solved by Newton's method, and refused if that fails too.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from graphlib import CycleError, TopologicalSorter

import numpy as np

from ..core.errors import PackageError, SimulationError
from ..ssp.network import End, Wire
from .engine.runner import Runner
from .setup import Value
from .slaves.base import REAL
from .system import Link, System
from .wiring import converted

MAX_SWEEPS = 100
SETTLED = 1e-9


class Initialiser:
    """The initialisation of a system; may be used again after a reset."""

    def __init__(self, system: System):
        self.system = system
        self._set, self._get = {}, {}
        for name, slave in system.slaves.items():
            for verb, made in (("set_inputs", self._set), ("get_outputs", self._get)):
                program = system.program()
                getattr(program, verb)(slave)
                made[name] = Runner(program)
        self._links: dict[str, list[tuple[Link, Runner]]] = {name: [] for name in system.slaves}
        for link in system.links:
            program = system.program()
            system.pass_on(program, link)
            self._links[link.target.component].append((link, Runner(program)))
        self._early = self._early_order()
        self._visits = self._visit_order()
        self._seen: set[str] = set()

    def __call__(self, values: Sequence[Value], start: float, stop: float) -> None:
        """Set start values, initialise all slaves and leave all signals in agreement at the start."""
        system = self.system
        for v in values:
            if v.component == "":
                system.put(system.own_inputs[v.variable], v.value)
                continue
            slave = system.slaves[v.component]
            try:
                slave.set_start(v.variable, v.value)
            except SimulationError as error:
                raise SimulationError(f"{v.where}: {error}") from None
            if slave.variables[v.variable].causality == "input":
                system.set_input(v.component, v.variable, v.value)
        given = {(v.component, v.variable) for v in values}
        for component, name in system.inputs:
            slave = system.slaves[component]
            if (component, name) not in given and slave.start(name) is None:
                system.set_input(component, name, slave.get(name))
        for name in self._early:
            for wire in system.early:
                if wire.end[0] == name:
                    self._compute(wire)
            system.slaves[name].enter_initialisation(start, stop)
        self._propagate()
        for slave in system.slaves.values():
            if slave.version != "1.0":
                slave.exit_initialisation()
        self.sweep(system.order)

    # parameters that are computed

    def _early_order(self) -> list[str]:
        graph: dict[str, set[str]] = {name: set() for name in self.system.slaves}
        for wire in self.system.early:
            graph[wire.end[0]].add(wire.start[0])
        try:
            return list(TopologicalSorter(graph).static_order())
        except CycleError as error:
            raise PackageError(f"calculated parameters depend on each other: {' -> '.join(error.args[1])}") from None

    def _compute(self, wire: Wire) -> None:
        source, target = self.system.slaves[wire.start[0]], self.system.slaves[wire.end[0]]
        given = self.system.quantity(wire.start, wire.unit, wire.enumeration)
        value = converted(source.get(wire.start[1]), given, wire.hops, self.system.quantity(wire.end), wire.where)
        target.set_start(wire.end[1], target.checked(wire.end[1], value, wire.where))

    # inputs and outputs

    def _propagate(self) -> None:
        self._seen.clear()
        if self._visits is not None:
            self.sweep([*self._visits, *self.system.order])
            return
        reals = self.system.board.reals
        for _ in range(MAX_SWEEPS):
            before = reals.copy()
            self.sweep(self.system.order)
            with np.errstate(invalid="ignore"):
                change = np.where(reals == before, 0.0, np.abs(reals - before))
            if np.all(change <= SETTLED * (1.0 + np.abs(before))):
                return
        self._newton(change / (1.0 + np.abs(before)))

    def sweep(self, components: Iterable[str]) -> None:
        """Visit the components in turn: take the outputs that others have given as inputs, read the own outputs."""
        for name in components:
            slave = self.system.slaves[name]
            for link, carry in self._links[name]:
                if link.source.component in self._seen or (link.source.component == "" and self.system.speaks(link)):
                    carry.once()
            self._set[name].once()
            if slave.version == "1.0" and slave._state == "initialising":
                slave.exit_initialisation()
            self._seen.add(name)
            self._get[name].once()

    def _newton(self, change: np.ndarray) -> None:
        """Solve for the reals that go round in loops."""
        from scipy.optimize import root

        system = self.system
        links = [
            (k, carry) for mine in self._links.values() for k, carry in mine
            if k.target.family == REAL and not k.cast.from_integer
        ]  # fmt: skip
        targets = np.concatenate([np.arange(k.target.place, k.target.place + k.target.size) for k, _ in links])
        names = {s.place + i: s.address for s in system.outputs.values() for i in range(s.size)}
        worst = max(names, key=lambda place: np.nan_to_num(change[place], nan=np.inf) if place < len(change) else 0.0)

        def left(x: np.ndarray) -> np.ndarray:
            system.board.reals[targets] = x
            for name in system.order:
                self._set[name].once()
                self._get[name].once()
            for _, carry in links:
                carry.once()
            return np.nan_to_num(system.board.reals[targets] - x, nan=1e30, posinf=1e30, neginf=-1e30)

        start = np.nan_to_num(system.board.reals[targets], nan=0.0, posinf=0.0, neginf=0.0)
        start[np.abs(start) > 1e12] = 0.0
        found = root(left, start, tol=1e-12)
        rest = np.abs(left(found.x))
        if not np.all(rest <= 1e-8 * (1.0 + np.abs(found.x))):
            raise SimulationError(
                f"the algebraic loop at the start does not settle in {MAX_SWEEPS} sweeps, and Newton's method finds no "
                f"solution; '{names[worst]}' still changes by {change[worst]:g}"
            )

    def _visit_order(self) -> list[str] | None:
        """Components to visit in turn so that each output is read after the inputs it depends on; None in a loop."""
        system = self.system
        graph: dict[End, set[End]] = {}
        for link in system.links:
            if link.start[0] == "":
                continue
            graph.setdefault(link.end, set()).add(link.start)
            graph.setdefault(link.start, set()).update(self._depends(*link.start))
        try:
            order = list(TopologicalSorter(graph).static_order())
        except CycleError:
            return None
        visits: list[str] = []
        for component, name in order:
            if (component, name) in system.outputs and (not visits or visits[-1] != component):
                visits.append(component)
        return visits

    def _depends(self, component: str, output: str) -> set[End]:
        slave = self.system.slaves[component]
        connected = {link.end for link in self.system.links if link.end[0] == component}
        for unknown in slave.description.initialUnknowns:
            if unknown.variable is not None and unknown.variable.name == output:
                if unknown.dependencies is None:
                    return connected
                return {(component, v.name) for v in unknown.dependencies} & connected
        return connected

