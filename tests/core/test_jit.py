"""Compiled kernels: cached on disk, and where nothing can be written, compiled anew."""

from __future__ import annotations

import numpy as np
from deepsea_cosim.core.jit import kernel, record_in
from deepsea_cosim.core.records import record
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


def test_a_record_in_a_row_is_read_and_written_the_same_compiled_and_not():
    kind = record(("a.x", "a.y", "b[2]"))

    @kernel
    def doubled(row, first):
        r = record_in(row, first, kind)
        r.a.y = 2.0 * r.a.x
        r.b[1] += r.a.y
        return r.b[1]

    one, two = np.arange(7.0), np.arange(7.0)
    assert doubled(one, 2) == doubled.py_func(two, 2) == 9.0
    np.testing.assert_array_equal(one, two)
    np.testing.assert_array_equal(one, [0.0, 1.0, 2.0, 4.0, 4.0, 9.0, 6.0])
