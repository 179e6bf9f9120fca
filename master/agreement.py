"""Inputs and outputs that agree at one point in time, where outputs depend on inputs at once (feed-through).

An output that is read after a step answers to the input that was held in that step. `refresh` hands over the present
inputs and reads again, in the order of what depends on what, for the outputs of which the FMU declares that they
depend on a connected input. Loops are swept until nothing changes, or solved by Newton's method.
"""

from __future__ import annotations

from collections.abc import Iterable
from graphlib import CycleError, TopologicalSorter

import numpy as np

from ..core.errors import CosimError, SimulationError
from ..ssp.network import End
from .engine.program import Cast, Program
from .engine.runner import Runner
from .loops import graph
from .slaves.base import REAL, TEXT
from .system import Link, System

MAX_SWEEPS = 100
SETTLED = 1e-9


class Agreement:
    """Visits of components: take what others give, read what follows from it."""

    def __init__(self, system: System, names: Iterable[str]):
        self.system, self.names = system, list(names)
        self.visits: dict[str, tuple[list[tuple[Link, Runner]], Runner, Runner]] = {}
        for name in dict.fromkeys(self.names):
            links = []
            for link in system.links:
                if link.target.component == name:
                    program = system.program()
                    system.pass_on(program, link)
                    links.append((link, Runner(program)))
            inputs, outputs = system.program(), system.program()
            inputs.set_inputs(system.slaves[name])
            outputs.get_outputs(system.slaves[name])
            self.visits[name] = links, Runner(inputs), Runner(outputs)

    def sweep(self) -> None:
        """Visit all components in turn."""
        for name in self.names:
            links, inputs, outputs = self.visits[name]
            for link, carry in links:
                if self.system.speaks(link):
                    carry.once()
            inputs.once()
            outputs.once()

    def settle(self, when: str) -> None:
        """Sweep until nothing changes; a loop that does not settle so is solved, or the error says which it is."""
        change = np.zeros(0)
        for _ in range(MAX_SWEEPS):
            before = self.system.board.reals.copy()
            self.sweep()
            change = relative_change(before, self.system.board.reals)
            if np.all(change <= SETTLED):
                return
        self.solve(change, when)

    def solve(self, change: np.ndarray, when: str) -> None:
        """Newton's method for the reals that go round; `change` is what the last sweep did to each slot."""
        from scipy.optimize import root

        system = self.system
        links = [
            (k, carry) for mine, _, _ in self.visits.values() for k, carry in mine
            if k.target.family == REAL and not k.cast.from_integer and k.source.component
        ]  # fmt: skip
        targets = np.concatenate([np.arange(k.target.place, k.target.place + k.target.size) for k, _ in links])
        names = {s.place + i: s.address for s in system.outputs.values() for i in range(s.size)}
        worst = max(names, key=lambda place: np.nan_to_num(change[place], nan=np.inf) if place < len(change) else 0.0)

        def left(x: np.ndarray) -> np.ndarray:
            system.board.reals[targets] = x
            for _, inputs, outputs in self.visits.values():
                inputs.once()
                outputs.once()
            for _, carry in links:
                carry.once()
            return np.nan_to_num(system.board.reals[targets] - x, nan=1e30, posinf=1e30, neginf=-1e30)

        start = np.nan_to_num(system.board.reals[targets], nan=0.0, posinf=0.0, neginf=0.0)
        start[np.abs(start) > 1e12] = 0.0
        found = root(left, start, tol=1e-12)
        rest = np.abs(left(found.x))
        if not np.all(rest <= 1e-8 * (1.0 + np.abs(found.x))):
            raise SimulationError(
                f"the algebraic loop {when} does not settle in {MAX_SWEEPS} sweeps, and Newton's method finds no "
                f"solution; '{names[worst]}' still changes by {change[worst]:g}"
            )


def relative_change(before: np.ndarray, now: np.ndarray) -> np.ndarray:
    """How far values have moved, relative to 1 + their size; NaN where they are not finite."""
    with np.errstate(invalid="ignore"):
        return np.where(now == before, 0.0, np.abs(now - before)) / (1.0 + np.abs(before))


def stale(system: System) -> tuple[list[str], bool]:
    """(components in the order in which to bring them up to date, whether some depend on each other in a loop)."""
    driven = {link.end for link in system.links if link.source.component}
    late = [
        end for end in system.outputs
        if any((end[0], name) in driven for name in system.slaves[end[0]].feed_through(end[1]) or ())
    ]  # fmt: skip
    edges: dict[End, set[End]] = graph(system, doubtful=False)
    try:
        order = [node for node in TopologicalSorter(edges).static_order() if node in late]
    except CycleError:
        members = {component for component, _ in late}
        return [name for name in system.order if name in members], True
    names: list[str] = []
    for component, _ in order:
        if not names or names[-1] != component:
            names.append(component)
    return names, False


def refresh(system: System, program: Program, loops_only: bool = False) -> None:
    """Write: outputs agree with the present inputs; the inputs that were held stay on the board, for the record.

    loops_only: do nothing where there is no algebraic loop.
    """
    names, loop = stale(system)
    if not names or (loops_only and not loop):
        return
    links = [k for k in system.links if k.target.component in names and k.target.family != TEXT]
    kept = [system.scratch(k.target.size) for k in links]
    for link, place in zip(links, kept, strict=True):
        program.cast(place, link.target.place, link.target.size, Cast())
    if loop:
        agreement = Agreement(system, names)

        def settle(t: float, h: float) -> int:
            try:
                agreement.settle(f"at t = {t + h:g} s")
            except CosimError as error:
                program.error = error
                return 3
            return 0

        program.python(settle)
    else:
        for name in names:
            for link in links:
                if link.target.component == name and system.speaks(link):
                    system.pass_on(program, link)
            program.set_inputs(system.slaves[name])
            program.get_outputs(system.slaves[name])
    for link, place in zip(links, kept, strict=True):
        program.cast(link.target.place, place, link.target.size, Cast())
