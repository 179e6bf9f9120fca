"""Shared fixtures: the FMUs and packages built once a session, and toy FMUs."""

from __future__ import annotations

import hashlib
import importlib
import os
import time
from collections.abc import Callable
from pathlib import Path

import pytest
import pythonfmu  # noqa: F401  before an FMU that brings a copy of its own, which cannot build others

for _threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):  # the threads of several workers wait for each other
    os.environ.setdefault(_threads, "1")

REPOSITORY = Path(__file__).parent.parent
PACKAGES = ("core", "hydraulics_fmu", "mechanics", "fmus", "study")

LONGEST = (
    "gap/test_diagnose.py", "master/test_isolation.py", "study/sweep/test_sweep.py", "fmus/test_portable.py",
    "study/paper/test_paper.py", "master/test_foreign.py", "master/test_resume.py",
)  # fmt: skip
"""Files of more than forty seconds; those first that need none of our FMUs, which one worker makes meanwhile."""


def _drop_stale_kernels() -> None:
    """Numba looks only at a kernel's own file: when any source changed, drop all compiled kernels (see core/jit.py)."""
    folders = [Path(importlib.import_module(f"deepsea_cosim.{name}").__file__).parent for name in PACKAGES]
    digest = hashlib.sha256()
    for folder in folders:
        for path in sorted(folder.rglob("*.py")):
            digest.update(path.read_bytes())
    mark = folders[0] / "__pycache__" / "sources.sha256"
    if not mark.is_file() or mark.read_text() != digest.hexdigest():
        for folder in folders:
            for path in folder.rglob("__pycache__/*.nb[ic]"):
                path.unlink()
        mark.parent.mkdir(exist_ok=True)
        mark.write_text(digest.hexdigest())


def pytest_configure(config: pytest.Config) -> None:
    _drop_stale_kernels()
    if hasattr(config.option, "loadscopereorder"):  # xdist would begin the files of few and long tests last
        config.option.loadscopereorder = False


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """The longest files first, so that no worker is left alone with one at the end."""
    tests = REPOSITORY / "tests"
    order = {tests / name: place for place, name in enumerate(LONGEST)}
    items.sort(key=lambda item: order.get(item.path, len(order)))


def pytest_xdist_auto_num_workers(config: pytest.Config) -> int:
    """One more than there are processors: some tests wait for what hangs, or for what another worker makes."""
    return (os.cpu_count() or 1) + 1


def made_once(factory: pytest.TempPathFactory, name: str, make: Callable[[Path], object]) -> Path:
    """A folder that `make` has filled; the workers of one test run share it, and the first of them makes it."""
    own = factory.getbasetemp()
    if not own.name.startswith("popen-"):  # not by the environment: a test may call pytest in a worker
        make(folder := factory.mktemp(name))
        return folder
    folder = own.parent / name
    done = folder.with_suffix(".done")
    try:
        folder.mkdir()
    except FileExistsError:
        for _ in range(6000):
            if done.exists():
                return folder
            time.sleep(0.1)
        pytest.fail(f"another worker has not made {folder} in ten minutes")
    make(folder)
    done.touch()
    return folder


@pytest.fixture(scope="session")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with both FMUs and all scenarios; DEEPSEA_COSIM_BUILD names one that is already there."""
    if ready := os.environ.get("DEEPSEA_COSIM_BUILD"):
        return Path(ready)
    from deepsea_cosim.fmus.build import build

    return made_once(tmp_path_factory, "build", build)


@pytest.fixture(scope="session")
def toys(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the toy FMUs of tests/toys."""
    from .toys import build

    return made_once(tmp_path_factory, "toys", build)


@pytest.fixture(scope="session")
def deepsea_run(built: Path, tmp_path_factory: pytest.TempPathFactory):
    """Run a shipped scenario through the master and return its columns by name; runs are kept for the session."""
    import numpy as np
    from deepsea_cosim.master.simulation.run import Options, run

    runs: dict[tuple[object, ...], dict[str, np.ndarray]] = {}

    def get(scenario: str, **options: object) -> dict[str, np.ndarray]:
        key = (scenario, *sorted(options.items()))
        if key not in runs:
            folder = tmp_path_factory.mktemp("run")
            result = run(built / f"{scenario}.ssp", folder, Options(**options))
            table = np.loadtxt(folder / "results.csv", delimiter=",", skiprows=1)
            runs[key] = {name: table[:, i] for i, name in enumerate(result.names)}
        return runs[key]

    return get
