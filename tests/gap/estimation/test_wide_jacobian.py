"""Derivatives over wide steps."""

import numpy as np
from deepsea_cosim.gap.estimation.scheduler import run_fits
from deepsea_cosim.gap.estimation.wide_jacobian import with_wide_jacobian

from .wave import T, X, problem, solve, wave


def test_wide_derivatives_leave_the_fit_where_it_is():
    p = problem(wave, {"a": 0.3, "b": 0.1, "c": 0.1})
    found, nuisance_jacobian = solve(p, X)
    wider = run_fits(p, [with_wide_jacobian(p, found, nuisance_jacobian)])[0]
    np.testing.assert_array_equal(wider.normalised, found.normalised)
    np.testing.assert_allclose(wider.jacobian[:, 2], 0.2 * T)  # linear in c
    assert not np.allclose(wider.jacobian[:, 1], found.jacobian[:, 1])
