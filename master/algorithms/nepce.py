"""Gauss-Seidel with nearly energy-preserving coupling elements (after Sadjina & Pedersen 2019).

What an input is held at differs, in the mean over a step, from what the output does in that step. A component that
comes after its source knows the output at both ends of the step: the mean itself is held. For one that comes before,
half of the output's last change is added, which is what holding its value lacked in the last step. An input that a
component carries on by itself is what it was at the step's start (`ProgramWriter.is_averaged`).

An output that answers to inputs at once is read again after its component's step, with inputs as they are at the end
of the step: those of sources that have not stepped yet lie on the straight line through their last two values.
"""

from __future__ import annotations

from ..coupling.loop_solver import driven_at_end, outdated_components, refresh, refresh_in_order
from ..engine.program import Program, SlotConversion
from ..system.system import System
from ._history import END, MIDDLE, carry_on
from .method import Method


def write(system: System, program: Program) -> None:
    """Write the macro step."""
    order = {name: i for i, name in enumerate(system.order)}
    outdated = outdated_components(system)[0]
    driven = driven_at_end(system, program, outdated)
    start: dict[int, int] = {}  # slots of outputs as they are at the step's start
    middle: dict[int, int] = {}  # and as they are foretold for its middle and its end
    final: dict[int, int] = {}
    lines = {
        name: [link for link in system.writer.links_to(name) if system.writer.is_continuous(link)] for name in order
    }
    for name in order:
        for source in (link.source for link in lines[name]):
            place, size = source.place, source.size
            if order[source.component] >= order[name]:
                if place not in middle:
                    middle[place], final[place] = carry_on(system, program, source, MIDDLE, END)
            elif place not in start:
                start[place] = system.layout.scratch(size)
                program.convert(start[place], place, size, SlotConversion())

    def hand_over(name: str) -> dict[int, int]:
        """Write what a component holds in the step; slots that stand for some of its sources at the step's end."""
        held, at_start, foretold = {}, {}, dict(driven)
        for source in dict.fromkeys(link.source for link in lines[name]):
            place = source.place
            if order[source.component] >= order[name]:
                held[place], foretold[place] = middle[place], final[place]
                continue
            at_start[place] = start[place]
            held[place] = system.layout.scratch(source.size)
            for k in range(source.size):
                program.mix(held[place] + k, [(0.5, place + k), (0.5, start[place] + k)])
        for link in system.writer.links_to(name):
            instead = held if system.writer.is_averaged(link) else at_start
            system.writer.pass_on(program, link, instead if link in lines[name] else None)
        return foretold

    at_its_end: dict[str, dict[int, int]] = {}  # what inputs are at the end of the step, where that is foretold
    for names in system.writer.levels(order):
        for name in names:
            at_its_end[name] = hand_over(name)
        program.advance([system.instances[name] for name in names])
        for name in (n for n in names if n in outdated):
            links = [
                link for link in system.writer.links_to(name) if link in lines[name] or link.source.place in driven
            ]
            refresh_in_order(system, program, [name], links, at_its_end[name])
    refresh(system, program, driven)


METHOD = Method(write, order=2)
