"""Scales of drawings."""

import pytest
from deepsea_cosim.gap.report.svg import ticks


@pytest.mark.parametrize(("low", "high"), [(0.0, 22.0), (-3.2e-5, 8.1e-5), (1e7, 1.1e7), (0.3, 0.3)])
def test_ticks_are_few_and_inside(low, high):
    found = ticks(low, high)
    assert 1 <= len(found) <= 7
    assert all(low - 1e-12 <= t <= high + 1e-9 * abs(high) for t in found)
