"""Whether a diagnosis has been asked to stop, by a time limit or by Ctrl-C."""

from __future__ import annotations

from collections.abc import Callable


class StopRequested(Exception):
    """Work was given up because the diagnosis has been asked to stop."""


class StopToken:
    """Asked wherever work begins; once it has been true it stays so."""

    def __init__(self, should_stop: Callable[[], bool] = lambda: False):
        self._should_stop = should_stop
        self._stopped = False

    @property
    def requested(self) -> bool:
        """Whether nothing more is to be begun."""
        self._stopped = self._stopped or self._should_stop()
        return self._stopped
