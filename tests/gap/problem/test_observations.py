"""Measurements stacked into one vector, events as readings, and the energy that residuals share."""

import numpy as np
import pytest
from deepsea_cosim.gap.problem.noise import estimate_noise_std
from deepsea_cosim.gap.problem.observations import EventObservation, RawBlock, average_neighbours, gather
from deepsea_cosim.gap.problem.sensors import Sensor
from deepsea_cosim.gap.settings import NoiseSettings

T = np.linspace(0.0, 10.0, 1001)


def test_a_ramp_arrives_when_it_should():
    x = np.clip(0.04 * (T - 2.0), 0.0, 0.2)
    assert EventObservation(0.2, 0.001, 2.0).observe(T, x) == pytest.approx(4.975)
    assert EventObservation(0.2, 0.001, 2.0, high=3.0).observe(T, x) == 3.0
    assert EventObservation(0.2, 0.001, 2.0, low=6.0).observe(T, x) == 6.0


def test_a_signal_that_leaves_again_has_not_arrived():
    x = np.where(T < 5.0, 1.0, 0.0) * (T > 1.0)
    back = np.where(T > 8.0, 1.0, x)
    assert EventObservation(1.0, 0.1, 0.0).observe(T, back) == pytest.approx(8.0, abs=0.02)


def test_a_signal_may_leave_when_it_is_told_to():
    x = np.interp(T, [0.0, 4.0, 6.0, 8.0], [0.0, 0.2, 0.2, 0.0])
    assert EventObservation(0.2, 0.001, 0.0, until=6.0).observe(T, x) == pytest.approx(3.98)
    assert EventObservation(0.2, 0.001, 0.0).observe(T, x) > 10.0


def test_the_first_time_counts_where_that_is_asked_for():
    x = np.interp(T, [0.0, 4.0, 5.0, 6.0, 10.0], [0.0, 0.2, 0.21, 0.2, 0.0])
    assert EventObservation(0.2, 0.001, 0.0, first=True).observe(T, x) == pytest.approx(3.98)
    assert EventObservation(0.2, 0.001, 3.99, first=True).observe(T, x) == 0.0
    assert EventObservation(0.5, 0.001, 0.0, first=True).observe(T, 0.01 * T) == pytest.approx(49.9)


def test_a_signal_that_stands_still_does_not_take_forever():
    assert EventObservation(0.2, 0.001, 2.0).observe(T, np.zeros(len(T))) == pytest.approx(8.0 * (1.0 + 0.199 / 0.01))


def test_a_signal_that_never_arrives_is_continued():
    x = 0.01 * T
    assert EventObservation(0.2, 0.0, 0.0).observe(T, x) == pytest.approx(20.0)


def test_reading_is_the_sensors():
    y = np.zeros(50)
    t = np.linspace(1.0, 9.0, 50)
    blocks = [(0, 0, "a.x", 0.1), (1, 0, "a.x", 0.1), (1, 1, "a.v", 0.2)]
    observations = gather([RawBlock(r, c, name, t, y, noise, None, True) for r, c, name, noise in blocks])
    rows = [np.column_stack([np.sin(T)]), np.column_stack([np.cos(T), T])]
    rows[0] = np.column_stack([np.sin(T), T])
    made = observations.observe([T, T], rows, {"a.x": 0, "a.v": 1}, {"a.v": Sensor(bias=1.0, delay=0.5)})
    assert made[:50] == pytest.approx(np.sin(t), abs=1e-4)
    assert made[50:100] == pytest.approx(np.cos(t), abs=1e-4)
    assert made[100:] == pytest.approx(t - 0.5 + 1.0)
    assert observations.slope(made)[100:] == pytest.approx(np.ones(50))


def test_averaging_keeps_mean_and_reduces_noise():
    t, y = average_neighbours(np.arange(10000.0), np.random.default_rng(0).normal(3.0, 1.0, 10000), 2500)
    assert t.shape == (2500, 4)
    assert t.ravel().tolist() == list(range(10000))
    assert len(y) == 2500
    assert y.mean() == pytest.approx(3.0, abs=0.05)
    assert y.std() == pytest.approx(0.5, rel=0.05)


@pytest.mark.parametrize("most", [400, 150, 60])
def test_the_model_is_averaged_as_the_readings_are(most):
    """A spike that one of the averaged samples has is there in both, so the right model leaves nothing."""
    spiky = np.exp(-(((T - 4.02) / 0.03) ** 2)) + np.sign(T - 7.03)
    times, y = average_neighbours(T, spiky, most)
    block = RawBlock(0, 0, "a.x", times.mean(1), y, 0.1, None, True, members=times)
    read = gather([block]).observe([T], [spiky[:, None]], {"a.x": 0})
    assert read == pytest.approx(y, abs=1e-12)
    shifted = Sensor(delay=0.5)
    late = gather([block]).observe([T - 0.5], [spiky[:, None]], {"a.x": 0}, {"a.x": shifted})
    assert late == pytest.approx(y, abs=1e-12)


