"""Gauss-Seidel: one component after the other, each with the newest outputs of those before it."""

from __future__ import annotations

from ..engine.program import Program
from ..system import System


def write(system: System, program: Program) -> None:
    """Write the macro step."""
    for name in system.order:
        slave = system.slaves[name]
        system.exchange(program, [name])
        program.set_inputs(slave)
        program.do_step(slave)
        program.get_outputs(slave)
