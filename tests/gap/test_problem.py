"""What a point means for the runs of a campaign."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from deepsea_cosim.core.errors import CosimError, UnknownNameError
from deepsea_cosim.gap.campaign.catalogue import Base, Experiment, Measurable, load, load_from_package
from deepsea_cosim.gap.campaign.read import read
from deepsea_cosim.gap.problem import step_size as steps
from deepsea_cosim.gap.problem.noise import rms
from deepsea_cosim.gap.problem.problem import EstimatedParameter, _base, build_problem, check_catalogue, matching
from deepsea_cosim.gap.problem.step_size import assess_step_error, choose_difference_step, choose_fit_step
from deepsea_cosim.gap.selection.evidence import prior
from deepsea_cosim.master.pool import Pool
from deepsea_cosim.master.session import Session

from .oscillator import campaign, measure


def test_a_bare_name_means_every_component():
    values = {"a.depth": 1.0, "b.depth": 1.0, "b.k": 2.0}
    assert matching("depth", values) == ("a.depth", "b.depth")
    assert matching("b.depth", values) == ("b.depth",)
    assert matching("width", values) == ()


@pytest.fixture
def posed(toys, tmp_path):
    told = read(campaign(tmp_path, toys, [measure(1, lambda t, x, v: 0.0)]))
    return told, load(told.effects)


def test_estimation_settings_hold_at_longer_steps_only(posed):
    told, catalogue = posed
    with Pool(told.system, processes=1) as pool:
        plain = build_problem(told, catalogue, pool)
        quick = build_problem(told, replace(catalogue, estimation={"o.d": 30.0}), pool)
        quick.coarsening = plain.coarsening = 2
        np.testing.assert_array_equal(quick.exact([{}])[0], plain.exact([{}])[0])
        assert not np.allclose(quick.evaluate([{}])[0], plain.evaluate([{}])[0])
        coarse, exact = quick.answer([{}], [{}])
        np.testing.assert_array_equal(coarse[0], quick.evaluate([{}])[0])
        np.testing.assert_array_equal(exact[0], plain.exact([{}])[0])


@pytest.mark.parametrize(("noise", "difference"), [(0.0, 1e-4), (1e-5, 1e-3), (1e-2, 5e-2)])
def test_differences_are_as_small_as_the_simulations_are_smooth(noise, difference):
    rng = np.random.default_rng(0)
    base = tuple(EstimatedParameter(name, "base", 1.0, 0.05, -2.0, 2.0, 1.0) for name in "ab")

    def run(p):
        return np.sin(np.arange(500) * 0.1 * (1.0 + 0.05 * p["a"])) * (1.0 + 0.05 * p["b"]) + rng.normal(0, noise, 500)

    p = SimpleNamespace(base=base, evaluate=lambda points: [run(q) for q in points])
    choose_difference_step(p)
    assert p.difference == difference


def test_values_that_an_fmu_refuses_are_found_at_once(built):
    package = built / "deepsea_0km.ssp"
    own = load_from_package(package)
    friction = own.effect("cylinder_coulomb_friction")
    wild = replace(friction, parameters=(replace(friction.parameters[0], high=1e12),))
    with Session(package) as session:
        check_catalogue(own, session)
        for wrong, told in (
            ({"experiments": (Experiment("depth", (1e9,)),)}, r"experiment depth: .*depth=1000000000\.0.* range"),
            ({"effects": (wild,)}, r"effect cylinder_coulomb_friction: .* range"),
            ({"measurables": (Measurable("arm.z", 1.0),)}, "measurable arm.z: no connector"),
            ({"experiments": (Experiment("command.use_input", (1.0,)),)}, "is no real number"),
        ):
            with pytest.raises(CosimError, match=told):
                check_catalogue(replace(own, **wrong), session)


def test_an_estimation_setting_that_nobody_has(posed):
    told, catalogue = posed
    with pytest.raises(UnknownNameError, match="estimation: no component has a parameter"):
        build_problem(told, replace(catalogue, estimation={"o.rtol": 1.0}), None)


def test_the_macro_steps_error_goes_with_a_coupling_of_second_order(posed):
    """The input is held over a step, an error of first order; its floor is made small enough for that to matter."""
    told, catalogue = posed
    with Pool(told.system, processes=1) as pool:
        problem = build_problem(told, catalogue, pool)
        problem.observations.noise_std[:] = 1e-7
        plain = problem.at_step({}, problem.macro_step)
        _, halving = assess_step_error(problem)
        assert (problem.method, problem.richardson_order) == ("nepce", 2)
        truth = problem.at_step({}, problem.macro_step / 32.0)
        error, left = plain - truth, problem.exact([{}])[0] - truth
        assert rms(left) < 0.01 * rms(error)
        assert rms(halving) == pytest.approx(0.5 * rms(error), rel=0.05)


def test_exact_runs_take_the_longest_step_that_does_not_matter(posed):
    told, catalogue = posed
    with Pool(told.system, processes=1) as pool:
        problem = build_problem(told, catalogue, pool)
        step = problem.macro_step
        problem.observations.noise_std[:] = 100.0 * rms(problem.at_step({}, step) - problem.at_step({}, step / 2.0))
        assess_step_error(problem)
        assert (problem.method, problem.macro_step) == ("gauss-seidel", step)
        problem.observations.noise_std /= 20.0
        assess_step_error(problem)
        assert (problem.method, problem.macro_step) == ("nepce", 2.0 * step)
        choose_fit_step(problem, problem.at_step({}, problem.macro_step), step)
        assert problem.fit_step <= 8.0 * step


def test_the_macro_steps_error_is_extrapolated_away(posed, monkeypatch):
    """Where a coupling of second order does not help."""
    monkeypatch.setattr(steps, "GAINS", 0.0)
    told, catalogue = posed
    with Pool(told.system, processes=1) as pool:
        problem = build_problem(told, catalogue, pool)
        problem.observations.noise_std[:] = 1e-7
        nominal, halving = assess_step_error(problem)
        assert problem.richardson_order == 1
        truth = problem.at_step({}, problem.macro_step / 32.0)
        error, left = nominal - truth, problem.exact([{}])[0] - truth
        assert rms(left) < 0.05 * rms(error)
        assert rms(halving) == pytest.approx(0.5 * rms(error), rel=0.05)


def test_a_step_that_does_not_matter_is_not_extrapolated(posed):
    told, catalogue = posed
    with Pool(told.system, processes=1) as pool:
        problem = build_problem(told, catalogue, pool)
        problem.observations.noise_std[:] = 1.0
        nominal, _ = assess_step_error(problem)
        assert problem.richardson_order == 0
        np.testing.assert_array_equal(problem.exact([{}])[0], nominal)


def test_two_base_entries_of_one_parameter_are_refused():
    """k means that of every component; o.k named as well would be refitted twice."""
    run = SimpleNamespace(values={"o.k": 1.0, "q.k": 2.0})
    catalogue = SimpleNamespace(base=[Base("k", 0.05)], effects=())
    c = SimpleNamespace(base={}, file="c.toml")
    assert [x.addresses for x in _base(c, catalogue, [run], [])] == [("o.k", "q.k")]
    c.base = {"o.k": 0.1}
    with pytest.raises(CosimError, match=r"two entries mean 'o.k'"):
        _base(c, catalogue, [run], [])


def test_prior_of_one_sensors_effect_in_two_channels():
    one = [SimpleNamespace(id="bias", weight=0.5), SimpleNamespace(id="bias", weight=0.5)]
    problem = SimpleNamespace(candidates=one)
    assert 0.0 < prior(problem, SimpleNamespace(candidates=tuple(one))) < prior(problem, SimpleNamespace(candidates=()))
