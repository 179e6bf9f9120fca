"""deepsea-cosim from Python: what `pip install` brings beside the commands.

>>> from deepsea_cosim import simulate, sweep, diagnose, build_fmus, Session, Campaign

This is the only door: everything below `deepsea_cosim.` that is not named here is internal and may change. Nothing
heavy is imported before it is used.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from .core.errors import CosimError
from .functions import build_fmus, check, compose, diagnose, read_campaign, simulate, sweep, write_page

if TYPE_CHECKING:
    from .gap.campaign.campaign import Campaign
    from .gap.diagnosed import Diagnosed
    from .master.simulation.result import Result
    from .master.simulation.session import Session
    from .study.sweep.result import Sweep

_LATE = {
    "Session": "master.simulation.session", "Campaign": "gap.campaign.campaign", "Result": "master.simulation.result",
    "Sweep": "study.sweep.result", "Diagnosed": "gap.diagnosed",
}  # fmt: skip
"""Classes, and where they are: imported when they are asked for."""

__all__ = [
    "Campaign", "CosimError", "Diagnosed", "Result", "Session", "Sweep", "build_fmus", "check", "compose",
    "diagnose", "read_campaign", "simulate", "sweep", "write_page",
]  # fmt: skip


def __getattr__(name: str) -> Any:
    if name not in _LATE:
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
    found = getattr(import_module(f"{__name__}.{_LATE[name]}"), name)
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
