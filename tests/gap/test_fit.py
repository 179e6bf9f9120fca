"""The fit on models that are formulas, so that the answer is known."""

from types import SimpleNamespace

import numpy as np
import pytest
from deepsea_cosim.gap.estimation.cross_validation import folds, left_out_residual
from deepsea_cosim.gap.estimation.gauss_newton import (
    correlation_time,
    dispersion,
    fit,
    nuisance_columns,
    robust_weights,
    run_fit,
    run_fits,
    wide,
)
from deepsea_cosim.gap.estimation.uncertainty import FORM, FORM_OF_BASE, data_std, parameter_std
from deepsea_cosim.gap.problem.noise import rms
from deepsea_cosim.gap.problem.observations import gather
from deepsea_cosim.gap.problem.problem import EstimatedParameter

T = np.linspace(0.0, 10.0, 800)


def problem(model, truth, noise=0.01, seed=0, bias=0.0):
    """A problem whose model is model(point) -> (n,) or None."""
    y = model(truth) + bias + np.random.default_rng(seed).normal(0.0, noise, len(T))
    observations = gather([(0, 0, "m.x", T, y, noise, None, True)])
    given = {"difference": 1e-4, "smooth": {}, "hurry": lambda: False}
    return SimpleNamespace(observations=observations, runs=[0], answer=both(model, model), **given)


def both(coarse, exact):
    """Answers as `Problem.answer` does."""
    return lambda a, b: ([coarse(p) for p in a], [exact(p) for p in b])


def unknown(name, kind="effect", low=-10.0, high=10.0, sd=3.0):
    return EstimatedParameter(name, kind, 0.0, 1.0, low, high, sd)


def wave(p):
    return (1.0 + p["a"]) * np.sin((1.0 + 0.1 * p["b"]) * T) + 0.2 * p["c"] * T


def solve(p, parameters, iterations=20, start=None):
    start = np.zeros(len(parameters)) if start is None else start
    nuisance_jacobian = nuisance_columns(p, p.answer([{x.name: 0.0 for x in parameters}], [])[0][0])
    return run_fit(p, fit(p, parameters, start, nuisance_jacobian, iterations)), nuisance_jacobian


X = (unknown("a"), unknown("b"), unknown("c"))


def test_recovers_the_truth_of_a_nonlinear_model():
    truth = {"a": 0.7, "b": 1.3, "c": -0.4}
    p = problem(wave, truth)
    found, nuisance_jacobian = solve(p, X)
    std = data_std(p, found, nuisance_jacobian)
    for x, u, s in zip(X, found.normalised, std, strict=True):
        assert abs(u - truth[x.name]) < 4 * s
        assert s < 0.05
    assert found.rms == pytest.approx(1.0, abs=0.1)
    assert found.dispersion == pytest.approx(1.0, abs=0.5)


def test_intervals_cover_the_truth_as_often_as_they_say():
    truth = {"a": 0.2, "b": 0.5, "c": 0.1}
    hits = 0
    for seed in range(40):
        p = problem(wave, truth, seed=seed)
        found, nuisance_jacobian = solve(p, X)
        std = data_std(p, found, nuisance_jacobian)
        hits += sum(abs(u - truth[x.name]) < 1.96 * s for x, u, s in zip(X, found.normalised, std, strict=True))
    assert 0.85 <= hits / 120 <= 1.0


def test_an_effect_that_moves_every_instant_is_followed_by_wide_differences():
    """A sampled command: a ripple out of step with itself after 1e-5, on a trend; the base parameter is smooth."""

    def sampled(p):
        return np.sin(T) + p["a"] * np.cos(T) + 0.03 * np.sin(1e6 * p["a"] * T) + 0.2 * p["b"] * T

    truth = {"a": 1.2, "b": -0.3}
    p = problem(sampled, truth, noise=0.05)
    found, _ = solve(p, (unknown("a"), unknown("b", "base")))
    assert p.smooth == {"a": False}
    assert abs(found.normalised[0] - truth["a"]) < 0.05
    assert abs(found.normalised[1] - truth["b"]) < 0.05


