"""Intervals of fits whose truth is known."""

import numpy as np
import pytest
from deepsea_cosim.gap.estimation.uncertainty import data_std, parameter_std

from .wave import T, X, problem, solve, unknown, wave


def test_intervals_cover_the_truth_as_often_as_they_say():
    truth = {"a": 0.2, "b": 0.5, "c": 0.1}
    hits = 0
    for seed in range(40):
        p = problem(wave, truth, seed=seed)
        found, nuisance_jacobian = solve(p, X)
        std = data_std(p, found, nuisance_jacobian)
        hits += sum(abs(u - truth[x.name]) < 1.96 * s for x, u, s in zip(X, found.normalised, std, strict=True))
    assert 0.85 <= hits / 120 <= 1.0


def test_prior_holds_what_the_data_do_not_show():
    def blind(p):
        return (1.0 + p["a"]) * np.sin(T)

    p = problem(blind, {"a": 0.2, "z": 0.0})
    found, nuisance_jacobian = solve(p, (unknown("a"), unknown("z", "base", sd=0.6)))
    assert found.normalised[1] == pytest.approx(0.0, abs=1e-6)
    assert parameter_std(p, found, nuisance_jacobian)[1] == pytest.approx(0.6)


def test_intervals_leave_room_for_another_form_of_the_effect():
    p = problem(wave, {"a": 0.7, "b": 1.3, "c": -0.4})
    found, nuisance_jacobian = solve(p, (unknown("a"), unknown("b", "base", sd=0.6), unknown("c")))
    a, b, c = parameter_std(p, found, nuisance_jacobian)
    settings = p.settings.uncertainty
    assert a > settings.form_of_effect * abs(found.normalised[0])
    assert c > settings.form_of_effect * abs(found.normalised[2])
    assert settings.form_of_base < b <= 0.6
    assert np.all(parameter_std(p, found, nuisance_jacobian) > data_std(p, found, nuisance_jacobian))
