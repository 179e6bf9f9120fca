"""The camera has the whole motion in its picture."""

from __future__ import annotations

import numpy as np
import pytest
from deepsea_cosim.master.replay.camera import framing, projected


@pytest.mark.parametrize("view", [(90.0, 0.0), (78.0, -9.0), (200.0, -60.0)])
@pytest.mark.parametrize("size", [(1280, 720), (400, 800)])
def test_all_points_are_in_the_picture_and_fill_it(view, size):
    points = np.random.default_rng(1).uniform((-2, -0.3, 0), (3, 0.2, 1.5), (400, 3))
    pixels = projected(points, framing(points, view, 28.0, size[0] / size[1]), 28.0, size)
    share = pixels / np.array(size)
    assert share.min() > 0.02
    assert share.max() < 0.98
    assert np.ptp(share, axis=0).max() > 0.7


def test_up_is_up_and_right_is_right():
    eye = framing(np.array([[-1.0, 0.0, -1.0], [1.0, 0.0, 1.0]]), (90.0, 0.0), 30.0, 1.0)
    low, high = projected(np.array([[-1.0, 0.0, -1.0], [1.0, 0.0, 1.0]]), eye, 30.0, (100, 100))
    assert low[0] < high[0]
    assert low[1] > high[1]
