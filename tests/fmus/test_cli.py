import json
import sys
from pathlib import Path

import pytest
from deepsea_cosim.core.files import held
from deepsea_cosim.fmus import cross_check
from deepsea_cosim.fmus.cli import main


def test_check(built, tmp_path, capsys):
    assert main(["check", str(built / "DeepseaArm.fmu"), str(built / "DeepseaHydraulics.fmu")]) == 0
    assert capsys.readouterr().out.count("no problems found") == 2


def test_check_of_what_is_no_fmu(tmp_path, capsys):
    (tmp_path / "x.fmu").write_text("nonsense")
    assert main(["check", str(tmp_path / "x.fmu")]) == 1
    assert main(["check", str(tmp_path / "missing.fmu")]) == 2
    assert "no such file" in capsys.readouterr().err


def test_cross_check_fails_where_an_importer_does(built, tmp_path, capsys, monkeypatch):
    def breaks(fmu, c, folder):
        raise OSError("no binary\nfor this platform")

    monkeypatch.setattr(cross_check, "STOP", 0.1)
    absent = cross_check.Outcome(remark="not installed", absent=True)
    monkeypatch.setattr(cross_check, "IMPORTERS", {"FMPy": cross_check.through_fmpy, "other": lambda *_: absent})
    line = ["cross-check", str(built / "DeepseaArm.fmu"), "--out", str(tmp_path)]
    assert main(line) == 0
    assert "| DeepseaArm | other | not tried |  | not installed |" in capsys.readouterr().out
    assert main([*line, "--json"]) == 0
    told = json.loads(capsys.readouterr().out)["fmus"]["DeepseaArm"]
    assert told["FMPy"]["agrees"]
    assert told["other"] == {"tried": False, "agrees": False, "deviation": None, "remark": "not installed"}
    monkeypatch.setattr(cross_check, "IMPORTERS", {"FMPy": cross_check.through_fmpy, "other": breaks})
    assert main(line) == 1
    assert "| DeepseaArm | other | no |  | OSError: no binary for this platform |" in capsys.readouterr().out
    (tmp_path / "file").touch()
    assert main([*line[:-1], str(tmp_path / "file")]) == 2


def test_build_into_a_place_that_cannot_be_written(tmp_path, capsys):
    (tmp_path / "file").touch()
    assert main(["build", "--out", str(tmp_path / "file")]) == 2
    assert capsys.readouterr().err.count("\n") == 1


@pytest.mark.skipif(sys.platform == "win32", reason="folders cannot be locked there")
def test_one_build_at_a_time_writes_to_a_folder(tmp_path, capsys):
    with held(tmp_path, "x"):
        assert main(["build", "--out", str(tmp_path)]) == 2
    assert "another build is writing there" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_scenarios_are_packed(built):
    names = {path.stem for path in built.glob("*.ssp")}
    depths = {f"deepsea_{km}km" for km in (0, 3, 6, 9, 10, 11)}
    assert names == depths | {"deepsea_11km_constant_viscosity", "two_axes"}


def test_the_build_leaves_no_module_whose_file_is_gone(built):
    """An FMU that this process runs next would take the helpers from there, and put what it compiles there."""
    ours = [m for name, m in sys.modules.items() if name.startswith("deepsea_cosim_")]
    files = {m.__file__ for m in ours if hasattr(m, "__file__")}
    assert [f for f in files if f and not Path(f).exists()] == []
    assert [p for p in sys.path if "deepsea-cosim" in p and not Path(p).exists()] == []
