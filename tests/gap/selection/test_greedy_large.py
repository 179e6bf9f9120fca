"""Large effects from the model as delivered, on a formula that swings from a threshold on."""

import numpy as np
import pytest
from deepsea_cosim.gap.estimation.nuisances import nuisance_columns
from deepsea_cosim.gap.problem.noise import rms
from deepsea_cosim.gap.problem.parameters import EffectCandidate, EstimatedParameter
from deepsea_cosim.gap.selection.greedy_large import SCAN, fits, scan
from deepsea_cosim.gap.selection.greedy_steps import shorten_fit_step

from tests.gap.formula import FormulaProblem, measured

T = np.linspace(0.0, 10.0, 800)
BASE = (EstimatedParameter("a", "base", 1.0, 0.05, -2.0, 2.0, 0.6),)


def candidate(id, address):
    return EffectCandidate(id, id, id, (EstimatedParameter(address, "effect", 0.0, 1.0, 0.0, 8.0, 3.0),))


LOOP, DRAG = candidate("loop_delay", "m.e"), candidate("drag", "m.d")


def machine(p, late=0.0):
    """Swings once the delay is above 2.5; long steps bring that forward."""
    swing = max(0.0, p.get("m.e", 0.0) + late - 2.5)
    slow = 0.02 * p.get("m.d", 0.0)
    return (1.0 + 0.05 * p.get("a", 0.0) - slow) * np.sin(T) + 0.4 * swing * np.sin(9.0 * T)


def problem(truth, error=0.0):
    """error: what runs of a fit with four macro steps in one add to the delay."""

    def model(point, step):
        return machine(point, error * step / 4 if step > 1.0 else 0.0)

    p = FormulaProblem(model, measured(machine, truth, T), BASE, (LOOP, DRAG))
    return p.with_discretisation(coarsening=8)


def test_an_effect_that_shows_nothing_at_its_usual_size_is_found_at_a_larger_one():
    p = problem({"a": 0.4, "m.e": 4.6})
    nuisance_jacobian = nuisance_columns(p, machine({}))
    starts = scan(p, nuisance_jacobian)
    assert starts[0].candidate is LOOP
    assert starts[0].normalised[-1] == 4.0
    best = fits(p, starts, nuisance_jacobian)[0]
    assert best.candidates == (LOOP,)
    assert best.fit.point["m.e"] == pytest.approx(4.6, abs=0.02)
    assert best.fit.rms == pytest.approx(1.0, abs=0.1)


def test_large_effects_are_run_with_steps_that_are_short_enough():
    steps = set()
    p = problem({"m.e": 4.6})
    noted = FormulaProblem(
        lambda point, step: [steps.add(step), machine(point)][1], p.observations, BASE, (LOOP,),
        discretisation=p.discretisation,
    )  # fmt: skip
    scan(noted, nuisance_columns(p, machine({})))
    assert max(steps) == SCAN * p.macro_step


def test_macro_steps_are_shortened_until_their_error_is_small_at_the_starts():
    p = problem({"m.e": 4.6}, error=1.0)
    points = [s.point for s in scan(p, nuisance_columns(p, machine({})))]
    assert shorten_fit_step(p, points, left=20.0).discretisation.coarsening == p.settings.numerics.least_coarsening
    calm = problem({"m.e": 4.6})
    assert shorten_fit_step(calm, points, left=20.0).discretisation.coarsening == 8


def test_a_start_counts_the_base_parameters_that_follow():
    p = problem({"a": 1.0})
    starts = scan(p, nuisance_columns(p, machine({})))
    drag = next(s for s in starts if s.candidate is DRAG)
    assert drag.normalised[0] > 1.0 - 1e-6  # has to make up for the drag
    alone = machine({"m.d": drag.normalised[1]})
    assert rms(p.observations.whiten(machine(drag.point))) < rms(p.observations.whiten(alone))
