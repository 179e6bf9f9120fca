"""The master: runs the system of an SSP package as a fixed-step co-simulation. Knows nothing of physics.

>>> from deepsea_cosim.master import Session, check, simulate
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .options import Options
    from .simulation.check import check
    from .simulation.run import simulate
    from .simulation.session import Session

__all__ = ["Options", "Session", "check", "simulate"]

_PLACES = {
    "Options": ".options", "Session": ".simulation.session", "check": ".simulation.check",
    "simulate": ".simulation.run",
}  # fmt: skip


def __getattr__(name: str) -> Any:
    """What users call, imported when it is asked for: the command line's help needs none of it."""
    if name not in _PLACES:
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
    return getattr(import_module(_PLACES[name], __name__), name)
