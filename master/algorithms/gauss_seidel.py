"""Gauss-Seidel: one component after the other, each with the newest outputs of those before it."""

from __future__ import annotations

from ..system import System


def step(system: System, t: float, h: float) -> None:
    """Take the system from t over h [s]."""
    for slave, exchange in system.sequence:
        exchange()
        slave.set_inputs()
        slave.do_step(t, h)
        slave.get_outputs()
