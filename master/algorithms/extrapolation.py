"""Jacobi with inputs that are carried on: a straight line through the last two values, taken in the middle of the step.

For an input that is held, the middle is where a straight line has its mean, so what is handed over in a step is right
to second order. The first step holds what is there.
"""

from __future__ import annotations

from ..engine.program import Program
from ..slaves.base import REAL
from ..system import System
from ._history import blend

AHEAD = (1.5, -0.5)
"""The straight line half a step ahead, from the newest value and the one before."""


def write(system: System, program: Program) -> None:
    """Write the macro step."""
    sources = {k.source.place: k.source for k in system.links if k.source.family == REAL and k.source.component}
    instead = {place: blend(system, program, place, s.size, *AHEAD) for place, s in sources.items()}
    system.exchange(program, system.order, instead)
    program.advance([system.slaves[name] for name in system.order])
