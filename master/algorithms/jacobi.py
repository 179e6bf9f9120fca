"""Jacobi: all components from one snapshot of the outputs at the start of the step."""

from __future__ import annotations

from ..system import System


def step(system: System, t: float, h: float) -> None:
    """Take the system from t over h [s]."""
    for slave, exchange in system.sequence:
        exchange()
        slave.set_inputs()
    for slave, _ in system.sequence:
        slave.do_step(t, h)
    for slave, _ in system.sequence:
        slave.get_outputs()
