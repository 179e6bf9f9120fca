"""The exception tree. Whatever a user can cause is a `CosimError`; its text is one line: place, fault, remedy.

CosimError
├── ParameterError      a value outside its range, not finite, or inconsistent with the others
├── PackageError        an SSP or FMU file that cannot be read or lacks a part
├── UnknownNameError    a component, connector or parameter that does not exist
├── UsageError          an option or argument that makes no sense
├── OutputError         a folder or file that cannot be written
└── SimulationError     a run that had to stop: failing FMU, value not finite
    └── Interrupted     by the user
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from difflib import get_close_matches


class CosimError(Exception):
    """Base of every error that a user can cause and mend."""


class ParameterError(CosimError, ValueError):
    """A parameter or input is not finite, out of its range, or inconsistent with another."""


class PackageError(CosimError):
    """An SSP or FMU package cannot be read, or a part of it is missing or wrong."""


class UnknownNameError(CosimError):
    """A component, connector or parameter is named that does not exist."""


class UsageError(CosimError):
    """An option or argument that makes no sense."""


class OutputError(CosimError):
    """A result folder or file cannot be written."""


class SimulationError(CosimError):
    """A run that had to stop. `time` is the last communication point reached [s]."""

    def __init__(self, message: str, time: float | None = None):
        super().__init__(message)
        self.time = time


class Interrupted(SimulationError):
    """The user asked a run to stop."""


def install(extra: str) -> str:
    """How what an extra brings gets installed; the distribution is on no index."""
    return f'pip install ".[{extra}]" in the clone of deepsea-cosim'


def did_you_mean(name: str, known: Sequence[str]) -> str:
    """A hint `; did you mean 'x'?` with the nearest of the known names, or an empty string."""
    close = get_close_matches(name, known, n=1, cutoff=0.6)
    return f"; did you mean '{close[0]}'?" if close else ""


def first_few(names: Iterable[str], count: int = 4) -> str:
    """Names for a message: the first few, and how many more there are."""
    known = list(names)
    return ", ".join(known[:count]) + (f" and {len(known) - count} more" if len(known) > count else "")
