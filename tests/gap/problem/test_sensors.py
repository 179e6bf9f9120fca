"""What a channel reads of a signal."""

import numpy as np
import pytest
from deepsea_cosim.gap.problem.sensors import Sensor, first_order_lag

T = np.linspace(0.0, 2.0, 401)


def test_neutral_is_bitwise_the_signal():
    x = np.sin(3 * T)
    assert (Sensor().observe(T, x, T) == x).all()


def test_lag_of_a_ramp_is_the_closed_form():
    tau = 0.1
    assert first_order_lag(T, T, tau) == pytest.approx(T - tau * (1 - np.exp(-T / tau)), abs=1e-12)


def test_lag_of_a_sine_has_its_amplitude_and_phase():
    w, tau = 12.0, 0.05
    y = first_order_lag(T, np.sin(w * T), tau)
    gain, phase = 1 / np.hypot(1, w * tau), np.arctan(w * tau)
    assert y[200:] == pytest.approx(gain * np.sin(w * T - phase)[200:], abs=1e-3)


def test_drift_grows_with_time_and_a_bent_characteristic_with_the_distance_from_the_middle():
    x = 5.0 * T
    assert Sensor(drift=0.2).observe(T, x, T) == pytest.approx(x + 0.2 * T)
    assert Sensor(curvature=0.01, middle=5.0).observe(T, x, T) == pytest.approx(x + 0.01 * (x - 5.0) ** 2)


def test_a_split_lag_is_two_filters_in_turn():
    """Of a ramp: behind by the sum of both, and less than the plain lag at first."""
    split, plain = (Sensor(lag=0.1, split=s).observe(T, T, T) for s in (1.0, 0.0))
    tau = 0.05
    assert split == pytest.approx(T - 2 * tau + (2 * tau + T) * np.exp(-T / tau), abs=1e-3)
    assert split[-1] == pytest.approx(plain[-1], abs=1e-6)
    assert split[5] < plain[5]
    assert (Sensor(lag=0.1, split=0.0).observe(T, T, T) == first_order_lag(T, T, 0.1)).all()


def test_delay_scale_and_bias():
    x = 5.0 * T
    y = Sensor(bias=0.3, scale=1.1, delay=0.02).observe(T, x, T)
    assert y[10:] == pytest.approx(1.1 * (x[10:] - 0.1) + 0.3)
