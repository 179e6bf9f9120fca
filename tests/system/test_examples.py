"""The example package of docs/ssp.md, as a user makes it."""

from __future__ import annotations

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
    frame = run(path, tmp_path / "out", options).frame
    force = np.interp(frame["time"], *np.loadtxt(EXAMPLE / "force.csv", delimiter=",", skiprows=1, unpack=True))
    assert frame["arm.F_h"].to_numpy() == pytest.approx(1e3 * force)
    assert frame["position"].to_numpy() == pytest.approx(1e3 * frame["arm.x_h"].to_numpy())
    assert 20.0 < frame["position"].max() < 200.0
