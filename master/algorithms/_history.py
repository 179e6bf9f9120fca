"""Held inputs from an output and what it was a step before."""

from __future__ import annotations

from ..engine.program import Program
from ..system import System


def blend(system: System, program: Program, place: int, size: int, ahead: float) -> int:
    """Write the straight line through an output and what it was when last read, `ahead` steps after it; the first slot.

    place, size: slots of the output, whose value at the start of a run counts as the first one before. Half a step back
    (-0.5) is the mean of the two; half a step ahead of a shorter step is the middle of that.
    """
    last, held = system.scratch(size), system.scratch(size)
    reals = system.board.reals

    def remember() -> None:
        reals[last : last + size] = reals[place : place + size]

    program.at_start(remember)
    for k in range(size):
        if ahead > 0.0:
            program.line(held + k, place + k, last + k, ahead)
        else:
            program.mix(held + k, [(1.0 + ahead, place + k), (-ahead, last + k)])
        program.mix(last + k, [(1.0, place + k)])
    return held
