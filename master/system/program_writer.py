"""What steps of the whole system are written with: who is read, and what links carry into a program."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from ...ssp.flat_system import End
from ..engine.program import Program, ValueBuffer
from ..engine.values import REAL, TEXT
from ..slaves.base import FmuInstance
from .connections import Connections, SignalConnection
from .input_values import InputValues


class ProgramWriter:
    """Writes the exchange of values into programs of the engine."""

    def __init__(
        self, instances: Mapping[str, FmuInstance], connections: Connections, values: InputValues, buffer: ValueBuffer
    ):  # fmt: skip
        self.instances, self._connections, self._values, self.buffer = instances, connections, values, buffer
        self._all = list(instances.values())
        self._sources = {(link.source.component, link.source.name) for link in connections.links}
        self.watched: frozenset[End] | None = None
        """Outputs that are looked at from outside; None: all."""
        self.forks = False
        """Whether threads take steps that do not depend on each other."""

    def program(self) -> Program:
        """An empty program for this system."""
        return Program(self.buffer, self._all, self.forks)

    def links_to(self, name: str) -> list[SignalConnection]:
        """The links that carry something to a component."""
        return [link for link in self._connections.into(name) if self._values.has_value(link)]

    def levels(self, order: Iterable[str]) -> list[list[str]]:
        """Components that may step side by side, after those before them, with what they would get one by one.

        order: that in which they step one by one. One that takes from an earlier one comes after it; one that an
        earlier one takes from does not come before it, for that one takes what there was before the step.
        """
        level: dict[str, int] = {}
        levels: list[list[str]] = []
        takes: dict[str, list[str]] = {}
        for name in order:
            givers = [link.source.component for link in self._connections.into(name)]
            lowest = max((level[g] + 1 for g in givers if g in level), default=0)
            lowest = max([lowest, *(level[other] for other in takes.get(name, ()))])
            level[name] = lowest
            for giver in givers:
                takes.setdefault(giver, []).append(name)
            levels += [[] for _ in range(lowest + 1 - len(levels))]
            levels[lowest].append(name)
        return levels

    def is_continuous(self, link: SignalConnection) -> bool:
        """Whether a link carries a continuous real from an output, which may be carried on and averaged."""
        ends = (link.source, link.target)
        return bool(link.source.component) and all(
            s.family == REAL and self.instances[s.component].variables[s.name].variability in (None, "continuous")
            for s in ends
        )

    def is_averaged(self, link: SignalConnection) -> bool:
        """Whether what a link carries may be handed over as its mean over the step.

        Not so where another connected input is its rate (FMI: `derivative`): an FMU that is told how fast an input
        moves carries it on by itself, from what it is at the step's start.
        """
        if not self.is_continuous(link) or not link.target.component:
            return False
        instance = self.instances[link.target.component]
        names = instance.names_of(link.target.name)
        rates = (
            (instance.variables[name].derivative, other)
            for other in self.links_to(link.target.component)
            for name in instance.names_of(other.target.name)
        )
        return not any(of is not None and of.name in names and self.is_continuous(other) for of, other in rates)

    def exchange(self, program: Program, names: Iterable[str], instead: dict[int, int] | None = None) -> None:
        """Bring the inputs of these instances up to date. `instead` gives the slots that stand for some sources."""
        for name in names:
            for link in self.links_to(name):
                self.pass_on(program, link, instead)

    def pass_on(self, program: Program, link: SignalConnection, instead: dict[int, int] | None = None) -> None:
        """One link."""
        source = link.source.place
        if link.target.family == TEXT:
            for k in range(link.target.size):
                program.copy_text(link.target.place + k, source + k)
            return
        if instead:
            source = instead.get(source, source)
        program.convert(link.target.place, source, link.target.size, link.conversion, link.flat_connection.where)

    def show(self, program: Program) -> None:
        """Bring the outputs of the whole system up to date."""
        for link in self._connections.shown:
            self.pass_on(program, link)

    def is_read(self, end: End) -> bool:
        """Whether somebody reads an output: another component, or who looks on."""
        return self.watched is None or end in self.watched or end in self._sources
