"""Coupling algorithms, one a file.

An algorithm is a function `write(system, program)` that writes down, once, what a macro step consists of; the engine
runs that in every step. Adding one is a file with such a function, its name in `NAMES`, and a test.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import TYPE_CHECKING, Any

from ...core.errors import UsageError, did_you_mean

if TYPE_CHECKING:  # the command line asks for the names only
    from ..engine.program import Program
    from ..system.system import System

NAMES = ("gauss-seidel", "jacobi", "extrapolation", "nepce", "interface-jacobian", "fixed-point")
"""The first is the default where the package suggests none."""

AT_START = ("gauss-seidel", "jacobi")
"""Methods of first order: a step's inputs are those at its start. All others hold the mean over the step, also of what
drives the whole system from a table."""


def algorithm(name: str) -> Callable[[System, Program], None]:
    """The `write` function of the algorithm called `name`."""
    return _module(name).write


def chosen(asked: str | None, suggested: str | None) -> str:
    """The method that is asked for, or what the package suggests, or the first of all. Raises `UsageError` for one that
    is not known."""
    name = asked or suggested or NAMES[0]
    if name not in NAMES:
        whose = "" if asked else " that the package suggests"
        raise UsageError(f"unknown method '{name}'{whose}; known: {', '.join(NAMES)}{did_you_mean(name, NAMES)}")
    return name


def check_method(name: str, system: System, isolated: bool) -> None:
    """Raise `UsageError` where the algorithm needs what the FMUs of the system cannot do.

    An algorithm that takes steps back says of which components, by a function `takes_back(system)`.
    """
    takes_back = getattr(_module(name), "takes_back", None)
    for component in takes_back(system) if takes_back is not None else ():
        if isolated:
            raise UsageError(f"--method {name}: FMUs in processes of their own (--isolate) cannot be taken back")
        if not system.slaves[component].can_restore:
            raise UsageError(
                f"--method {name}: component '{component}' cannot restore its state (canGetAndSetFMUstate); choose "
                "another method"
            )


def _module(name: str) -> Any:
    if name not in NAMES:
        raise UsageError(f"unknown method '{name}'; known: {', '.join(NAMES)}{did_you_mean(name, NAMES)}")
    return import_module(f".{name.replace('-', '_')}", __package__)
