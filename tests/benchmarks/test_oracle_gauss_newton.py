"""The fit on models that are formulas, so that the answer is known."""

from dataclasses import replace

import numpy as np
import pytest
from deepsea_cosim.gap.estimation.nuisances import nuisance_jacobian_at
from deepsea_cosim.gap.estimation.scheduler import run_fits
from deepsea_cosim.gap.estimation.uncertainty import data_std
from deepsea_cosim.gap.problem.observations import RawBlock, gather

from benchmarks.blind.oracle.gauss_newton import fit, robust_weights, run_fit
from tests.gap.estimation.wave import T, X, problem, solve, unknown, wave
from tests.gap.formula import STEP, FormulaProblem, at_any_step, measured, one_channel


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
    assert found.status == "converged"


def test_an_effect_that_moves_every_instant_is_followed_by_wide_differences():
    """A sampled command: a ripple out of step with itself after 1e-5, on a trend; the base parameter is smooth."""

    def sampled(p):
        return np.sin(T) + p["a"] * np.cos(T) + 0.03 * np.sin(1e6 * p["a"] * T) + 0.2 * p["b"] * T

    truth = {"a": 1.2, "b": -0.3}
    p = problem(sampled, truth, noise=0.05)
    found, _ = solve(p, (unknown("a"), unknown("b", "base")))
    assert p.simulator.smooth == {"a": False}
    assert abs(found.normalised[0] - truth["a"]) < 0.05
    assert abs(found.normalised[1] - truth["b"]) < 0.05


def test_roughness_is_of_readings_in_noise_not_in_their_units():
    """A pressure in Pa that is smooth must not hide a position in m that is not."""
    t = np.tile(np.linspace(0.0, 10.0, 500), 2)
    position = np.arange(1000) < 500
    noise_std = np.where(position, 1e-3, 1e3)

    def machine(p):
        ripple = 0.01 * np.sin(1e6 * p["a"] * t)
        return np.where(position, 0.007 * p["a"] * np.cos(t) + ripple, 1e5 * (1.0 + 0.01 * p["a"]) * np.sin(t))

    y = machine({"a": 1.1}) + noise_std * np.random.default_rng(0).normal(size=1000)
    observations = gather([
        RawBlock(0, 0, "m.x", t[:500], y[:500], 1e-3, None, True),
        RawBlock(0, 1, "m.p", t[500:], y[500:], 1e3, None, True),
    ])  # fmt: skip
    p = FormulaProblem(at_any_step(machine), observations)
    solve(p, (unknown("a"),), start=np.array([1.0]))
    assert p.simulator.smooth == {"a": False}


def test_what_moves_nothing_is_not_yet_known_to_be_smooth():
    p = problem(lambda p: np.sin(T) + max(0.0, p["a"] - 1.0) * np.cos(T), {"a": 0.0})
    solve(p, (unknown("a"),), iterations=1)
    assert p.simulator.smooth == {}


def test_stays_within_bounds():
    p = problem(wave, {"a": 0.7, "b": 0.0, "c": 0.0})
    found, _ = solve(p, (unknown("a", high=0.5), unknown("b"), unknown("c")))
    assert found.normalised[0] == pytest.approx(0.5)
    assert found.at_bound == (True, False, False)
    assert found.status == "at_bound"


def test_a_base_parameter_at_its_tolerance_is_no_effect_at_its_bound():
    p = problem(wave, {"a": 0.7, "b": 0.3, "c": 0.0})
    base = unknown("a", "base", high=0.5)
    assert solve(p, (base, unknown("b"), unknown("c")))[0].status == "at_tolerance"
    assert solve(p, (base, unknown("b", high=0.1), unknown("c")))[0].status == "at_bound"


def test_a_bias_within_the_sensors_habit_is_a_nuisance():
    p = problem(wave, {"a": 0.3, "b": 0.2, "c": 0.0}, bias=0.004)
    found, _ = solve(p, X)
    assert found.normalised[0] == pytest.approx(0.3, abs=0.02)
    assert found.rms == pytest.approx(1.0, abs=0.1)


def test_points_that_cannot_be_simulated_are_walked_around():
    def fragile(p):
        return None if p["a"] > 0.75 else wave(p)

    p = replace(problem(wave, {"a": 0.7, "b": 0.5, "c": 0.2}), model=at_any_step(fragile))
    found, _ = solve(p, X, 40)
    assert found.normalised[0] == pytest.approx(0.7, abs=0.02)