def test_estimated_noise_is_corrected_by_the_models_own_roughness():
    """A fast signal looks like noise to third differences; the model has none and tells how much of it is signal."""
    t = np.arange(3000) / 610.0
    fast = np.sin(2 * np.pi * 70.0 * t)
    y = fast + np.random.default_rng(0).normal(0.0, 0.01, len(t))
    estimated = estimate_noise_std(y, NoiseSettings())
    assert estimated > 0.05
    for stated in (True, False):
        observations = gather([RawBlock(0, 0, "a.x", t, y, estimated, None, stated)]).without_model_roughness(fast)
        assert (observations.blocks[0].noise_std < 0.5 * estimated) == (not stated)


def test_noise_shares_nothing_and_a_swing_shares_its_energy():
    rng = np.random.default_rng(0)
    t = np.arange(0.0, 40.0, 0.01)
    observations = gather([RawBlock(0, 0, "m.x", t, np.zeros(len(t)), 1.0, None, True)])
    noise = rng.normal(0.0, 1.0, len(t))
    assert observations.structured_energy(noise) == pytest.approx(0.0, abs=3.0 / np.sqrt(len(t)))
    assert observations.structured_energy(3.0 * noise) == pytest.approx(0.0, abs=27.0 / np.sqrt(len(t)))
    assert observations.structured_energy(noise + 0.7 * np.sin(t)) == pytest.approx(0.7**2 / 2, abs=0.05)
    fast = np.sin(2 * np.pi * 25.0 * t)  # a quarter of the sampling rate: the next reading but one shares it
    assert observations.structured_energy(noise + fast) == pytest.approx(0.5, abs=0.05)


def test_what_is_stated_as_noise_is_none_of_the_models_business():
    t = np.arange(0.0, 40.0, 0.01)
    slow = 1.3 * np.sin(0.5 * t)
    for stated, left in ((True, 0.0), (False, 0.84)):
        observations = gather([RawBlock(0, 0, "m.x", t, np.zeros(len(t)), 1.0, None, stated)])
        assert observations.structured_energy(slow) == pytest.approx(left, abs=0.05)
    more = gather([RawBlock(0, 0, "m.x", t, np.zeros(len(t)), 1.0, None, True)])
    assert more.structured_energy(2.0 * slow) == pytest.approx(np.mean((2.0 * slow) ** 2) - 1.0)


def test_a_swing_in_one_run_and_a_drift_in_another_do_not_cancel():
    t = np.arange(0.0, 40.0, 0.01)
    swing, drift = np.sin(2 * np.pi * 25.0 * t + 0.3), np.sin(0.5 * t)
    observations = gather([RawBlock(r, 0, "m.x", t, np.zeros(len(t)), 0.01, None, False) for r in range(2)])
    found = observations.structured_energy(np.concatenate([swing, drift]))
    assert found == pytest.approx(0.5 * np.mean(swing**2 + drift**2), rel=0.01)


def test_events_share_what_they_have_beyond_the_noise():
    event = EventObservation(1.0, 0.1, 0.0)
    observations = gather([RawBlock(k, 0, "m.x", np.zeros(1), np.zeros(1), 1.0, event, True) for k in range(4)])
    assert observations.structured_energy(np.array([1.0, -1.0, 1.0, 1.0])) == 0.0
    assert observations.structured_energy(np.array([2.0, -2.0, 2.0, 2.0])) == 3.0


def test_the_middle_of_a_channel_is_that_of_all_runs():
    blocks = [RawBlock(r, 0, "a.x", T, y, 0.1, None, True) for r, y in enumerate((np.sin(T), T))]
    observations = gather(blocks)
    assert observations.middle_of("a.x") == pytest.approx(0.5 * (np.sin(T).min() + 10.0))
    assert observations.until(2.0).middle_of("a.x") == observations.middle_of("a.x")


def test_a_channel_of_zeros_reads_the_same_all_the_time():
    zeros, ramp = (RawBlock(0, k, f"a.{k}", T, y, 0.1, None, True) for k, y in enumerate((0.0 * T, T)))
    observations = gather([zeros, ramp])
    assert observations.is_constant(0, 1e-9)
    assert not observations.is_constant(1, 1e-9)
    event = EventObservation(0.2, 0.001, 2.0)
    alone = gather([RawBlock(0, 0, "a.0", T[:1], T[:1], 0.1, event, True)])
    assert not alone.is_constant(0, 1e-9)


def test_a_mean_is_cut_off_with_its_last_sample():
    times, read = average_neighbours(T, T, 100)
    observations = gather([RawBlock(0, 0, "a.x", times.mean(1), read, 0.1, None, True, members=times)])
    (block,) = observations.until(float(times[50, -1]) - 1e-9).blocks
    assert len(block.t) == 50
