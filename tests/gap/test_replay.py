import numpy as np
import pytest
from deepsea_cosim.gap.analysis.component_replay import smooth


def test_smoothing_keeps_straight_lines_and_their_slope():
    t = np.sort(np.random.default_rng(0).uniform(0, 10, 800))
    at = np.linspace(0.0, 10.0, 51)
    value, slope = smooth(t, 3.0 - 0.5 * t, at, 0.05)
    assert value == pytest.approx(3.0 - 0.5 * at, abs=1e-6)
    assert slope == pytest.approx(np.full(51, -0.5), abs=1e-5)


def test_smoothing_takes_noise_away():
    t = np.arange(0, 10, 0.01)
    noise = np.random.default_rng(1).normal(0.0, 1.0, len(t))
    value, _ = smooth(t, noise, t[100:-100], 0.05)
    # a Gaussian kernel of 5 samples leaves 1 / sqrt(2 sqrt(pi) 5) of white noise
    assert value.std() == pytest.approx(1 / np.sqrt(2 * np.sqrt(np.pi) * 5), rel=0.15)
