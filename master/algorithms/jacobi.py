"""Jacobi: all components from one snapshot of the outputs at the start of the step."""

from __future__ import annotations

from ..engine.program import Program
from ..system import System


def write(system: System, program: Program) -> None:
    """Write the macro step."""
    slaves = [system.slaves[name] for name in system.order]
    system.exchange(program, system.order)
    for slave in slaves:
        program.set_inputs(slave)
    for slave in slaves:
        program.do_step(slave)
    for slave in slaves:
        program.get_outputs(slave)
