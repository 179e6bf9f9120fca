"""The outcome of a diagnosis."""

from __future__ import annotations

from dataclasses import dataclass

from .state import State


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """What was found out, and what it took."""

    state: State
    simulations: int
    seconds: float
    """Wall time [s]."""
