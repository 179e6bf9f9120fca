"""Gauss-Seidel with nearly energy-preserving coupling elements (Sadjina & Pedersen 2019).

What an input was held at differs, in the mean over a step, from what the output did in that step. The difference is
handed over later: a correction is added to the held value. A component that comes after its source knows the output at
both ends of the step; there the mean itself is held.
"""

from __future__ import annotations

from ..engine.program import Program
from ..slaves.base import REAL
from ..system import Link, System


def write(system: System, program: Program) -> None:
    """Write the macro step."""
    place = {name: i for i, name in enumerate(system.order)}
    for name in system.order:
        slave = system.slaves[name]
        for link in system.links:
            if link.target.component != name or not system.speaks(link):
                continue
            if link.source.family != REAL or not link.source.component:
                system.pass_on(program, link)
            elif place[link.source.component] < place[name]:
                _mean(system, program, link)
            else:
                _corrected(system, program, link)
        program.set_inputs(slave)
        program.do_step(slave)
        program.get_outputs(slave)


def _mean(system: System, program: Program, link: Link) -> None:
    """Hold the mean of the output over this step, which its component has taken already."""
    size, place = link.source.size, link.source.place
    before, held = system.scratch(size), system.scratch(size)
    for k in range(size):
        system.board.reals[before + k] = system.board.reals[place + k]
        program.mix(held + k, [(0.5, place + k), (0.5, before + k)])
        program.mix(before + k, [(1.0, place + k)])
    system.pass_on(program, link, {place: held})


def _corrected(system: System, program: Program, link: Link) -> None:
    """Hold the output and what the last step's held value lacked of the output's mean."""
    size, place = link.source.size, link.source.place
    before, held = system.scratch(size), system.scratch(size)
    for k in range(size):
        system.board.reals[before + k] = system.board.reals[place + k]
        program.mix(held + k, [(1.5, place + k), (-0.5, before + k)])
        program.mix(before + k, [(1.0, place + k)])
    system.pass_on(program, link, {place: held})