def test_nothing_to_simulate_at_all():
    p = replace(problem(wave, {"a": 0.1, "b": 0.0, "c": 0.0}), model=lambda point, step: None)
    nuisance_jacobian = nuisance_jacobian_at(p, wave({"a": 0.0, "b": 0.0, "c": 0.0}))
    assert run_fits(p, [fit(p, X, np.ones(3), nuisance_jacobian, 5)]) == [None]


def test_a_fit_that_is_asked_to_stop_says_so():
    p = replace(problem(wave, {"a": 0.7, "b": 1.3, "c": -0.4}), stop_requested=True)
    found, _ = solve(p, X)
    assert found.status == "unfinished"


def test_long_steps_are_corrected_where_the_fit_stands():
    """Derivatives come from runs with an error of their own; the fit ends where the exact model does."""
    truth = {"a": 0.7, "b": 1.3, "c": -0.4}
    exact, _ = solve(problem(wave, truth), X)

    def rough(point, step):
        return wave(point) + (0.05 * np.cos((1.0 + 0.1 * point["b"]) * T) if step > STEP else 0.0)

    p = replace(problem(wave, truth), model=rough).with_discretisation(coarsening=2)
    found, _ = solve(p, X)
    np.testing.assert_allclose(found.normalised, exact.normalised, atol=0.01)
    np.testing.assert_allclose(found.model, wave(found.point))


def test_a_spike_that_moves_does_not_hold_the_fit_up():
    """A pulse of 3 ms, a thousand times the noise high: only the derivative at the point itself leads along it."""
    t = np.arange(0.0, 10.0, 0.002)

    def pulse(p):
        late = 5.0 + 0.2 * p["a"] + 0.1 * p["b"]
        return 10.0 * np.exp(-0.5 * ((t - late) / 0.003) ** 2) + 0.02 * p["b"] * t + 0.1 * p["c"] * np.sin(t)

    truth = {"a": 0.5, "b": -0.8, "c": 0.4}
    p = FormulaProblem(at_any_step(pulse), measured(pulse, truth, t))
    near = np.array([0.45, -0.7, 0.0])
    nuisance_jacobian = nuisance_jacobian_at(p, pulse(dict(zip("abc", near, strict=True))))
    found = run_fit(p, fit(p, X, near, nuisance_jacobian, 40))
    assert [found.point[k] for k in "abc"] == pytest.approx([truth[k] for k in "abc"], abs=0.02)


def test_a_first_look_keeps_the_derivatives_of_another_fit():
    def absent(p):
        return wave({**p, "c": p.get("c", 0.0)})

    p = replace(problem(wave, {"a": 0.3, "b": 0.2, "c": 0.5}), model=at_any_step(absent))
    start, nuisance_jacobian = solve(p, X[:2])
    p.asked.clear()
    found = run_fit(p, fit(p, X, np.array([*start.normalised, 0.1]), nuisance_jacobian, 5, nearby=start))
    asked = [(len(coarse), len(exact)) for coarse, exact in p.asked]
    assert set(asked) == {(1, 0), (3, 0)}
    assert asked.count((3, 0)) == 1  # whether runs are smooth in c is asked once
    np.testing.assert_array_equal(found.jacobian[:, :2], start.jacobian)
    assert found.rms < 0.2 * start.rms


def swinging(phase):
    """The wave, and a second in which it swings with a phase that no parameter has."""
    return lambda p: wave(p) + np.where((T > 7.0) & (T < 8.0), 2.0 * np.sin(40.0 * T + phase), 0.0)


def test_a_second_of_swinging_out_of_phase_does_not_lead_the_fit_astray():
    truth = {"a": 0.7, "b": 1.3, "c": -0.4}
    y = swinging(2.0)(truth) + np.random.default_rng(0).normal(0.0, 0.01, len(T))
    p = FormulaProblem(at_any_step(swinging(0.0)), one_channel(T, y, 0.01))
    found, _ = solve(p, X)
    assert [found.point[name] for name in "abc"] == pytest.approx([0.7, 1.3, -0.4], abs=0.02)
    assert found.rms > 30.0


def test_near_the_noise_every_reading_counts_in_full():
    p = problem(wave, {"a": 0.7, "b": 1.3, "c": -0.4})
    noise = np.random.default_rng(1).normal(0.0, 1.0, len(T))
    assert np.all(robust_weights(p, noise) == 1.0)
    burst = np.where(np.arange(len(T)) // 100 == 3, 20.0, 1.0) * noise
    found = robust_weights(p, burst)
    assert np.all(found[:200] == 1.0)
    assert np.all(found[340:360] == pytest.approx(2.0 / 20.0, rel=0.3))
