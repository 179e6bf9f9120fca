"""The model as delivered, and the refit of the base parameters where the way to the data is not straight."""

from dataclasses import replace

import numpy as np
import pytest
from deepsea_cosim.gap.estimation.nuisances import nuisance_jacobian_at
from deepsea_cosim.gap.problem.parameters import EffectCandidate, EstimatedParameter
from deepsea_cosim.gap.search.baseline import is_strained, refit_base, resume_refit, simulate_nominal

from tests.gap.formula import FormulaProblem, at_any_step, measured

T = np.linspace(0.0, 10.0, 800)
BASE = tuple(EstimatedParameter(name, "base", 1.0, 0.05, -1.0, 1.0, 0.6) for name in "ab")


def posed(machine, truth, base=BASE):
    p = FormulaProblem(at_any_step(machine), measured(machine, truth, T), base)
    return p, nuisance_jacobian_at(p, machine({}))


def refit(machine, truth):
    p, nuisance_jacobian = posed(machine, truth)
    return refit_base(p, nuisance_jacobian, simulate_nominal(p, nuisance_jacobian)).fit


def straight(p):
    return (1.0 + 0.05 * p.get("a", 0.0)) * np.sin(T) + 0.05 * p.get("b", 0.0) * np.cos(T)


def test_a_swing_is_no_wall():
    """Below a = 0.6 the machine swings, at a pitch that changes with a, so its derivative does not lead out."""

    def machine(p):
        a, b = p.get("a", 0.0), p.get("b", 0.0)
        swing = max(0.0, 0.6 - a)
        return 0.02 * a * np.cos(T) + (1.0 + 0.05 * b) * np.sin(T) + swing * np.sin((9.0 + 4.0 * a) * T)

    found = refit(machine, {"a": 0.85, "b": -0.4})
    assert found.rms < 1.1
    assert abs(found.point["a"] - 0.85) < 0.1


def test_parameters_stay_within_their_tolerances():
    found = refit(straight, {"a": 1.6, "b": 0.5})
    assert found.point["a"] == pytest.approx(1.0)
    assert found.status == "at_tolerance"
    assert found.rms > 1.5
    assert refit(straight, {"a": 0.9, "b": 0.5}).rms < 1.1


def test_a_straight_way_is_gone_with_few_runs():
    p, nuisance_jacobian = posed(straight, {"a": 0.7, "b": -0.5})
    found = refit_base(p, nuisance_jacobian, simulate_nominal(p, nuisance_jacobian)).fit
    assert found.point == pytest.approx({"a": 0.7, "b": -0.5}, abs=0.06)
    assert found.status == "converged"
    assert sum(len(coarse) + len(exact) for coarse, exact in p.asked) < 25


def test_without_base_parameters_the_baseline_is_the_model_as_delivered():
    p, nuisance_jacobian = posed(straight, {"a": 0.7}, ())
    delivered = simulate_nominal(p, nuisance_jacobian)
    found = refit_base(p, nuisance_jacobian, delivered).fit
    assert found.converged
    assert (found.model == straight({})).all()
    assert found.rms == delivered.fit.rms


def test_the_refit_leaves_no_more_than_the_model_as_delivered():
    """An offset that the sensor's bias takes up at a price; a base parameter that strains it less is no way out."""

    def machine(p):
        return 0.1 * np.sin(T) + 0.3 * p.get("late", 0.0) + 0.25 * abs(p.get("a", 0.0)) * np.sign(np.sin(3.0 * T))

    p, nuisance_jacobian = posed(machine, {"late": 1.0})
    delivered = simulate_nominal(p, nuisance_jacobian)
    assert refit_base(p, nuisance_jacobian, delivered).fit.rms <= delivered.fit.rms * 1.01


def rubbing(p):
    """An accepted effect that begins to act at 0.8 only: at 0 it has no derivative."""
    return straight(p) + 0.3 * max(0.0, p.get("f", 0.0) - 0.8) * np.cos(5 * T)


def test_an_accepted_effect_is_refitted_from_the_size_that_serves_best():
    f = EffectCandidate("f", "rubs", "f", (EstimatedParameter("f", "effect", 0.0, 1.0, 0.0, 5.0, 3.0),)).as_accepted()
    p, nuisance_jacobian = posed(rubbing, {"a": 0.4, "b": -0.3, "f": 2.0}, (*BASE, *f.parameters))
    delivered = simulate_nominal(p, nuisance_jacobian)
    found = refit_base(replace(p, accepted=(f,)), nuisance_jacobian, delivered).fit
    assert found.rms < 1.1
    assert found.point["f"] == pytest.approx(2.0, abs=0.05)


def test_a_refit_is_taken_up_where_it_stood():
    p, nuisance_jacobian = posed(straight, {"a": 0.4, "b": -0.3})
    delivered = simulate_nominal(p, nuisance_jacobian)
    before = refit_base(p, nuisance_jacobian, delivered)
    p.asked.clear()
    again = resume_refit(p, nuisance_jacobian, delivered, before.fit.point)
    assert again is not None
    assert again.fit.rms == pytest.approx(before.fit.rms, abs=1e-3)
    nowhere, columns = posed(lambda q: None if "a" in q else straight(q), {})
    assert resume_refit(nowhere, columns, delivered, {"a": 0.3}) is None


def test_base_parameters_at_the_ends_of_their_tolerances_are_strained():
    p, nuisance_jacobian = posed(straight, {"a": 5.0, "b": -5.0})
    delivered = simulate_nominal(p, nuisance_jacobian)
    assert is_strained(p, refit_base(p, nuisance_jacobian, delivered))
    assert not is_strained(p, delivered)
