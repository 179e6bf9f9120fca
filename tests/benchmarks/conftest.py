"""The plant of the blind benchmark, compiled once: half a minute that several workers would spend side by side."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.conftest import made_once


@pytest.fixture(scope="session")
def plant(tmp_path_factory: pytest.TempPathFactory) -> None:
    """After this, the plant's kernels are in their cache."""

    def compile_it(_: Path) -> None:
        from benchmarks.blind.machine import Machine
        from benchmarks.blind.plant import simulate

        simulate(Machine(), np.arange(0.0, 0.1, 0.01))

    made_once(tmp_path_factory, "plant", compile_it)
