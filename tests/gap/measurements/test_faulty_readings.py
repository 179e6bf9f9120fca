"""Faults put into clean signals are found, and nothing of a clean signal is taken for a fault."""

from __future__ import annotations

import numpy as np
import pytest
from deepsea_cosim.gap.measurements.faulty_readings import find_faulty_readings

RATE = 100.0
T = np.arange(0.0, 12.0, 1.0 / RATE)


def stroke() -> np.ndarray:
    """A position: at rest, out at a constant speed, at rest, and back [m]."""
    return 0.2 * np.clip((T - 2.0) / 3.0, 0.0, 1.0) - 0.2 * np.clip((T - 7.0) / 2.0, 0.0, 1.0)


def pressure() -> np.ndarray:
    """A pressure that steps when the valve opens and closes, with an overshoot that rings [MPa]."""
    made = 5.0 + 0.0 * T
    for moment, step in ((2.0, 4.0), (5.0, -4.0), (7.0, 3.0), (9.0, -3.0)):
        since = np.maximum(T - moment, 0.0)
        made += step * (moment <= T) * (1.0 + np.exp(-since / 0.05) * np.cos(60.0 * since))
    return made


def noisy(y: np.ndarray, std: float, step: float = 0.0, seed: int = 1) -> np.ndarray:
    read = y + np.random.default_rng(seed).normal(0.0, std, len(y))
    return np.round(read / step) * step if step else read


def faults(y: np.ndarray, other: np.ndarray | None = None) -> dict[str, np.ndarray]:
    series = {"y": (T, y)} | ({} if other is None else {"other": (T, other)})
    found = find_faulty_readings(series)
    assert other is None or not found["other"].any.any()
    return {name: np.flatnonzero(getattr(found["y"], name)) for name in ("glitches", "dropouts", "stuck")}


CLEAN = {
    "noise-free motion": stroke(),
    "noise": noisy(stroke(), 5e-5),
    "coarse converter, at rest": noisy(stroke(), 1e-5, 1e-3),
    "valve switching and ringing": pressure(),
    "the same with noise": noisy(pressure(), 0.02),
    "the same, coarse": noisy(pressure(), 0.005, 0.05),
    "a switch": (np.sin(T) > 0.0).astype(float),
    "pulses of one sample of a switch": (np.arange(len(T)) % 97 == 0).astype(float),
    "steps": 5.0 * np.sign(np.sin(3.0 * T)),
    "a pump that is off": noisy(np.where((T > 3.0) & (T < 8.0), 0.0, 5.0), 0.05, 0.01) * ~((T > 3.0) & (T < 8.0)),
    "a pressure spike of five samples": noisy(5.0 + 8.0 * np.exp(-(((T - 6.0) / 0.02) ** 2)), 0.02),
    "a slow sensor, logged fast": np.repeat(noisy(pressure(), 0.02)[::50], 50),
    "white noise": noisy(0.0 * T, 1.0),
}


@pytest.mark.parametrize("name", CLEAN)
def test_nothing_of_a_clean_signal_is_left_out(name):
    assert not any(len(found) for found in faults(CLEAN[name]).values())


@pytest.mark.parametrize(
    "clean", [noisy(stroke(), 5e-5), stroke(), noisy(stroke(), 5e-5, 2e-5), noisy(pressure(), 0.02)]
)
@pytest.mark.parametrize("length", [1, 2, 3])
@pytest.mark.parametrize("size", [0.3, -1.0, 40.0])
def test_glitches_are_found(clean, length, size):
    at = np.array([150, 340, 620, 830, 1010])
    y = clean.copy()
    for k in range(length):
        y[at + k] += size * np.ptp(clean)
    found = faults(y, noisy(stroke(), 5e-5, seed=2))
    assert np.array_equal(found["glitches"], np.sort(np.concatenate([at + k for k in range(length)])))
    assert not len(found["dropouts"])
    assert not len(found["stuck"])


@pytest.mark.parametrize("length", [5, 30, 80])
def test_dropouts_to_zero_are_found(length):
    y = noisy(5.0 + pressure(), 0.02)
    y[600 : 600 + length] = 0.0
    found = faults(y, noisy(stroke(), 5e-5))
    assert np.array_equal(found["dropouts"], np.arange(600, 600 + length))


@pytest.mark.parametrize("clean", [noisy(stroke(), 5e-5), stroke(), noisy(stroke(), 1e-5, 1e-4)])
@pytest.mark.parametrize("seconds", [0.5, 1.2])
def test_a_stuck_sensor_in_motion_is_found(clean, seconds):
    y = clean.copy()
    n = int(seconds * RATE) + 2
    y[300 : 300 + n] = y[300]
    found = faults(y, noisy(pressure(), 0.02))["stuck"]
    assert set(range(302, 300 + n - 2)) <= set(found)
    assert len(found) <= n + 1


@pytest.mark.parametrize(("begin", "end"), [(3.0, 6.0), (8.0, 12.0), (0.0, 3.0)])
def test_a_sensor_stuck_in_motion_and_freed_at_rest_or_never_is_found(begin, end):
    y = noisy(stroke(), 5e-5, step=1e-5)
    inside = (begin <= T) & (end > T)
    y[inside] = y[int(np.argmax(inside))] if begin else y[int(np.argmin(inside))]
    found = faults(y, noisy(pressure(), 0.02))["stuck"]
    assert abs(len(found) - inside.sum()) <= 2


def test_a_sensor_that_shows_nothing_of_little_is_not_stuck():
    """As a flow meter does below its least flow."""
    flow = noisy(np.gradient(stroke(), T), 5e-4)
    flow[np.abs(flow) < 5e-3] = 0.0
    assert not len(faults(flow, noisy(pressure(), 0.02))["stuck"])


def test_a_real_event_of_one_sample_is_kept_where_another_channel_shows_it():
    """Acceleration at an end stop: the speed falls to 0 within a sample."""
    speed = np.where(T < 6.0, 0.1, 0.0)
    acceleration = np.gradient(speed, T)
    acceleration[np.argmin(acceleration) + 1] = 0.0
    found = find_faulty_readings({"a": (T, noisy(acceleration, 1e-3)), "v": (T, noisy(speed, 1e-4))})
    assert not found["a"].any.any()
    alone = find_faulty_readings({"a": (T, noisy(acceleration, 1e-3))})
    assert alone["a"].glitches.sum() == 1  # nothing tells it from a glitch


@pytest.mark.parametrize("moment", [200, 500, 700, 900])
def test_a_glitch_just_when_the_machine_does_something_is_found(moment):
    """It is far outside the channel's course, and the valve switches elsewhere without one."""
    y = noisy(stroke(), 5e-5)
    y[moment] += 4.0 * np.ptp(y)
    assert list(faults(y, noisy(pressure(), 0.02))["glitches"]) == [moment]


def test_what_is_frequent_is_a_signal():
    y = noisy(0.0 * T, 0.01)
    y[::8] += 5.0
    assert not any(len(found) for found in faults(y).values())


def test_a_stretch_right_between_its_sides_is_no_glitch():
    """On a steep ramp a reading of a stretch may lie right between the sides while none is near the straight line."""
    from deepsea_cosim.gap.measurements.glitches import Stretch, neighbours_agree
    from deepsea_cosim.gap.settings import DEFAULT

    y = np.array([0.0, 0.0, 0.0, 5.0, 9.0, 10.0, 10.0, 10.0])
    assert not neighbours_agree(y, Stretch(3, 5), DEFAULT.faults)
