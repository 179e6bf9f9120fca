"""Many rows as few points: extremes stay, memory does not grow, however the rows come."""

from __future__ import annotations

import numpy as np
import pytest
from deepsea_cosim.master.page.reduction import Reduced, Reducer


def reduced(values, limit, block=1000):
    values = np.asarray(values, float).reshape(len(values), -1)
    reducer = Reducer(values.shape[1], limit)
    for k in range(0, len(values), block):
        reducer.add(np.arange(k, min(k + block, len(values)), dtype=float), values[k : k + block].T)
    made = reducer.reduced()
    return Reduced(made.times, made.values.T, made.rows, made.group)


def test_few_rows_stay_as_they_are():
    x = np.random.default_rng(1).normal(size=(400, 3))
    made = reduced(x, 400, 7)
    assert made.group == 1
    assert made.rows == 400
    assert np.array_equal(made.values, x)
    assert np.array_equal(made.times, np.arange(400.0))


@pytest.mark.parametrize("rows", [401, 1000, 4096, 10_001, 99_999])
@pytest.mark.parametrize("block", [7, 333, 100_000])
def test_each_group_keeps_its_extremes(rows, block):
    x = np.random.default_rng(rows).normal(size=(rows, 2))
    made = reduced(x, 400, block)
    assert made.group & (made.group - 1) == 0
    assert 200 <= len(made.times) <= 403
    for k in range(rows // made.group):
        group = x[k * made.group : (k + 1) * made.group]
        points = made.values[2 * k : 2 * k + 2]
        assert np.array_equal(np.sort(points, axis=0), np.stack([group.min(axis=0), group.max(axis=0)]))
        falls = group.argmax(axis=0) < group.argmin(axis=0)
        assert np.array_equal(points[0] > points[1], falls)
        assert made.times[2 * k : 2 * k + 2].tolist() == [k * made.group, (k + 1) * made.group - 1]
    assert made.values[-1].tolist() == x[-1].tolist()
    assert made.times[-1] == rows - 1
    assert made.values.min() == x.min()
    assert made.values.max() == x.max()


def test_a_spike_of_one_row_is_seen_in_a_million():
    x = np.zeros(1_000_000)
    x[654_321] = 1.0
    made = reduced(x, 2000, 50_000)
    assert made.values.max() == 1.0
    assert abs(made.times[made.values[:, 0].argmax()] - 654_321) < made.group


def test_no_numbers_among_numbers():
    x = np.sin(np.arange(10_000.0))
    x[5000:7000] = np.nan
    made = reduced(x, 400)
    inside = (made.times > 5000 + made.group) & (made.times < 7000 - made.group)
    assert np.isnan(made.values[inside]).all()
    assert np.isfinite(made.values[~inside]).sum() > 200
