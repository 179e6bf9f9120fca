"""Effects that do something else in runs of long steps are found with shorter ones."""

from dataclasses import replace

import numpy as np
import pytest
from deepsea_cosim.gap.estimation.nuisances import nuisance_jacobian_at
from deepsea_cosim.gap.search.baseline import refit_base, simulate_nominal
from deepsea_cosim.gap.search.shorter_step import search_with_shorter_step, step_sensitive_effects

from tests.gap.formula import FormulaProblem, measured

from .made import BASE, T, effect, moving, pitch, start

KNOCK, SLIDE = effect("knock"), effect("slide")
machine = moving({"knock": lambda u: 0.02 * u, "slide": lambda u: 0.02 * u})


def knocking(truth, spoils):
    """A machine whose runs of the steps that it spoils blow up once there is a knock."""

    def model(p, step):
        y = machine(p)
        return y + spoils(step) * (p.get("knock", 0.0) != 0.0) * np.sin(pitch(9) * T)

    problem = FormulaProblem(model, measured(machine, truth, T, 0.01), BASE, (KNOCK, SLIDE))
    problem = problem.with_discretisation(coarsening=4)
    nuisance_jacobian = nuisance_jacobian_at(problem, machine({}))
    return (
        problem,
        [refit_base(problem, nuisance_jacobian, simulate_nominal(problem, nuisance_jacobian))],
        nuisance_jacobian,
    )


def test_what_the_long_step_spoils_is_found_at_half_of_it():
    problem, found, nuisance_jacobian = knocking({"knock": 4.0}, lambda step: step > 2.5)
    refined, (best, *others) = search_with_shorter_step(problem, found, nuisance_jacobian)
    assert best.candidates == (KNOCK,)
    assert best.fit.point["knock"] == pytest.approx(4.0, abs=0.2)
    assert best.fit.rms == pytest.approx(1.0, abs=0.1)
    assert refined.discretisation.coarsening == 2
    assert found[0].candidates in [h.candidates for h in others]


def test_where_it_is_not_what_is_missing_the_step_stays():
    problem, found, nuisance_jacobian = knocking({"slide": 4.0}, lambda step: step > 2.5)
    refined, (best, *_) = search_with_shorter_step(problem, found, nuisance_jacobian)
    assert refined is problem
    assert best is found[0]


def test_what_is_the_same_at_both_steps_costs_no_fit():
    problem, found, nuisance_jacobian = knocking({"slide": 4.0}, lambda step: False)
    shorter = problem.with_discretisation(coarsening=2)
    assert step_sensitive_effects(problem, shorter, found[0]) == []
    refined, same = search_with_shorter_step(problem, found, nuisance_jacobian)
    assert (refined, same) == (problem, found)


@pytest.mark.parametrize("truth", [{"knock": 4.0}, {"slide": 4.0}])
def test_corrections_are_those_of_the_step_that_is_gone_on_with(truth):
    """Derivatives are differences to runs of a fit's step: one to a run of another step is the steps' difference."""
    problem, found, nuisance_jacobian = knocking(truth, lambda step: step > 2.5)
    model = problem.model
    problem = replace(problem, model=lambda p, step: model(p, step) + 1e-3 * step * np.cos(T))
    found = [refit_base(problem, nuisance_jacobian, simulate_nominal(problem, nuisance_jacobian))]
    refined, hypotheses = search_with_shorter_step(problem, found, nuisance_jacobian)
    assert len(hypotheses) > 1
    for h in hypotheses:
        (run,) = refined.evaluate([h.fit.point])
        assert h.fit.model - h.fit.correction == pytest.approx(run, abs=1e-12)


def test_a_set_that_may_have_no_further_effect_gets_none():
    problem, found, nuisance_jacobian = knocking({"knock": 4.0}, lambda step: step > 2.5)
    three = [effect(name) for name in ("x", "y", "z")]
    full = start(problem, nuisance_jacobian, three, found[0].fit.point)
    _, hypotheses = search_with_shorter_step(problem, [full, *found], nuisance_jacobian)
    assert max(len(h.candidates) for h in hypotheses) == 3
    assert (KNOCK,) in [h.candidates for h in hypotheses]
