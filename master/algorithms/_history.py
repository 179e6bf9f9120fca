"""What an output was a step before, and the straight line from there."""

from __future__ import annotations

from ..engine.program import Program
from ..engine.values import Signal
from ..system.system import System

MIDDLE, END = 0.5, 1.0
"""How far the straight line is taken, in steps: to the middle of the coming one, or to its end."""


def carry_on(system: System, program: Program, source: Signal, *ahead: float) -> list[int]:
    """Write the straight line through an output at the step's start and a step before, so many steps ahead of that.

    The output's value at the start of a run counts as the first one before. Returns the first slot for each of `ahead`;
    for a shorter step they are as much nearer.
    """
    place, size = source.place, source.size
    last = system.layout.scratch(size)
    held = [system.layout.scratch(size) for _ in ahead]
    program.remember_slots(source.label, last, range(place, place + size))
    for first, steps in zip(held, ahead, strict=True):
        for k in range(size):
            program.line(first + k, place + k, last + k, steps)
    for k in range(size):
        program.mix(last + k, [(1.0, place + k)])
    return held
