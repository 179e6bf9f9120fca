"""Where the error of a coupling comes in, and what would halve it, from a run and its repetition with half the step."""

from __future__ import annotations

from dataclasses import dataclass
from math import log2

from ..algorithms.method import Method
from .held_inputs import HeldInputs

SECOND_ORDER = "nepce"
"""The method that is named in place of one of first order: it needs nothing of the FMUs."""

SHORT = 0.5
"""By how much the order that is seen may fall short of the method's."""

WHOLE = 1e-6
"""Share of its range below which it is no matter by how much an input is off."""


@dataclass(frozen=True)
class Advice:
    """What a run and its repetition tell of the coupling's error."""

    input: str
    """The input that was furthest off, component.variable, and what drives it."""
    source: str
    off: float
    """How far, as a share of its range."""
    order: float | None
    """The power of the step as which that falls, as both runs have it; None where half the step has none."""
    method: str
    """What halves the error at the least cost: a method and a step [s]."""
    step: float
    cost: float
    """Steps that this takes, as a multiple of the run's."""

    def warning(self, method: str, order: int) -> list[str]:
        """The line to warn with where the method does not have its order here."""
        if self.order is None or self.order >= order - SHORT or self.off < WHOLE:
            return []
        return [
            f"{self.input} is off by {self.off:.2g} of its range, and with half the step by {2.0**-self.order:.2g} of "
            f"that: --method {method} does not have its order {order} here, because {self.source} is not smooth within "
            "a step"
        ]


def advice(name: str, method: Method, step: float, held: HeldInputs, half: HeldInputs) -> Advice | None:
    """What to say of a run with a method and a step [s], and of its repetition with half of it.

    None where no input was off. With an error of order p, half of it takes 2^(1/p) times the steps; with a method of
    second order an input would be off by a known share of what it is off by now, which falls with the step's square.
    """
    worst = held.furthest_off()
    if worst is None:
        return None
    rest = half.off(worst.name)
    order = log2(worst.off / rest) if rest > 0.0 else None
    cost, best = 2.0 ** (1.0 / method.order), name
    if method.order == 1 and worst.of_second_order > 0.0:
        other = max(1.0, (2.0 * worst.of_second_order / worst.off) ** 0.5)
        if other < cost:
            cost, best = other, SECOND_ORDER
    return Advice(worst.name, worst.source, worst.off, order, best, step / cost, cost)
