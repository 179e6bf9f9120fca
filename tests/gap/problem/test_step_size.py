"""Macro steps of exact runs and of fits, and steps of finite differences."""

from dataclasses import dataclass, field, replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from deepsea_cosim.gap.problem.build import build_problem
from deepsea_cosim.gap.problem.noise import rms
from deepsea_cosim.gap.problem.parameters import EstimatedParameter
from deepsea_cosim.gap.problem.step_size import assess_step_error, choose_difference_step, choose_fit_step
from deepsea_cosim.gap.settings import DEFAULT
from deepsea_cosim.master.parallel.pool import Pool

from tests.gap.formula import STEP, FormulaProblem, one_channel


@pytest.mark.parametrize(("noise", "difference"), [(0.0, 1e-4), (1e-5, 1e-3), (1e-2, 5e-2)])
def test_differences_are_as_small_as_the_simulations_are_smooth(noise, difference):
    rng = np.random.default_rng(0)
    base = tuple(EstimatedParameter(name, "base", 1.0, 0.05, -2.0, 2.0, 1.0) for name in "ab")

    def run(p, step):
        return np.sin(np.arange(500) * 0.1 * (1.0 + 0.05 * p["a"])) * (1.0 + 0.05 * p["b"]) + rng.normal(0, noise, 500)

    p = FormulaProblem(run, one_channel(np.arange(500.0), np.zeros(500), 1.0), base)
    assert choose_difference_step(p).discretisation.difference_step == difference


def with_noise(problem, noise_std):
    """The problem with this noise in its readings, one for all or of each."""
    observations = problem.observations
    noise = np.broadcast_to(noise_std, observations.y.shape)
    return replace(problem, observations=replace(observations, noise_std=noise))


def test_the_macro_steps_error_goes_with_a_coupling_of_second_order(posed):
    """The input is held over a step, an error of first order; the noise is made small enough for that to matter."""
    told, catalogue = posed
    with Pool(told.system, processes=1) as pool:
        problem = with_noise(build_problem(told, catalogue, pool), 1e-7)
        plain = problem.at_step({}, problem.macro_step)
        assessed = assess_step_error(problem)
        problem, d = assessed.problem, assessed.problem.discretisation
        assert (d.method, d.richardson_order) == ("nepce", 2)
        truth = problem.at_step({}, d.macro_step / 32.0)
        error, left = plain - truth, problem.exact([{}])[0] - truth
        assert rms(left) < 0.01 * rms(error)
        assert rms(assessed.change) == pytest.approx(0.5 * rms(error), rel=0.05)


def test_exact_runs_take_the_longest_step_that_does_not_matter(posed):
    told, catalogue = posed
    with Pool(told.system, processes=1) as pool:
        problem = build_problem(told, catalogue, pool)
        step = problem.macro_step
        error = rms(problem.at_step({}, step) - problem.at_step({}, step / 2.0))
        noisy = assess_step_error(with_noise(problem, 100.0 * error)).problem
        assert (noisy.discretisation.method, noisy.macro_step) == ("gauss-seidel", step)
        assessed = assess_step_error(with_noise(noisy, noisy.observations.noise_std / 20.0))
        d = assessed.problem.discretisation
        assert (d.method, d.macro_step) == ("nepce", 2.0 * step)
        assert choose_fit_step(assessed.problem, assessed.nominal, step).fit_step <= 8.0 * step


def test_the_macro_steps_error_is_extrapolated_away(posed):
    """Where a coupling of second order does not help."""
    told, catalogue = posed
    settings = replace(DEFAULT, numerics=replace(DEFAULT.numerics, second_order_gain=0.0))
    with Pool(told.system, processes=1) as pool:
        assessed = assess_step_error(with_noise(build_problem(told, catalogue, pool, settings=settings), 1e-7))
        problem = assessed.problem
        assert problem.discretisation.richardson_order == 1
        truth = problem.at_step({}, problem.macro_step / 32.0)
        error, left = assessed.nominal - truth, problem.exact([{}])[0] - truth
        assert rms(left) < 0.05 * rms(error)
        assert rms(assessed.change) == pytest.approx(0.5 * rms(error), rel=0.05)


def test_a_step_that_does_not_matter_is_not_extrapolated(posed):
    told, catalogue = posed
    with Pool(told.system, processes=1) as pool:
        assessed = assess_step_error(with_noise(build_problem(told, catalogue, pool), 1.0))
        assert assessed.problem.discretisation.richardson_order == 0
        np.testing.assert_array_equal(assessed.problem.exact([{}])[0], assessed.nominal)


T = np.linspace(0.0, 10.0, 800)


@dataclass(frozen=True, eq=False)
class SteppedProblem(FormulaProblem):
    """With what `assess_step_error` asks beside."""

    campaign: SimpleNamespace = field(default_factory=lambda: SimpleNamespace(system=Path("m.ssp"), inputs=()))

    def at_step(self, point, step):
        return self.model(point, step)


def of_formula(model):
    """A problem whose model is a formula of the macro step, with white noise of 0.01 on its readings."""
    noise = np.random.default_rng(0).normal(0.0, 0.01, len(T))
    return SteppedProblem(lambda point, step: model(step), one_channel(T, np.sin(T) + noise, 0.01))


def test_a_model_that_does_not_run_at_half_its_step_goes_on_and_that_is_told():
    assessed = assess_step_error(of_formula(lambda step: np.sin(T) if step >= STEP else None))
    assert not len(assessed.change)
    assert "half its step" in assessed.unresolved
    np.testing.assert_allclose(assessed.problem.observations.noise_std, 0.01, rtol=0.2)


def test_noise_is_not_widened_without_bound_for_a_step_that_changes_the_model():
    """A step's error that does not converge: a fixed-step FMU that answers each step in another way."""
    erratic = of_formula(lambda step: np.sin(T) + 0.3 * np.cos(40.0 * T + 7.0 / step))
    assessed = assess_step_error(erratic)
    widened = np.median(assessed.problem.observations.noise_std) / 0.01
    assert widened < np.hypot(1.0, DEFAULT.noise.step_error_share) + 0.1
    assert "m.x" in assessed.unresolved


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_parameter_at_an_end_of_its_range_is_changed_away_from_it(sign):
    """Of an accepted effect that stands there, runs on the other side fail."""
    low, high = sorted([0.0, 2.0 * sign])
    base = tuple(EstimatedParameter(name, "base", 1.0, 0.05, low, high, 1.0) for name in "abcdef")

    def run(p, step):
        if min(sign * u for u in p.values()) < 0.0:
            return None
        return np.sin(np.arange(500) * 0.1 * (1.0 + 0.05 * p["a"])) * (1.0 + 0.05 * p["b"])

    p = FormulaProblem(run, one_channel(np.arange(500.0), np.zeros(500), 1.0), base)
    assert choose_difference_step(p).discretisation.difference_step == 1e-4
