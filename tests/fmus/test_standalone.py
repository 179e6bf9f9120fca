"""An FMU that carries its own Python runs without any other."""

from __future__ import annotations

import sys
import zipfile

import pytest
from deepsea_cosim.fmus import build

from .test_portable import OUTPUT, call, native, pytestmark, unpacked  # noqa: F401

MODEL = next(m for m in build.MODELS if m.name == "DeepseaArm")


@pytest.fixture(scope="module")
def carried(tmp_path_factory):
    folder = tmp_path_factory.mktemp("standalone")
    return build.build_fmu(MODEL, folder, way=build.Way(standalone=True))


def test_size(carried):
    assert carried.stat().st_size < 40e6


def test_nothing_of_another_python_is_loaded(carried, native, unpacked, tmp_path):  # noqa: F811
    """The same numbers, with kernels compiled ahead and no numba, in an empty environment."""
    with zipfile.ZipFile(carried) as archive:
        archive.extractall(tmp_path / "fmu")
    done = call(native, "alone", tmp_path / "fmu", OUTPUT, HOME=str(tmp_path), LD_DEBUG="files")
    assert done.returncode == 0, done.stderr[-2000:]
    assert done.stdout == call(native, "alone", unpacked["DeepseaArm"], OUTPUT).stdout
    started = {line.rpartition(" ")[2] for line in done.stderr.splitlines() if "calling init: " in line}
    assert any(name.startswith(str(tmp_path / "fmu")) for name in started)
    others = (sys.base_prefix, sys.prefix)
    assert not [name for name in started if name.startswith(others) and "/lib/x86_64" not in name]
    assert not [name for name in started if "llvmlite" in name]
