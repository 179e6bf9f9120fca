"""The refit that sizes are measured beyond, on models whose best point is known."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.blind.plant import PlantError
from benchmarks.blind.refit import left_by_refit

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("plant")]

T = np.arange(400) / 100.0
PARTS = [(400, 100.0)]
START = np.array([1.02, 0.99])


def ramps(b):
    return 1e3 * (b[0] * T + b[1] * T**2)


def test_what_the_parameters_can_make_is_not_left():
    assert left_by_refit(ramps, ramps(np.array([0.97, 1.04])), START, 0.05, PARTS) < 0.01


def test_bounds_count():
    """Only the second parameter reaches; the first ends at its bound, 0.03 short."""
    wanted = ramps(np.array([0.92, 1.0]))
    left = left_by_refit(ramps, wanted, START, 0.05, PARTS)
    A = 1e3 * np.column_stack([T, T**2])
    best = min(
        np.sqrt(np.mean((wanted - A @ [0.95, b]) ** 2)) for b in np.linspace(0.95, 1.05, 2001)
    )  # the ridge hardly matters beside 1e3 floors
    assert left == pytest.approx(best, rel=1e-3)


def test_a_swing_in_the_way_is_no_hindrance():
    """Beyond 1.0 the machine stands still; a narrow way leads to the point that is asked for."""

    def swings(b):
        return 200.0 * max(0.0, 1.0 - b[0]) * np.sin(60.0 * T * b[1]) + 300.0 * (b[0] - 1.0) * (T > 1.0)

    wanted = swings(np.array([0.965, 1.0]))
    assert left_by_refit(swings, wanted, np.array([1.03, 1.0]), 0.05, PARTS) < 0.05


def test_points_that_cannot_be_run_are_left_out():
    def fragile(b):
        if b[0] > 1.03:
            raise PlantError("too much")
        return ramps(b)

    assert left_by_refit(fragile, ramps(np.array([0.97, 1.02])), START, 0.05, PARTS) < 0.01


def test_enough_ends_the_search():
    calls = []

    def counted(b):
        calls.append(b)
        return ramps(b)

    assert left_by_refit(counted, ramps(START), START, 0.05, PARTS, enough=0.3) == 0.0
    assert len(calls) == 43  # the scan alone
