"""The FMU of a user's own arm: valid, in two importers, coupled with cylinders."""

import importlib.util
import shutil
import sys
from pathlib import Path

import pytest
from deepsea_cosim.fmus import cli, cross_check
from deepsea_cosim.fmus.build import c_compiler
from deepsea_cosim.fmus.check import faults
from deepsea_cosim.master.simulation.check import check
from deepsea_cosim.master.simulation.run import Options, run
from fmpy import read_model_description, simulate_fmu
from fmpy.validation import validate_fmu

EXAMPLE = Path(__file__).parents[2] / "examples" / "boom_and_stick"


@pytest.fixture(scope="module")
def package(built, tmp_path_factory):
    """boom_and_stick.ssp, as the example makes it."""
    folder = tmp_path_factory.mktemp("own")
    shutil.copy(built / "DeepseaHydraulics.fmu", folder)
    spec = importlib.util.spec_from_file_location("make_boom_and_stick", EXAMPLE / "make.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.make(folder)


def test_it_is_valid_and_says_what_it_has(package):
    fmu = package.parent / "BoomAndStick.fmu"
    assert validate_fmu(str(fmu)) == []
    assert faults(fmu) == []
    description = read_model_description(str(fmu))
    names = {v.name: v for v in description.modelVariables}
    assert names["boom_cylinder.F"].causality == "input"
    assert names["boom_cylinder.v"].derivative is not None or "boom_cylinder.v" in names
    assert {"stick_cylinder.x", "stick_cylinder.F_hold", "boom.q", "stick.w", "P_am", "rho_s"} <= set(names)


def test_it_falls_in_another_importer(package):
    result = simulate_fmu(str(package.parent / "BoomAndStick.fmu"), stop_time=0.2, step_size=1e-3, output=["boom.q"])
    assert result["boom.q"][-1] < -0.02


@pytest.mark.skipif(c_compiler() is None or sys.platform != "linux", reason="needs Linux and a C compiler")
def test_importers_that_are_not_python_compute_the_same(package, tmp_path):
    found = cross_check.cross_check([package.parent / "BoomAndStick.fmu"], tmp_path)["BoomAndStick"]
    assert found["FMPy"].deviation <= 1e-9
    assert found["C importer, empty environment"].deviation <= 1e-12
    for other in ("ecos", "libcosim"):
        assert found[other].absent or found[other].deviation <= 1e-9
    assert (tmp_path / "BoomAndStick" / "BoomAndStick_in.csv").read_text().startswith('"time","boom_cylinder.F"')


def test_two_cylinders_move_boom_and_stick(package, tmp_path):
    assert not check(package).errors
    frame = run(package, tmp_path / "out", Options(step=4e-3, stop_time=9.0)).frame()
    assert frame["arm.boom_cylinder.x"].iloc[-1] == pytest.approx(0.15, abs=2e-3)
    assert frame["arm.stick_cylinder.x"].iloc[-1] == pytest.approx(0.12, abs=2e-3)
    still = frame[frame["time"] < 1.9]
    assert abs(still["arm.boom_cylinder.x"]).max() < 1e-6


def test_a_model_without_a_tendon_is_one_line_and_nothing_is_built(tmp_path, capsys):
    path = tmp_path / "bar.xml"
    path.write_text('<mujoco><worldbody><body><joint/><geom size="0.1"/></body></worldbody></mujoco>')
    assert cli.main(["arm", str(path), "--out", str(tmp_path / "out")]) == 2
    told = capsys.readouterr().err
    assert told.count("\n") == 1
    assert "has no tendon" in told
    assert not (tmp_path / "out").exists()
