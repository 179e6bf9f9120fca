"""Whether a diagnosis has been asked to stop, by a time limit or by Ctrl-C."""

from __future__ import annotations

from collections.abc import Callable


class StopToken:
    """Asked wherever work begins; once it has been true it stays so."""

    def __init__(self, asked: Callable[[], bool] = lambda: False):
        self._asked = asked
        self._stopped = False

    @property
    def requested(self) -> bool:
        """Whether nothing more is to be begun."""
        self._stopped = self._stopped or self._asked()
        return self._stopped
