"""Noise and quantisation of a channel from its readings alone."""

import numpy as np
import pytest
from deepsea_cosim.gap.problem.noise import estimate_channel_noise, estimate_noise_std, quantisation_step
from deepsea_cosim.gap.settings import NoiseSettings

T = np.arange(2000) / 100.0


@pytest.mark.parametrize("std", [0.01, 1.0, 300.0])
def test_noise_on_a_smooth_signal(std):
    signal = 40.0 * np.sin(T)
    noise = std * np.random.default_rng(0).normal(size=(20, len(T)))
    found = [estimate_noise_std(signal * 0.0 + n, NoiseSettings()) for n in noise]
    assert np.mean(found) == pytest.approx(std, rel=0.03)
    scatter = std * np.random.default_rng(1).normal(size=(20, len(T)))
    moving = [estimate_noise_std(std * 100 * np.sin(T) + s, NoiseSettings()) for s in scatter]
    assert np.mean(moving) == pytest.approx(std, rel=0.03)


def test_bursts_do_not_count_as_noise():
    y = np.random.default_rng(2).normal(size=len(T))
    y[800:1000] += 50 * np.sin(2 * np.pi * 15 * T[800:1000])
    assert estimate_noise_std(y, NoiseSettings()) == pytest.approx(1.0, rel=0.15)


def test_quantisation_step_of_a_converter():
    y = np.round((10 * np.sin(T) + np.random.default_rng(3).normal(0, 0.02, len(T))) / 0.05) * 0.05
    assert quantisation_step(y, NoiseSettings()) == pytest.approx(0.05)
    assert quantisation_step(np.random.default_rng(4).normal(size=500), NoiseSettings()) == 0.0
    assert estimate_channel_noise(np.round(3 * np.sin(T) / 0.1) * 0.1, NoiseSettings()) >= 0.1 / np.sqrt(12) * 0.99


def test_a_silent_channel_has_some_noise():
    assert estimate_channel_noise(np.full(100, 5.0), NoiseSettings()) > 0.0
    assert estimate_channel_noise(np.zeros(100), NoiseSettings()) > 0.0
