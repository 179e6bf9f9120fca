"""Jacobi: all components from one snapshot of the outputs at the start of the step."""

from __future__ import annotations

from ..coupling.loop_solver import refresh
from ..engine.program import Program
from ..system.system import System
from .method import ZERO_ORDER_HOLD, Method


def write(system: System, program: Program) -> None:
    """Write the macro step."""
    system.writer.exchange(program, system.order)
    program.advance([system.instances[name] for name in system.order])
    refresh(system, program)


METHOD = Method(write, order=1, input_hold=ZERO_ORDER_HOLD)
