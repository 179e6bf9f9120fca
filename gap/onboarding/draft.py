"""A campaign that has been guessed: what it would say, and what is to be asked."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from .clock import Clock
from .columns import Match
from .conditions import Condition
from .model import Parameter
from .sources import Source


@dataclass(frozen=True, eq=False)
class RunDraft:
    """A run: its source, the clock, conditions, what it is for, and what is to be asked about it."""

    source: Source
    clock: Clock
    conditions: tuple[Condition, ...] = ()
    use: str | None = None
    doubts: tuple[str, ...] = ()


@dataclass(frozen=True)
class Unmatched:
    """A column that is no channel yet: its range, and connectors that it could be, the likeliest first."""

    column: str
    least: float
    greatest: float
    candidates: tuple[str, ...]
    unit: str | None


@dataclass(frozen=True, eq=False)
class Draft:
    """All of it."""

    name: str
    matches: tuple[Match, ...]
    noise: Mapping[str, float]
    """Of each output's column, in its unit, as estimated."""
    unmatched: tuple[Unmatched, ...]
    runs: tuple[RunDraft, ...]
    base: tuple[Parameter, ...]
    """Parameters that may not be exactly known; empty where the package's catalogue says it."""
    base_said: Mapping[str, float]
    """Tolerances that the user has given."""
    failure: str
    """Why the model did not run while guessing, or ""."""
    catalogue: str | None
    """An effects.toml for the package, which has none; None: it has its own."""
    has_effects: bool
    """Whether that catalogue, or the package's, has effects of the model."""
    remarks: tuple[str, ...] = ()

    @property
    def used(self) -> list[str]:
        """The columns of channels."""
        return [m.column for m in self.matches]

    def questions(self) -> list[str]:
        """What could not be guessed, a line each."""
        lines = [f"column '{m.column}': {doubt}" for m in self.matches for doubt in m.doubts]
        for u in self.unmatched:
            perhaps = f" Perhaps {', '.join(u.candidates)}" if u.candidates else ""
            lines.append(
                f"column '{u.column}' ({u.least:.4g} to {u.greatest:.4g}): which connector is it, if any?{perhaps}"
            )
        by_text: dict[str, list[str]] = {}
        for r in self.runs:
            for doubt in r.doubts:
                by_text.setdefault(doubt, []).append(r.source.name)
        for doubt, runs in by_text.items():
            lines.append(f"{'every run' if len(runs) == len(self.runs) > 1 else ', '.join(runs[:4])}: {doubt}")
        if self.base and not self.base_said:
            lines.append("which parameters are not exactly known? They are refitted within a tolerance: [[base]]")
        if not self.has_effects:
            lines.append("effects.toml: which parameters are effects that the machine may have?")
        if self.failure:
            lines.append(f"the model as delivered does not run with what was guessed: {self.failure}")
        return lines
