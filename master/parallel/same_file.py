"""A file that has to stay what it is while results of it are gathered: who replaces it would mix those of two."""

from __future__ import annotations

from pathlib import Path

from ...core.errors import SimulationError
from ...core.files import changed
from ..simulation.manifest import digest


class SameFile:
    """Remembers a file's content; one that is only touched, or gone, is still the same."""

    def __init__(self, path: Path):
        self.path = path
        self._written = changed(path)
        self.digest = digest(path) if path.is_file() else ""
        """At the start."""

    def check(self) -> None:
        """Raise `SimulationError` where the file has another content by now."""
        now = changed(self.path)
        if now in (self._written, 0):
            return
        if digest(self.path) != self.digest:
            raise SimulationError(
                f"{self.path}: is another file now than at the start; what was done before that is kept: start again"
            )
        self._written = now
