"""Compiled kernels: cached on disk, and where nothing can be written, compiled anew."""

from __future__ import annotations

from deepsea_cosim.core.jit import kernel
from numba.core import caching


def twice(x):
    return 2.0 * x


def test_a_kernel_runs_where_nothing_can_be_cached(monkeypatch):
    """A read-only installation and a home folder that cannot be written, as in containers."""
    monkeypatch.setattr(caching.FunctionCache._impl_class, "_locator_classes", [])
    made = kernel(twice)
    assert made(3.0) == 6.0
    assert made.stats.cache_path is None


def test_a_kernel_is_cached_on_disk():
    assert kernel(twice).stats.cache_path
