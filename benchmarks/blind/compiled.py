"""Compiled functions of the plant, cached on disk; the cache is dropped when any source of this folder is newer.

Numba looks only at the file of the function itself, so a change in another file would go unnoticed.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

from numba import njit

_HERE = Path(__file__).parent
_SOURCES = ("compiled.py", "machine.py", "forms.py", "supply.py", "lines.py", "water.py", "system.py", "solver.py")


def _drop_stale() -> None:
    newest = max((path.stat().st_mtime for name in _SOURCES if (path := _HERE / name).exists()), default=0.0)
    for cached in (_HERE / "__pycache__").glob("*.nb[ic]"):
        with suppress(OSError):
            if cached.stat().st_mtime < newest:
                cached.unlink()


_drop_stale()


def kernel(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile with IEEE arithmetic, division by zero giving inf, cached on disk."""
    return njit(cache=True, error_model="numpy")(function)
