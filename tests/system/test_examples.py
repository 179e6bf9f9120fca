"""The example package of docs/ssp.md, as a user makes it."""

from __future__ import annotations

import runpy
import shutil
import zipfile

import numpy as np
import pytest
from deepsea_cosim.master.options import Options
from deepsea_cosim.master.simulation.check import check
from deepsea_cosim.master.simulation.run import run

from ..conftest import REPOSITORY

EXAMPLE = REPOSITORY / "examples" / "arm_alone"


def test_the_arm_alone_is_moved_by_a_table(built, tmp_path):
    """The force in kN reaches the arm in N, and what it moves by in m is shown in mm."""
    path = tmp_path / "arm_alone.ssp"
    with zipfile.ZipFile(path, "w") as made:
        made.write(EXAMPLE / "SystemStructure.ssd", "SystemStructure.ssd")
        made.write(built / "DeepseaArm.fmu", "resources/DeepseaArm.fmu")
    shutil.copy(EXAMPLE / "force.csv", tmp_path)
    options = Options(stimuli=tmp_path / "force.csv", step=0.001)
    found = check(path, options)
    (note,) = found.lines()
    assert "base.heave_rate" in note  # the arm's base stands still
    frame = run(path, tmp_path / "out", options).frame()
    force = np.interp(frame["time"], *np.loadtxt(EXAMPLE / "force.csv", delimiter=",", skiprows=1, unpack=True))
    assert frame["arm.F_h"].to_numpy() == pytest.approx(1e3 * force)
    assert frame["position"].to_numpy() == pytest.approx(1e3 * frame["arm.x_h"].to_numpy())
    assert 20.0 < frame["position"].max() < 200.0


def test_a_sea_state_has_its_height_and_rates_that_belong_together(tmp_path):
    made = runpy.run_path(str(REPOSITORY / "examples" / "sea_state" / "make.py"))
    t = np.linspace(0.0, 600.0, 60001)
    heave, inputs = made["motion"](t, height=2.0, period=8.0, pitch=0.5, rise=5.0, seed=3)
    assert 4.0 * heave.std() == pytest.approx(2.0, rel=0.1)
    rate, acceleration, pitch, turning, spin = inputs.T
    for y, its_rate in ((heave, rate), (rate, acceleration), (pitch, turning), (turning, spin)):
        middle = 0.5 * (its_rate[1:] + its_rate[:-1])
        assert np.abs(np.diff(y) / 0.01 - middle).max() < 1e-3 * np.abs(its_rate).max()
    assert (heave[0], *inputs[0]) == (0.0,) * 6
    crossings = np.flatnonzero((heave[1:] > 0.0) & (heave[:-1] <= 0.0))
    assert np.diff(t[crossings]).mean() == pytest.approx(0.71 * 8.0, rel=0.1)  # Bretschneider's mean


def test_the_arm_at_sea_moves_as_its_base_lets_it(built, tmp_path):
    """Heave adds to gravity what it accelerates by: at rest the cylinder's force follows it, in phase."""
    made = runpy.run_path(str(REPOSITORY / "examples" / "sea_state" / "make.py"))
    made["main"]([str(tmp_path / "sea.csv"), "--pitch", "0", "--height", "0.5", "--stop-time", "20"])
    dry = (("hydraulics.command.target", "0"), ("arm.C_D", "0"), ("arm.rho_s", "0"), ("arm.load_weight", "500"))
    options = Options(stimuli=tmp_path / "sea.csv", stop_time=20.0, changes=dry)
    frame = run(built / "deepsea_3km.ssp", tmp_path / "out", options).frame().iloc[5000:]
    still = frame["arm.F_hold"].iloc[0]
    expected = still * (1.0 + frame["arm.base.heave_acceleration"] / 9.81)
    assert np.abs(frame["hydraulics.F_h"] - expected).max() < 0.02 * still
    assert np.corrcoef(frame["hydraulics.F_h"], expected)[0, 1] > 0.99