def test_roughness_is_of_readings_in_floors_not_in_their_units():
    """A pressure in Pa that is smooth must not hide a position in m that is not."""
    t = np.tile(np.linspace(0.0, 10.0, 500), 2)
    position = np.arange(1000) < 500
    floor = np.where(position, 1e-3, 1e3)

    def machine(p):
        ripple = 0.01 * np.sin(1e6 * p["a"] * t)
        return np.where(position, 0.007 * p["a"] * np.cos(t) + ripple, 1e5 * (1.0 + 0.01 * p["a"]) * np.sin(t))

    y = machine({"a": 1.1}) + floor * np.random.default_rng(0).normal(size=1000)
    observations = gather([
        (0, 0, "m.x", t[:500], y[:500], 1e-3, None, True), (0, 1, "m.p", t[500:], y[500:], 1e3, None, True),
    ])  # fmt: skip
    given = {"difference": 1e-4, "smooth": {}, "hurry": lambda: False}
    p = SimpleNamespace(observations=observations, runs=[0], answer=both(machine, machine), **given)
    solve(p, (unknown("a"),), start=np.array([1.0]))
    assert p.smooth == {"a": False}


def test_what_moves_nothing_is_not_yet_known_to_be_smooth():
    p = problem(lambda p: np.sin(T) + max(0.0, p["a"] - 1.0) * np.cos(T), {"a": 0.0})
    solve(p, (unknown("a"),), iterations=1)
    assert p.smooth == {}


def test_stays_within_bounds():
    p = problem(wave, {"a": 0.7, "b": 0.0, "c": 0.0})
    found, _ = solve(p, (unknown("a", high=0.5), unknown("b"), unknown("c")))
    assert found.normalised[0] == pytest.approx(0.5)


def test_a_bias_within_the_sensors_habit_is_a_nuisance():
    p = problem(wave, {"a": 0.3, "b": 0.2, "c": 0.0}, bias=0.004)
    found, _ = solve(p, X)
    assert found.normalised[0] == pytest.approx(0.3, abs=0.02)
    assert found.rms == pytest.approx(1.0, abs=0.1)


def test_points_that_cannot_be_simulated_are_walked_around():
    def fragile(p):
        return None if p["a"] > 0.75 else wave(p)

    p = problem(wave, {"a": 0.7, "b": 0.5, "c": 0.2})
    p.answer = both(fragile, fragile)
    found, _ = solve(p, X, 40)
    assert found.normalised[0] == pytest.approx(0.7, abs=0.02)


def test_nothing_to_simulate_at_all():
    p = problem(wave, {"a": 0.1, "b": 0.0, "c": 0.0})
    nuisance_jacobian = nuisance_columns(p, wave({"a": 0.0, "b": 0.0, "c": 0.0}))
    p.answer = both(lambda point: None, lambda point: None)
    assert run_fits(p, [fit(p, X, np.ones(3), nuisance_jacobian, 5)]) == [None]


def test_long_steps_are_corrected_where_the_fit_stands():
    """Derivatives come from runs with an error of their own; the fit ends where the exact model does."""
    truth = {"a": 0.7, "b": 1.3, "c": -0.4}
    p = problem(wave, truth)
    exact, _ = solve(p, X)
    p.answer = both(lambda point: wave(point) + 0.05 * np.cos((1.0 + 0.1 * point["b"]) * T), wave)
    found, _ = solve(p, X)
    np.testing.assert_allclose(found.normalised, exact.normalised, atol=0.01)
    np.testing.assert_allclose(found.model, wave(found.point))


def test_a_spike_that_moves_does_not_hold_the_fit_up():
    """A pulse of 3 ms, a thousand floors high: only the derivative at the point itself leads along it."""
    t = np.arange(0.0, 10.0, 0.002)

    def pulse(p):
        late = 5.0 + 0.2 * p["a"] + 0.1 * p["b"]
        return 10.0 * np.exp(-0.5 * ((t - late) / 0.003) ** 2) + 0.02 * p["b"] * t + 0.1 * p["c"] * np.sin(t)

    truth = {"a": 0.5, "b": -0.8, "c": 0.4}
    y = pulse(truth) + np.random.default_rng(0).normal(0.0, 0.01, len(t))
    observations = gather([(0, 0, "m.x", t, y, 0.01, None, True)])
    p = SimpleNamespace(observations=observations, runs=[0], difference=1e-4, smooth={}, hurry=lambda: False, answer=both(pulse, pulse))
    near = np.array([0.45, -0.7, 0.0])
    nuisance_jacobian = nuisance_columns(p, pulse(dict(zip("abc", near, strict=True))))
    found = run_fit(p, fit(p, X, near, nuisance_jacobian, 40))
    assert [found.point[k] for k in "abc"] == pytest.approx([truth[k] for k in "abc"], abs=0.02)


