"""What is wrong with a package: the first fault ends a run, a check collects them all."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

from ...core.errors import CosimError, PackageError

T = TypeVar("T")


class Faults:
    """Raises what it is told of, or keeps it in the list `kept`."""

    def __init__(self, kept: list[str] | None = None):
        self._kept = kept

    def refuse(self, told: str) -> None:
        """Something is wrong with the package."""
        if self._kept is None:
            raise PackageError(told)
        self._kept.append(told)

    def attempt(self, make: Callable[[], T]) -> T | None:
        """What `make` gives; None where it raises a `CosimError` that is kept."""
        try:
            return make()
        except CosimError as error:
            if self._kept is None:
                raise
            self._kept.append(str(error))
            return None
