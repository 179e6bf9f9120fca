"""A package of native FMUs that sweeps are tried on."""

from __future__ import annotations

import pytest

from benchmarks import native

from ..master.parts import two


@pytest.fixture(scope="session")
def doubled(tmp_path_factory):
    """A ramp, a.y1 = t, that component b multiplies by D; b makes trouble from a time on (3: a crash, 1: an error)."""
    if native.compiler is None:
        pytest.skip("there is no C compiler here")
    folder = tmp_path_factory.mktemp("doubled")
    return two(folder / "p.ssp", native.linear(folder, 2), when=0.5)
