"""The native FMUs that most tests of the master use."""

from __future__ import annotations

import pytest

from benchmarks import native


@pytest.fixture(scope="module")
def fmus(tmp_path_factory):
    folder = tmp_path_factory.mktemp("fmus")
    return {version: native.linear(folder, version) for version in (1, 2, 3)}
