"""What runs away, and what is merely large or has only just begun."""

import numpy as np
import pytest
from deepsea_cosim.master.accuracy.divergence import divergence

T = np.linspace(0.0, 10.0, 2001)
EXPONENTIAL = np.exp(5.0 * T) * np.cos(40.0 * T)


def test_what_doubles_over_and_over_is_told_with_its_time():
    (line,) = divergence(["a.y", "b.F"], [1.0, 1.0], T, np.stack([np.sin(T), EXPONENTIAL], axis=1))
    assert "'b.F' runs away" in line
    assert "from t = 1.4" in line  # e^(5 t) = 1000 at 1.38 s


@pytest.mark.parametrize(
    "y",
    [1e12 * T, 1e10 * T**3, 1e12 * np.sin(T), np.full_like(T, 1e15), np.exp(T), np.where(T > 6.0, 1e7, 0.0)],
    ids=["an integral", "a power", "a swing", "a constant", "slow growth", "a jump from 0"],
)
def test_what_is_merely_large_is_not(y):
    assert divergence(["a.y"], [1.0], T, y[:, None]) == []


def test_a_nominal_value_counts():
    assert divergence(["a.y"], [1e15], T, EXPONENTIAL[:, None]) == []


def test_short_and_empty_records():
    assert divergence([], [], T, np.empty((len(T), 0))) == []
    assert divergence(["a.y"], [1.0], T[:2], EXPONENTIAL[:2, None]) == []
