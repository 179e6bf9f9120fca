import numpy as np
import pytest
from deepsea_cosim.gap.problem.sensors import Sensor, first_order_lag

T = np.linspace(0.0, 2.0, 401)


def test_neutral_is_bitwise_the_signal():
    x = np.sin(3 * T)
    assert (Sensor().read(T, x, T) == x).all()


def test_lag_of_a_ramp_is_the_closed_form():
    tau = 0.1
    assert first_order_lag(T, T, tau) == pytest.approx(T - tau * (1 - np.exp(-T / tau)), abs=1e-12)


def test_lag_of_a_sine_has_its_amplitude_and_phase():
    w, tau = 12.0, 0.05
    y = first_order_lag(T, np.sin(w * T), tau)
    gain, phase = 1 / np.hypot(1, w * tau), np.arctan(w * tau)
    assert y[200:] == pytest.approx(gain * np.sin(w * T - phase)[200:], abs=1e-3)


def test_delay_scale_and_bias():
    x = 5.0 * T
    y = Sensor(bias=0.3, scale=1.1, delay=0.02).read(T, x, T)
    assert y[10:] == pytest.approx(1.1 * (x[10:] - 0.1) + 0.3)
