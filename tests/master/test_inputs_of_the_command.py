"""What may stand in the place of an SSP package: a folder like one, a description, an FMU on its own."""

from __future__ import annotations

import zipfile

import pytest
from deepsea_cosim.core.errors import CosimError
from deepsea_cosim.master.cli import main
from deepsea_cosim.master.simulation.check import check
from deepsea_cosim.master.simulation.run import Options, run
from deepsea_cosim.master.simulation.session import Session

from benchmarks import native

from ..packages import component, package, system
from .parts import gain, two

pytestmark = pytest.mark.skipif(native.compiler is None, reason="there is no C compiler here")


@pytest.fixture
def unpacked(fmus, tmp_path):
    """A package, and the folder that it is when unpacked."""
    path = two(tmp_path / "p.ssp", fmus[2])
    with zipfile.ZipFile(path) as archive:
        archive.extractall(tmp_path / "p")
    return path, tmp_path / "p"


def columns(tmp_path, path, **options):
    return run(path, tmp_path / "out", Options(**options)).frame()


def test_a_folder_and_its_description_are_the_package(unpacked, tmp_path):
    packed, folder = unpacked
    whole, before = columns(tmp_path, packed), sorted(folder.rglob("*"))
    for given in (folder, folder / "SystemStructure.ssd"):
        assert columns(tmp_path, given).equals(whole)
        assert check(given).errors == []
    assert sorted(folder.rglob("*")) == before  # nothing is written there
    with pytest.raises(CosimError, match="is one description"):
        run(folder / "SystemStructure.ssd", tmp_path / "out", Options(variant="other"))


def test_a_package_inside_a_folder_leaves_nothing_there(fmus, tmp_path):
    inner = package(tmp_path / "inner.ssp", system("in", gain("a", 3.0)), {"resources/L.fmu": fmus[2]})
    folder = tmp_path / "outer"
    b = component("b", "inner.ssp", type="application/x-ssp-package")
    outer = package(tmp_path / "outer.ssp", system("root", b), {"inner.ssp": inner})
    with zipfile.ZipFile(outer) as archive:
        archive.extractall(folder)
    before = sorted(folder.rglob("*"))
    assert "b.a.y1" in columns(tmp_path, folder)
    assert sorted(folder.rglob("*")) == before


@pytest.mark.parametrize("version", [1, 2, 3])
def test_an_fmu_on_its_own(fmus, tmp_path, version):
    """A gain of 2 behind an input of the system: y1 = 2 u1."""
    path = fmus[version]
    name = path.stem
    (tmp_path / "u.csv").write_text("time,u1\n0,5\n1,5\n")
    frame = columns(tmp_path, path, stop_time=1.0, step=0.1, changes={"D[1,1]": 2.0}, stimuli=tmp_path / "u.csv")
    assert (frame[f"{name}.y1"] == 10.0).all()
    with Session(path) as session:
        _, rows = session.run([f"{name}.y1"], 1.0, 0.1, {"D[1,1]": 2.0}, {"u1": ([0.0, 1.0], [3.0, 3.0])})
    assert rows[-1, 0] == 6.0
    assert check(path, Options(stop_time=1.0)).errors == []


def test_outputs_that_nobody_reads_stand_in_the_table_at_the_end(fmus, tmp_path, capsys):
    given = ["--stop-time", "1", "--step", "0.1", "--set", "x0[1]=4", "--set", "C[1,1]=1", "--no-plot"]
    assert main([str(fmus[2]), *given, "--out", str(tmp_path / "out")]) == 0
    line = next(line for line in capsys.readouterr().out.splitlines() if f"{fmus[2].stem}.y1" in line)
    assert line.split()[-1] == "4"


def test_what_is_none_of_them_is_one_line(tmp_path):
    (tmp_path / "empty").mkdir()
    (tmp_path / "x.fmu").write_bytes(b"no archive")
    for name in ("empty", "x.fmu"):
        with pytest.raises(CosimError) as error:
            run(tmp_path / name, tmp_path / "out", Options())
        assert name in str(error.value)
        assert "\n" not in str(error.value)
