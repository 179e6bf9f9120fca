"""What a free curve's band has of the corners that the machine's own curve does not have."""

import numpy as np
import pytest
from deepsea_cosim.gap.result.curves import smoothed_away


def test_a_parabola_is_as_far_from_its_best_straight_lines_as_is_said():
    knots = np.linspace(-1.0, 1.0, 9)
    x = np.linspace(-1.0, 1.0, 4001)
    hats = np.stack([np.interp(x, knots, row) for row in np.eye(9)], axis=1)
    best = np.linalg.lstsq(hats, 3.0 * x**2, rcond=None)[0]
    off = np.abs(hats @ best - 3.0 * x**2)[np.abs(x) < 0.5].max()
    said = smoothed_away(knots, best)[2:7]
    assert said == pytest.approx(off, rel=0.05)


def test_a_straight_line_has_no_corners():
    assert smoothed_away(np.array([-1.0, 0.2, 1.0]), np.array([-2.0, 0.4, 2.0])) == pytest.approx(0.0)
    assert smoothed_away(np.array([0.0, 1.0]), np.array([0.0, 4.0])) == pytest.approx(0.0)
