"""Coupling algorithms, one a file.

Each file has a `METHOD` (see `method`), which is all that the rest of the master knows of it. Adding one is such a file
and a test.
"""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

from ...core.errors import UsageError, did_you_mean

if TYPE_CHECKING:  # the command line asks for the names only
    from ..system.system import System
    from .method import Method

DEFAULT = "gauss-seidel"
"""Where the package suggests none."""


def _names() -> tuple[str, ...]:
    """All methods, the default first: the modules of this folder that begin with no underscore."""
    files = sorted(path.stem for path in Path(__file__).parent.glob("[a-z]*.py") if path.stem != "method")
    return tuple(sorted((name.replace("_", "-") for name in files), key=lambda name: name != DEFAULT))


NAMES = _names()


def method_named(name: str) -> Method:
    """The method of that name."""
    if name not in NAMES:
        raise UsageError(f"unknown method '{name}'; known: {', '.join(NAMES)}{did_you_mean(name, NAMES)}")
    method: Method = import_module(f".{name.replace('-', '_')}", __package__).METHOD
    return method


def choose_method(requested: str | None, suggested: str | None) -> str:
    """The method that is asked for, or what the package suggests, or the default. Raises `UsageError` for one that is
    not known."""
    name = requested or suggested or DEFAULT
    if name not in NAMES:
        whose = "" if requested else " that the package suggests"
        raise UsageError(f"unknown method '{name}'{whose}; known: {', '.join(NAMES)}{did_you_mean(name, NAMES)}")
    return name


def check_method(name: str, system: System, isolated: bool) -> None:
    """Raise `UsageError` where the algorithm needs what the FMUs of the system cannot do."""
    needs_state = method_named(name).needs_state
    for component in needs_state(system) if needs_state is not None else ():
        if isolated:
            raise UsageError(f"--method {name}: FMUs in processes of their own (--isolate) cannot be taken back")
        if not system.instances[component].can_restore:
            raise UsageError(
                f"--method {name}: component '{component}' cannot restore its state (canGetAndSetFMUstate); choose "
                "another method"
            )
