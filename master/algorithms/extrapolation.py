"""Jacobi with inputs that are carried on: a straight line through the last two values, taken in the middle of the step.

For an input that is held, the middle is where a straight line has its mean, so what is handed over in a step is right
to second order. The first step holds what is there.
"""

from __future__ import annotations

from ..engine.program import Program
from ..slaves.base import REAL
from ..system import System


def sources(system: System) -> dict[int, int]:
    """First slots and sizes of the real outputs that drive something."""
    found = {}
    for link in system.links:
        if link.source.family == REAL and link.source.component:
            found[link.source.place] = link.source.size
    return found


def predict(system: System, program: Program) -> dict[int, int]:
    """Write the prediction of every driving output; the slots where it lies, by the slot of the output."""
    instead = {}
    for place, size in sources(system).items():
        before, ahead = system.scratch(size), system.scratch(size)
        for k in range(size):
            system.board.reals[before + k] = system.board.reals[place + k]
            program.mix(ahead + k, [(1.5, place + k), (-0.5, before + k)])
            program.mix(before + k, [(1.0, place + k)])
        instead[place] = ahead
    return instead


def write(system: System, program: Program) -> None:
    """Write the macro step."""
    slaves = [system.slaves[name] for name in system.order]
    instead = predict(system, program)
    system.exchange(program, system.order, instead)
    for slave in slaves:
        program.set_inputs(slave)
    for slave in slaves:
        program.do_step(slave)
    for slave in slaves:
        program.get_outputs(slave)
