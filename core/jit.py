"""One decorator for compiled kernels, so that every kernel is compiled the same way and cached on disk.

Numba's cache of a function looks only at that function's own file. A change in another file that the
function was inlined from would go unnoticed. So each FMU unpacks its code into a folder named after the content
of all sources, and the tests drop every compiled kernel when a source has changed; whoever runs kernels
from a folder that is being edited without the tests should delete its *.nbi and *.nbc files.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from typing import Any

from numba import njit


def kernel(function: Callable[..., Any], nogil: bool = False) -> Callable[..., Any]:
    """Compile with IEEE arithmetic (no fast-math), division by zero giving inf, cached on disk.

    Where nothing can be written, neither beside the code nor in the user's cache folder, each process compiles anew.
    """
    made = njit(error_model="numpy", nogil=nogil)(function)
    if hasattr(made, "enable_caching"):
        with suppress(RuntimeError):  # "no locator available"
            made.enable_caching()
    if not hasattr(made, "py_func"):  # with NUMBA_DISABLE_JIT it is the function itself
        made.py_func = function
    return made


def free_kernel(function: Callable[..., Any]) -> Callable[..., Any]:
    """A kernel that lets other threads run meanwhile."""
    return kernel(function, nogil=True)
