"""Course, amplitude and frequency of a swing, against closed forms and repeated noise."""

import numpy as np
import pytest
from deepsea_cosim.gap.problem.swing import (
    AMPLITUDE,
    COURSE,
    FREQUENCY,
    Swing,
    SwingFeature,
    crossing_frequency,
    hann_means,
    local_lines,
)
from deepsea_cosim.gap.settings import SwingSettings

T = np.arange(0.0, 12.0, 0.01)
NOISE = 0.02


def swing(frequency=3.0, noise=NOISE, **settings):
    """The whole record as one swing."""
    at = np.linspace(T[0], T[-1], 25)
    return Swing(T, at, 1.0, np.full(len(T), noise), frequency, SwingSettings(**settings))


def wave(phase=0.0, amplitude=0.5, frequency=3.0):
    return amplitude * np.sin(2.0 * np.pi * frequency * T + phase)


def inner(x):
    """Without the ends, where a window is one-sided."""
    return x[2:-2]


def test_a_line_is_its_own_course_up_to_its_ends():
    line = 3.0 - 0.7 * T
    assert swing().trend(line) == pytest.approx(3.0 - 0.7 * swing().at, abs=1e-9)
    assert swing().oscillation(line) == pytest.approx(np.zeros(len(T)), abs=1e-9)


def test_a_hann_window_over_whole_periods_lets_nothing_of_a_sine_through():
    assert inner(swing().trend(wave())) == pytest.approx(np.zeros(21), abs=1e-4)


def test_amplitude_and_frequency_are_those_of_the_sine():
    amplitude = np.exp(inner(swing(noise=0.0).amplitude(wave(), False)))
    assert amplitude == pytest.approx(np.full(21, 0.5), rel=0.01)
    assert np.exp(swing().log_frequency(wave(frequency=3.1))) == pytest.approx(3.1, rel=2e-3)


@pytest.mark.parametrize("phase", [0.3, 1.6, 3.0, 5.5])
def test_nothing_of_it_depends_on_phase(phase):
    s = swing()
    for quantity, most in ((COURSE, 1e-3), (AMPLITUDE, 2e-3), (FREQUENCY, 2e-3)):
        feature = SwingFeature(s, quantity)
        moved = feature.observe(2.0 + wave(phase)) - feature.observe(2.0 + wave())
        assert np.abs(moved if quantity == FREQUENCY else inner(moved)).max() < most
    assert np.abs(wave(phase) - wave()).max() > 0.1


def test_what_swings_less_than_the_noise_is_no_evidence_of_a_frequency():
    s = swing()
    assert np.exp(s.log_frequency(wave(amplitude=1e-3, frequency=9.0))) == pytest.approx(3.0, rel=0.01)
    assert np.exp(s.log_frequency(np.zeros(len(T)))) == pytest.approx(3.0)


def test_the_noise_of_each_quantity_is_that_of_repeated_readings():
    s = swing(trend_error=0.0, envelope_error=0.0, frequency_error=0.0)
    random = np.random.default_rng(3)
    clean = 1.0 + wave()
    repeats = [clean + random.normal(0.0, NOISE, len(T)) for _ in range(400)]
    for quantity in s.quantities:
        feature = SwingFeature(s, quantity)
        read = np.array([feature.observe(y, noisy=True) for y in repeats])
        told = np.mean([s.noise_of(quantity, y) for y in repeats[:20]], axis=0)
        assert np.median(read.std(axis=0) / told) == pytest.approx(1.0, abs=0.35 if quantity == FREQUENCY else 0.12)


def test_a_model_has_the_noise_s_part_of_an_amplitude_added():
    s = swing()
    random = np.random.default_rng(4)
    noisy = np.mean([s.amplitude(wave(amplitude=0.02) + random.normal(0.0, NOISE, len(T)), True)
                     for _ in range(200)], axis=0)  # fmt: skip
    assert inner(s.amplitude(wave(amplitude=0.02), False)) == pytest.approx(inner(noisy), abs=0.05)
    assert s.amplitude(np.zeros(len(T)), False) == pytest.approx(0.5 * np.log(s.noise_energy))


def test_only_the_course_follows_a_bias_of_the_sensor():
    s = swing()
    assert [SwingFeature(s, q).takes_bias for q in s.quantities] == [True, False, False]
    for quantity in (AMPLITUDE, FREQUENCY):
        feature = SwingFeature(s, quantity)
        assert feature.observe(5.0 + wave()) == pytest.approx(feature.observe(wave()), abs=1e-9)


def test_weights_of_a_mean_and_of_lines_add_up_to_one_on_any_spacing():
    t = np.sort(np.random.default_rng(1).uniform(0.0, 10.0, 300))
    at = np.linspace(t[0], t[-1], 30)
    for weights in (hann_means(t, at, 1.5), local_lines(t, at, 1.5)):
        assert np.asarray(weights.sum(axis=1)).ravel() == pytest.approx(np.ones(30))


def test_crossings_that_noise_adds_are_not_counted():
    noisy = wave() + np.random.default_rng(2).normal(0.0, 0.05, len(T))
    assert crossing_frequency(T, noisy, 0.3) == pytest.approx(3.0, rel=0.01)
    assert crossing_frequency(T, np.ones(len(T)), 0.3) is None
