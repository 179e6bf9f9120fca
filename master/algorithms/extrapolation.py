"""Jacobi with inputs that are carried on along the straight line through the last two values.

An FMU that takes slopes of its inputs (FMI 1.0 and 2.0, canInterpolateInputs) gets value and slope. Any other gets the
line's value in the middle of the step: for an input that is held, the middle is where a straight line has its mean, so
what is handed over in a step is right to second order. The first step holds what is there.
"""

from __future__ import annotations

from ..coupling.loop_solver import refresh
from ..engine.program import Program
from ..system.connections import SignalConnection
from ..system.system import System
from ._history import MIDDLE, carry_on
from .method import Method


def write(system: System, program: Program) -> None:
    """Write the macro step."""
    instances = [system.instances[name] for name in system.order]
    carried = {
        s.name: [link for link in system.writer.links_to(s.name) if system.writer.is_averaged(link)] for s in instances
    }
    ahead = {link.source.place: link.source for s in instances if not s.interpolates_inputs for link in carried[s.name]}
    instead = {place: carry_on(system, program, s, MIDDLE)[0] for place, s in ahead.items()}
    for s in instances:
        for link in system.writer.links_to(s.name):
            line = link in carried[s.name] and not s.interpolates_inputs
            system.writer.pass_on(program, link, instead if line else None)
    changes = {s.name: _changes(system, program, s.name, carried[s.name]) for s in instances if s.interpolates_inputs}
    for s in instances:
        program.set_inputs(s)
        if (first := changes.get(s.name)) is not None:
            program.set_input_derivatives(s, [link.target.reference for link in carried[s.name]], first)
    program.step_all(instances)
    refresh(system, program)


def _changes(system: System, program: Program, name: str, links: list[SignalConnection]) -> int | None:
    """Write how much the inputs of an FMU (scalars) have changed since the step before; the first slot."""
    if not links:
        return None
    last, change = system.layout.scratch(len(links)), system.layout.scratch(len(links))
    program.remember_slots(f"inputs of {name}", last, [link.source.place for link in links])
    for i, link in enumerate(links):
        source, factor = link.source.place, link.conversion.factor
        program.mix(change + i, [(factor, source), (-factor, last + i)])
        program.mix(last + i, [(1.0, source)])
    return change


METHOD = Method(write, order=2, input_derivatives=True)
