"""Gauss-Seidel: one component after the other, each with the newest outputs of those before it.

Components that do not depend on each other make a level, and step side by side.
"""

from __future__ import annotations

from ..coupling.loop_solver import refresh
from ..engine.program import Program
from ..system.system import System
from .method import ZERO_ORDER_HOLD, Method


def write(system: System, program: Program) -> None:
    """Write the macro step."""
    for names in system.writer.levels(system.order):
        system.writer.exchange(program, names)
        program.advance([system.instances[name] for name in names])
    refresh(system, program, loops_only=True)


METHOD = Method(write, order=1, input_hold=ZERO_ORDER_HOLD, newest_values=True)
