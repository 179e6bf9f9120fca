"""The fit on models that are formulas, so that the answer is known."""

from types import SimpleNamespace

import numpy as np
import pytest
from deepsea_cosim.gap.fit import correlation_time, dispersion, drive, fit, nuisances
from deepsea_cosim.gap.heldout import folds, left_out
from deepsea_cosim.gap.intervals import parameter_std
from deepsea_cosim.gap.noise import rms
from deepsea_cosim.gap.observations import gather
from deepsea_cosim.gap.problem import Unknown

T = np.linspace(0.0, 10.0, 800)


def problem(model, truth, noise=0.01, seed=0, bias=0.0):
    """A problem whose model is model(point) -> (n,) or None."""
    y = model(truth) + bias + np.random.default_rng(seed).normal(0.0, noise, len(T))
    obs = gather([(0, 0, "m.x", T, y, noise, None, True)])
    return SimpleNamespace(obs=obs, runs=[0], evaluate=lambda points: [model(p) for p in points])


def unknown(name, kind="effect", low=-10.0, high=10.0, sd=3.0):
    return Unknown(name, kind, 0.0, 1.0, low, high, sd)


def wave(p):
    return (1.0 + p["a"]) * np.sin((1.0 + 0.1 * p["b"]) * T) + 0.2 * p["c"] * T


def solve(p, unknowns, iterations=20, start=None):
    k = len(unknowns)
    start = np.zeros(k) if start is None else start
    N = nuisances(p, p.evaluate([{x.name: 0.0 for x in unknowns}])[0])
    ask = fit(p, unknowns, start, N, np.zeros((len(T), k)), np.zeros(k, bool), iterations, refreshes=2)
    return drive(p, [ask])[0], N


X = (unknown("a"), unknown("b"), unknown("c"))


def test_recovers_the_truth_of_a_nonlinear_model():
    truth = {"a": 0.7, "b": 1.3, "c": -0.4}
    p = problem(wave, truth)
    found, N = solve(p, X)
    std = parameter_std(p, found, N)
    for x, u, s in zip(X, found.u, std, strict=True):
        assert abs(u - truth[x.name]) < 4 * s
        assert s < 0.05
    assert found.rms == pytest.approx(1.0, abs=0.1)
    assert found.phi == pytest.approx(1.0, abs=0.5)


def test_intervals_cover_the_truth_as_often_as_they_say():
    truth = {"a": 0.2, "b": 0.5, "c": 0.1}
    hits = 0
    for seed in range(40):
        p = problem(wave, truth, seed=seed)
        found, N = solve(p, X)
        std = parameter_std(p, found, N)
        hits += sum(abs(u - truth[x.name]) < 1.96 * s for x, u, s in zip(X, found.u, std, strict=True))
    assert 0.85 <= hits / 120 <= 1.0


def test_stays_within_bounds():
    p = problem(wave, {"a": 0.7, "b": 0.0, "c": 0.0})
    found, _ = solve(p, (unknown("a", high=0.5), unknown("b"), unknown("c")))
    assert found.u[0] == pytest.approx(0.5)


def test_a_bias_within_the_sensors_habit_is_a_nuisance():
    p = problem(wave, {"a": 0.3, "b": 0.2, "c": 0.0}, bias=0.004)
    found, _ = solve(p, X)
    assert found.u[0] == pytest.approx(0.3, abs=0.02)
    assert found.rms == pytest.approx(1.0, abs=0.1)


def test_points_that_cannot_be_simulated_are_walked_around():
    def fragile(p):
        return None if p["a"] > 0.75 else wave(p)

    p = problem(wave, {"a": 0.7, "b": 0.5, "c": 0.2})
    p.evaluate = lambda points: [fragile(q) for q in points]
    found, _ = solve(p, X, 40)
    assert found.u[0] == pytest.approx(0.7, abs=0.02)


def test_nothing_to_simulate_at_all():
    p = problem(wave, {"a": 0.1, "b": 0.0, "c": 0.0})
    N = nuisances(p, wave({"a": 0.0, "b": 0.0, "c": 0.0}))
    p.evaluate = lambda points: [None for _ in points]
    ask = fit(p, X, np.ones(3), N, np.zeros((len(T), 3)), np.zeros(3, bool), 5)
    assert drive(p, [ask]) == [None]


def test_prior_holds_what_the_data_do_not_show():
    def blind(p):
        return (1.0 + p["a"]) * np.sin(T)

    p = problem(blind, {"a": 0.2, "z": 0.0})
    found, N = solve(p, (unknown("a"), unknown("z", "base", sd=0.6)))
    assert found.u[1] == pytest.approx(0.0, abs=1e-6)
    assert parameter_std(p, found, N)[1] == pytest.approx(0.6)


def test_correlation_time():
    rng = np.random.default_rng(0)
    assert correlation_time(rng.normal(size=5000)) == pytest.approx(1.0, abs=0.15)
    x = np.zeros(20000)
    for i in range(1, len(x)):
        x[i] = 0.9 * x[i - 1] + rng.normal()
    assert correlation_time(x) == pytest.approx((1 + 0.9) / (1 - 0.9), rel=0.2)


def test_dispersion_of_a_wrong_model_is_large():
    p = problem(wave, {"a": 0.5, "b": 0.0, "c": 0.0})
    wrong = (p.obs.y - wave({"a": 0.0, "b": 0.0, "c": 0.0})) / p.obs.floor
    assert dispersion(p, wrong) > 1000.0


def test_left_out_folds_are_predicted_from_the_rest():
    p = problem(wave, {"a": 0.3, "b": 0.1, "c": 0.1})
    found, N = solve(p, X)
    masks = folds(p.obs)
    assert np.sum(masks, axis=0).tolist() == [1] * len(T)
    held = left_out(p, found, N)
    assert rms(held) >= found.rms
    assert rms(held) == pytest.approx(1.0, abs=0.1)