def test_a_first_look_keeps_the_derivatives_of_another_fit():
    def absent(p):
        return wave({**p, "c": p.get("c", 0.0)})

    p = problem(wave, {"a": 0.3, "b": 0.2, "c": 0.5})
    asked = []
    p.answer = lambda a, b: (asked.append((len(a), len(b))), ([absent(q) for q in a], [absent(q) for q in b]))[1]
    start, nuisance_jacobian = solve(p, X[:2])
    asked.clear()
    found = run_fit(p, fit(p, X, np.array([*start.normalised, 0.1]), nuisance_jacobian, 5, like=start))
    assert set(asked) == {(1, 0), (3, 0)}
    assert asked.count((3, 0)) == 1  # whether runs are smooth in c is asked once
    np.testing.assert_array_equal(found.jacobian[:, :2], start.jacobian)
    assert found.rms < 0.2 * start.rms


def test_wide_derivatives_leave_the_fit_where_it_is():
    p = problem(wave, {"a": 0.3, "b": 0.1, "c": 0.1})
    found, nuisance_jacobian = solve(p, X)
    wider = run_fit(p, wide(p, found, nuisance_jacobian))
    np.testing.assert_array_equal(wider.normalised, found.normalised)
    np.testing.assert_allclose(wider.jacobian[:, 2], 0.2 * T)  # linear in c
    assert not np.allclose(wider.jacobian[:, 1], found.jacobian[:, 1])


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
    assert a > FORM * abs(found.normalised[0])
    assert c > FORM * abs(found.normalised[2])
    assert FORM_OF_BASE < b <= 0.6
    assert np.all(parameter_std(p, found, nuisance_jacobian) > data_std(p, found, nuisance_jacobian))


def test_correlation_time():
    rng = np.random.default_rng(0)
    assert correlation_time(rng.normal(size=5000)) == pytest.approx(1.0, abs=0.15)
    x = np.zeros(20000)
    for i in range(1, len(x)):
        x[i] = 0.9 * x[i - 1] + rng.normal()
    assert correlation_time(x) == pytest.approx((1 + 0.9) / (1 - 0.9), rel=0.2)


def test_dispersion_of_a_wrong_model_is_large():
    p = problem(wave, {"a": 0.5, "b": 0.0, "c": 0.0})
    wrong = (p.observations.y - wave({"a": 0.0, "b": 0.0, "c": 0.0})) / p.observations.noise_std
    assert dispersion(p, wrong) > 1000.0


def test_left_out_folds_are_predicted_from_the_rest():
    p = problem(wave, {"a": 0.3, "b": 0.1, "c": 0.1})
    found, nuisance_jacobian = solve(p, X)
    masks = folds(p.observations)
    assert np.sum(masks, axis=0).tolist() == [1] * len(T)
    held, spread = left_out_residual(p, found, nuisance_jacobian)
    assert np.all((spread >= 1.0) & (spread < 1.5))
    assert rms(held) >= found.rms
    assert rms(held) == pytest.approx(1.0, abs=0.1)


def swinging(phase):
    """The wave, and a second in which it swings with a phase that no parameter has."""
    return lambda p: wave(p) + np.where((T > 7.0) & (T < 8.0), 2.0 * np.sin(40.0 * T + phase), 0.0)


def test_a_second_of_swinging_out_of_phase_does_not_lead_the_fit_astray():
    truth = {"a": 0.7, "b": 1.3, "c": -0.4}
    y = swinging(2.0)(truth) + np.random.default_rng(0).normal(0.0, 0.01, len(T))
    observations = gather([(0, 0, "m.x", T, y, 0.01, None, True)])
    model = swinging(0.0)
    p = SimpleNamespace(observations=observations, runs=[0], difference=1e-4, smooth={}, hurry=lambda: False, answer=both(model, model))
    found, _ = solve(p, X)
    assert [found.point[name] for name in "abc"] == pytest.approx([0.7, 1.3, -0.4], abs=0.02)
    assert found.rms > 30.0


def test_near_the_floor_every_reading_counts_in_full():
    p = problem(wave, {"a": 0.7, "b": 1.3, "c": -0.4})
    noise = np.random.default_rng(1).normal(0.0, 1.0, len(T))
    assert np.all(robust_weights(p, noise) == 1.0)
    burst = np.where(np.arange(len(T)) // 100 == 3, 20.0, 1.0) * noise
    found = robust_weights(p, burst)
    assert np.all(found[:200] == 1.0)
    assert np.all(found[340:360] == pytest.approx(2.0 / 20.0, rel=0.3))
