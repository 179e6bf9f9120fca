"""What the rest of the master knows of a coupling algorithm."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ..engine.program import Program
    from ..slaves.base import FmuInstance
    from ..system.system import System

ZERO_ORDER_HOLD, MEAN = "zero-order hold", "mean"
"""What an input is held at over a step: the value at the step's start, or the mean over the step, which goes for what
drives the whole system from a table, too."""


@dataclass(frozen=True)
class Method:
    """A coupling algorithm: a module of this folder has one as `METHOD`, and its file's name is its name."""

    write: Callable[[System, Program], None]
    """Writes down, once, what a macro step consists of; the engine runs that in every step."""
    order: int
    """The error falls as this power of the step."""
    input_hold: str = MEAN
    newest_values: bool = False
    """Components get what those before them give in the same step: what answers to an input at once has to be known
    only where it may close a loop."""
    needs_state: Callable[[System], Sequence[str]] | None = None
    """Components whose steps are taken back, so that they have to save and restore their state; None: none."""
    input_derivatives: bool = False
    """FMUs that can are told how fast their inputs move."""

    def interpolating(self, instances: Iterable[FmuInstance]) -> list[str]:
        """Components that carry their inputs on through a step, along the slope of the last change."""
        return [s.name for s in instances if self.input_derivatives and s.interpolates_inputs]
