"""One decorator for compiled kernels, so that every kernel is compiled the same way and cached on disk.

Numba's cache of a function looks only at that function's own file. A change in another file that the
function was inlined from would go unnoticed, so whoever runs kernels from a folder that is being edited
points NUMBA_CACHE_DIR at a place named after the content of all sources (the tests do, and each FMU
unpacks its code into such a folder).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from numba import njit


def kernel(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile with IEEE arithmetic (no fast-math), division by zero giving inf, cached on disk."""
    return njit(cache=True, error_model="numpy")(function)
