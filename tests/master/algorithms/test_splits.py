"""Machines cut in two where one side answers to its inputs at once: orders against the matrix exponential."""

from __future__ import annotations

import numpy as np
import pytest
from deepsea_cosim.master.algorithms import NAMES, method_named
from deepsea_cosim.master.simulation.run import Options, run

from benchmarks import native, splits

pytestmark = pytest.mark.skipif(native.compiler is None, reason="there is no C compiler here")



@pytest.fixture(scope="module", params=[splits.quarter_car, splits.two_masses], ids=lambda make: make.__name__)
def split(request, tmp_path_factory):
    made = request.param()
    return made, splits.packed(made, tmp_path_factory.mktemp("split"))


@pytest.mark.parametrize("method", NAMES)
def test_order(split, method):
    made, path = split
    errors = []
    for h in (1e-3, 5e-4):
        times, states = splits.trajectory(made, path, method, h)
        early = times <= 0.5
        errors.append(np.abs(states - splits.truth(made, times))[early, 0].max())
    assert np.log2(errors[0] / errors[1]) == pytest.approx(method_named(method).order, abs=0.15)


def test_the_projection_finds_no_damping_in_the_truth(split):
    made, _ = split
    times = np.arange(0.0, made.stop, 1e-3)
    assert splits.damping(made, times, splits.truth(made, times)) == pytest.approx(0.0, abs=1e-9)


def test_the_table_has_a_row_for_every_method(split):
    text = splits.table(split[0], ["extrapolation"])
    assert text.splitlines()[-1].startswith("| `extrapolation` |")
    assert "nan" not in text


def test_the_trust_report_tells_good_runs_from_bad_ones(tmp_path):
    made = splits.two_masses()
    path = splits.packed(made, tmp_path)
    told = {m: run(path, tmp_path / "out", Options(method=m, step=8e-3)).summary for m in ("jacobi", "fixed-point")}
    assert any("do not trust this run" in text for text in told["jacobi"]["warnings"])
    assert told["fixed-point"]["warnings"] == []
    bond = told["fixed-point"]["coupling"][0]
    assert bond["relative"] < 1e-6  # inputs are means of outputs: what one side gives the other takes
    assert bond["omega_h"] == pytest.approx(8e-3 * np.sqrt(800.0), rel=0.05)
    assert bond["numerical_damping"] is None  # the force answers to the position at once
