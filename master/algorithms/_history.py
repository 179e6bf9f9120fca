"""Held inputs from an output and what it was a step before."""

from __future__ import annotations

from ..engine.program import Program
from ..system import System


def blend(system: System, program: Program, place: int, size: int, newest: float, before: float) -> int:
    """Write newest * output + before * the output when this was last read; the first slot of the result.

    place, size: slots of the output, whose present value counts as the first one before.
    """
    last, held = system.scratch(size), system.scratch(size)
    for k in range(size):
        system.board.reals[last + k] = system.board.reals[place + k]
        program.mix(held + k, [(newest, place + k), (before, last + k)])
        program.mix(last + k, [(1.0, place + k)])
    return held
