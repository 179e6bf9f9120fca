"""How many readings a residual counts for."""

import numpy as np
import pytest
from deepsea_cosim.gap.estimation.dispersion import correlation_time, estimate_dispersion

from .wave import problem, wave


def test_correlation_time():
    rng = np.random.default_rng(0)
    assert correlation_time(rng.normal(size=5000)) == pytest.approx(1.0, abs=0.15)
    x = np.zeros(20000)
    for i in range(1, len(x)):
        x[i] = 0.9 * x[i - 1] + rng.normal()
    assert correlation_time(x) == pytest.approx((1 + 0.9) / (1 - 0.9), rel=0.2)


def test_dispersion_of_a_wrong_model_is_large():
    p = problem(wave, {"a": 0.5, "b": 0.0, "c": 0.0})
    wrong = (p.observations.y - wave({"a": 0.0, "b": 0.0, "c": 0.0})) / p.observations.noise_std
    assert estimate_dispersion(p, wrong) > 1000.0
