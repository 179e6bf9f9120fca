"""How many readings a residual counts for."""

import numpy as np
import pytest
from deepsea_cosim.gap.estimation.dispersion import correlation_time, estimate_dispersion, robust_weights

from .wave import T, problem, wave


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


def test_near_the_noise_every_reading_counts_in_full():
    p = problem(wave, {"a": 0.7, "b": 1.3, "c": -0.4})
    noise = np.random.default_rng(1).normal(0.0, 1.0, len(T))
    assert np.all(robust_weights(p, noise) == 1.0)
    burst = np.where(np.arange(len(T)) // 100 == 3, 20.0, 1.0) * noise
    found = robust_weights(p, burst)
    assert np.all(found[:200] == 1.0)
    assert np.all(found[340:360] == pytest.approx(2.0 / 20.0, rel=0.3))
