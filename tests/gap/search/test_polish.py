"""Fits of sets side by side, with exact runs and small steps near the data, and without one of their effects."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from deepsea_cosim.gap.problem.parameters import EstimatedParameter
from deepsea_cosim.gap.search.baseline import simulate_nominal
from deepsea_cosim.gap.search.polish import polish
from deepsea_cosim.gap.search.sets import Proposal
from deepsea_cosim.gap.search.starts import FitStart, fit_proposals, hypotheses_at
from deepsea_cosim.gap.selection.hypothesis import Hypothesis, penalised_deviance
from scipy.optimize import lsq_linear, minimize

from tests.gap.formula import FormulaProblem, at_any_step, measured

from .made import BASE, LINEAR, P, Q, T, bank_at, effect, moved, moving, pitch, posed, start


def cost_at(p, nuisance_jacobian, parameters, u):
    """The penalised deviance at a point with the nuisances that fit best, from the definition."""
    noise = p.observations.noise_std
    point = {x.name: float(v) for x, v in zip(parameters, u, strict=True)}
    columns = nuisance_jacobian / noise[:, None]
    residual = p.observations.whiten(p.model(point, 1.0))
    count = columns.shape[1]
    A, r = np.concatenate([columns, np.eye(count)]), np.concatenate([residual, np.zeros(count)])
    q = lsq_linear(A, r).x
    left = float(np.sqrt(np.mean((residual - columns @ q) ** 2)))
    strain = sum((v / x.sd) ** 2 for x, v in zip(parameters, u, strict=True))
    return penalised_deviance(left, strain + float(q[:1] @ q[:1]))


def kinked(p):
    """A valve that saturates: earlier the larger the effect, so that a reading is on one side of the kink or on the
    other."""
    return (1.0 + 0.05 * p.get("a", 0.0)) * np.minimum(np.sin(T), 0.9 - 0.2 * p.get("p", 0.0)) + 0.1 * np.cos(3 * T)


@pytest.mark.parametrize("truth", [{"a": 0.3, "p": 1.2}, {"a": -0.5, "p": 0.2}])
def test_a_fit_arrives_where_scipy_does_on_a_kink(truth):
    p, nuisance_jacobian = posed(kinked, truth, [P])
    (found,) = polish(p, [start(p, nuisance_jacobian, [P], {"p": 0.6})], nuisance_jacobian, 5)
    parameters = found.fit.parameters
    wanted = min(
        (
            minimize(lambda u: cost_at(p, nuisance_jacobian, parameters, u), near, method="Nelder-Mead",
                     options={"xatol": 1e-5, "fatol": 1e-5})
            for near in (found.fit.normalised, [truth["a"], truth["p"]])
        ),
        key=lambda x: x.fun,
    )  # fmt: skip
    assert found.penalised_deviance == pytest.approx(cost_at(p, nuisance_jacobian, parameters, found.fit.normalised))
    assert found.penalised_deviance < wanted.fun + 0.5
    assert found.fit.normalised == pytest.approx(wanted.x, abs=0.02)
    assert found.fit.status == "converged"
    assert not found.quick


def test_a_fit_does_not_leave_the_range():
    bounded = effect("p", 0.0, 0.5)
    p, nuisance_jacobian = posed(moving(LINEAR), {"p": 0.9}, [bounded])
    (found,) = polish(p, [start(p, nuisance_jacobian, [bounded], {"p": 0.2})], nuisance_jacobian, 3)
    assert found.fit.point["p"] == pytest.approx(0.5)
    assert found.fit.status == "at_bound"


def test_proposals_are_fitted_side_by_side_and_those_that_do_not_run_are_left_out():
    truth = {"a": 0.4, "p": 0.8, "q": -0.6}
    p, nuisance_jacobian = posed(moving(LINEAR), truth, [P, Q])
    fit = simulate_nominal(p, nuisance_jacobian).fit
    bank = bank_at(p, fit)
    stops = replace(p, model=at_any_step(lambda x: None if x.get("p", 0.0) > 2.0 else moving(LINEAR)(x)), asked=[])
    proposals = [
        Proposal((P, Q), {"a": 0.0, "p": 1.0, "q": -0.3}, 0.0), Proposal((P,), {"a": 0.0, "p": 3.0}, 0.0),
        Proposal((Q,), {"a": 0.0, "q": -1.0}, 0.0),
    ]  # fmt: skip
    both, single = fit_proposals(stops, bank, proposals, nuisance_jacobian, 6)
    assert (both.ids, single.ids) == (("p", "q"), ("q",))
    assert both.fit.point == pytest.approx(truth, abs=0.06)
    assert both.quick
    calls = [len(coarse) for coarse, _ in stops.asked]
    assert calls[:2] == [3, 3], "one run at each start, one for the derivative by each effect's parameter"
    assert max(calls[2:]) <= 2


def test_runs_of_a_polish_are_exact():
    """What the longer step of a fit adds does not stay in its answer."""

    def model(point, step):
        return moving(LINEAR)(point) + 0.03 * (step - 1.0) * np.cos(T)

    observations = measured(moving(LINEAR), {"p": 0.7}, T)
    p = FormulaProblem(model, observations, BASE, (P,)).with_discretisation(coarsening=4)
    nuisance_jacobian = np.zeros((len(T), 2))
    (found,) = polish(p, [start(p, nuisance_jacobian, [P], {"p": 0.3})], nuisance_jacobian, 3)
    assert found.fit.point["p"] == pytest.approx(0.7, abs=0.03)
    assert found.fit.correction == pytest.approx(-0.09 * np.cos(T))
    assert found.fit.rms == pytest.approx(1.0, abs=0.1)


def test_derivatives_are_taken_anew_after_a_look_that_gained_much_only():
    """Near the best the first look brings nearly all that there is; far from it later looks bring much, too."""
    linear, columns = posed(moving(LINEAR), {"a": 0.3, "p": 0.7}, [P])
    begin = start(linear, columns, [P], {"a": 0.3, "p": 0.74})
    linear.asked.clear()
    (found,) = polish(linear, [begin], columns, 4)
    assert 0.5 < begin.penalised_deviance - found.penalised_deviance < 20.0
    assert moved(linear, [len(coarse) for coarse, _ in linear.asked]) == [2]
    assert sum(len(exact) for _, exact in linear.asked) > 1, "it has looked again"

    bent, columns = posed(moving({"p": lambda u: 0.1 * u + 0.2 * u**3}), {"a": 0.3, "p": 1.2}, [P])
    begin = start(bent, columns, [P], {"p": 0.3})
    bent.asked.clear()
    (found,) = polish(bent, [begin], columns, 4)
    assert found.fit.rms < 1.1
    assert len(moved(bent, [len(coarse) for coarse, _ in bent.asked])) > 1


def test_derivatives_that_are_known_are_not_taken_in_the_first_look():
    p, columns = posed(moving(LINEAR), {"a": 0.3, "p": 0.7, "q": 0.5}, [P, Q])
    (near,) = polish(p, [start(p, columns, [P], {"p": 0.6})], columns, 4)
    place = FitStart((P, Q), {**near.fit.point, "q": 0.2}, near.fit.correction, near.fit)
    (begun,) = hypotheses_at(p, [place], columns)
    p.asked.clear()
    (found,) = polish(p, [begun], columns, 1, derivatives_known=True)
    assert [len(coarse) for coarse, _ in p.asked][:2] == [0, 1], "of q alone"
    assert found.fit.point == pytest.approx({"a": 0.3, "p": 0.7, "q": 0.5}, abs=0.06)
    assert found.fit.jacobian[:, 2] == pytest.approx(0.1 * np.cos(pitch(1) * T), abs=1e-6)


def test_what_does_not_run_exactly_stays_as_it_is():
    p, nuisance_jacobian = posed(moving(LINEAR), {"p": 0.7}, [P])
    h = start(p, nuisance_jacobian, [P], {"p": 0.3})
    still = replace(p, model=lambda point, step: None)
    assert polish(still, [h], nuisance_jacobian, 3) == [h]


def test_asked_to_stop_nothing_is_run():
    p, nuisance_jacobian = posed(moving(LINEAR), {"p": 0.7}, [P])
    h = start(p, nuisance_jacobian, [P], {"p": 0.3})
    stopped = replace(p, stop_requested=True, asked=[])
    assert polish(stopped, [h], nuisance_jacobian, 3) == [h]
    assert stopped.asked == []


def test_shapes_are_fitted_with_their_effect():
    """A droop from a threshold on, which is its shape."""
    size = EstimatedParameter("d", "effect", 0.0, 1.0, -8.0, 8.0, 3.0)
    shape = EstimatedParameter("d.v", "effect", 0.0, 1.0, -2.0, 2.0, 1.0, (), True, (-0.5, 0.5))
    droop = replace(effect("d"), parameters=(size, shape))

    def machine(p):
        return np.sin(T) + 0.1 * p.get("d", 0.0) * np.tanh(T - 5.0 + 2.0 * p.get("d.v", 0.0))

    p, nuisance_jacobian = posed(machine, {"d": 0.8, "d.v": 0.9}, [droop], ())
    fit = simulate_nominal(p, nuisance_jacobian).fit
    bank = bank_at(p, fit)
    assert {x.shape for x in bank.responses} == {(-0.5,), (0.5,)}
    (found,) = fit_proposals(p, bank, [Proposal((droop,), {"d": 0.9, "d.v": 0.5}, 0.0)], nuisance_jacobian, 8)
    (found,) = polish(p, [found], nuisance_jacobian, 3)
    assert found.fit.point == pytest.approx({"d": 0.8, "d.v": 0.9}, abs=0.03)
    assert isinstance(found, Hypothesis)
