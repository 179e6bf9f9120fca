"""Mutants of every kind of file, the same in every run: refused in one line or run, and nothing else.

`python -m benchmarks.fuzz --hours 8` goes on where this stops.
"""

from __future__ import annotations

import pytest

from benchmarks import native
from benchmarks.fuzz.suite import run
from benchmarks.fuzz.targets import TARGETS

NATIVE = ("ssd", "ssv", "ssm", "ssb", "description", "zip", "stimuli")
SEED, COUNT = 1, 60


@pytest.mark.parametrize("target", TARGETS)
def test_mutants(target, tmp_path):
    if target in NATIVE and native.compiler is None:
        pytest.skip("there is no C compiler here")
    found = run(target, SEED, COUNT, tmp_path)
    assert found.tried == COUNT
    assert found.failed == {}
    assert found.refused > 0
    assert found.ran > 0 or target == "zip"
