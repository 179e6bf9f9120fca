"""Pictures of the arm, where this machine can draw."""

import numpy as np
import pytest
from deepsea_cosim.master.replay.offscreen import NoPictures
from deepsea_cosim.mechanics.linkage import linkage
from deepsea_cosim.mechanics.variables import ARM
from deepsea_cosim.study.paper.arm_pictures import angle, shots, states


@pytest.mark.parametrize("x_h", [0.0, 0.05, 0.2])
def test_the_angle_belongs_to_the_displacement(x_h):
    p = ARM.parameters({})
    place = p["rod_eye_radius"], p["base_x"], p["base_y"]
    rest, out = (linkage.py_func(theta, *place)[0] for theta in (p["theta0"], angle({}, x_h)))
    assert out - rest == pytest.approx(x_h, abs=1e-9)


def test_the_arm_is_in_the_picture_and_moves(tmp_path):
    try:
        low, high = shots({}, [angle({}, x) for x in (0.0, 0.2)], 160, 120).astype(float)
    except NoPictures as error:
        pytest.skip(str(error))
    yellow = [(shot[..., 0] - shot[..., 2] > 60).nonzero() for shot in (low, high)]
    assert all(len(y[0]) > 50 for y in yellow)
    assert np.mean(yellow[1][0]) < np.mean(yellow[0][0])  # rows count downwards: the beam has risen
    states({}, tmp_path / "states.png")
    assert (tmp_path / "states.png").stat().st_size > 10_000


def test_where_nothing_can_draw_that_is_one_line(monkeypatch):
    monkeypatch.setenv("MUJOCO_GL", "disable")
    with pytest.raises(NoPictures, match="set MUJOCO_GL"):
        shots({}, [0.4], 16, 16)
