"""Held inputs from an output and what it was a step before."""

from __future__ import annotations

from ..engine.program import Program
from ..system import System


def blend(system: System, program: Program, place: int, size: int, newest: float, before: float) -> int:
    """Write newest * output + before * the output when this was last read; the first slot of the result.

    place, size: slots of the output, whose present value counts as the first one before.
    """
    last, held = system.scratch(size), system.scratch(size)
    reals = system.board.reals

    def remember() -> None:
        reals[last : last + size] = reals[place : place + size]

    program.at_start(remember)
    for k in range(size):
        program.mix(held + k, [(newest, place + k), (before, last + k)])
        program.mix(last + k, [(1.0, place + k)])
    return held
