"""Macro steps where an effect makes the machine depend on them, on a formula that swings from a threshold on."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from deepsea_cosim.gap.estimation.nuisances import nuisance_jacobian_at
from deepsea_cosim.gap.problem.parameters import EffectCandidate, EstimatedParameter
from deepsea_cosim.gap.search.baseline import refit_base, simulate_nominal
from deepsea_cosim.gap.search.polish import polish
from deepsea_cosim.gap.search.starts import exact_hypotheses_at
from deepsea_cosim.gap.search.step_refinement import refine_fit_step, refine_macro_step, refit_with_exact_step
from deepsea_cosim.gap.search.widening import widen_derivatives
from deepsea_cosim.gap.selection.hypothesis import Hypothesis

from tests.gap.formula import FormulaProblem, measured

from .made import T, start

GAIN = EstimatedParameter("a", "base", 1.0, 0.05, -1.0, 1.0, 0.6)
DELAY = EffectCandidate("delay", "late", "timing", (EstimatedParameter("m.e", "effect", 0.0, 1.0, 0.0, 8.0, 3.0),))


def machine(p, late=0.0):
    """Swings once the delay is above 2.5; the step adds to the delay, and is not seen before."""
    swing = max(0.0, p.get("m.e", 0.0) + late - 2.5)
    return (1.0 + 0.05 * p.get("a", 0.0)) * np.sin(T) + 0.4 * swing * np.sin(9.0 * T)


def problem(truth, late):
    """late: what a macro step of 1 adds to the delay."""
    p = FormulaProblem(lambda point, step: machine(point, late * step), measured(machine, truth, T), (GAIN,))
    p = p.with_discretisation(coarsening=4)
    return p, nuisance_jacobian_at(p, machine({}))


def fitted(p, nuisance_jacobian):
    """The baseline, and the delay."""
    swinging = start(p, nuisance_jacobian, [DELAY], {"m.e": 4.0})
    delay = polish(p, [swinging], nuisance_jacobian, p.settings.search.polish_rounds)[0]
    return refit_base(p, nuisance_jacobian, simulate_nominal(p, nuisance_jacobian)), delay


def test_steps_are_halved_while_the_best_fit_depends_on_them():
    p, nuisance_jacobian = problem({"m.e": 4.6}, late=0.4)
    baseline, delay = fitted(p, nuisance_jacobian)
    assert delay.fit.point["m.e"] == pytest.approx(4.2, abs=0.02)
    halved, (delay, baseline) = refine_macro_step(p, [delay, baseline], nuisance_jacobian)
    assert halved.macro_step == pytest.approx(0.5**p.settings.numerics.max_halvings)
    assert halved.fit_step == p.fit_step, "quick runs stay as quick"
    assert delay.fit.point["m.e"] == pytest.approx(4.6 - 0.4 * halved.macro_step, abs=0.02)
    assert baseline.candidates == ()
    assert baseline.fit.rms > 10.0 * delay.fit.rms


def test_steps_stay_where_the_best_fit_does_not_depend_on_them():
    p, nuisance_jacobian = problem({"a": 1.0, "m.e": 1.0}, late=0.4)
    found, _ = fitted(p, nuisance_jacobian)
    kept, (baseline,) = refine_macro_step(p, [found], nuisance_jacobian)
    assert kept.macro_step == 1.0
    assert baseline is found


def walled(steps_that_swing):
    """A machine without effects whose runs of some steps swing where the way to the data goes on, its refit so."""

    def swings(p, step):
        a = p.get("a", 0.0)
        return machine(p) + steps_that_swing(step) * (a > 0.4) * (2.0 + a) * np.sin(9.0 * T)

    p = FormulaProblem(swings, measured(machine, {"a": 0.8}, T, 0.002), (GAIN,)).with_discretisation(coarsening=4)
    nuisance_jacobian = nuisance_jacobian_at(p, machine({}))
    return p, refit_base(p, nuisance_jacobian, simulate_nominal(p, nuisance_jacobian)), nuisance_jacobian


def test_a_refit_gets_past_a_wall_that_only_long_steps_have():
    p, baseline, nuisance_jacobian = walled(lambda step: step > 2.5)
    assert baseline.fit.point["a"] < 0.4
    refined, (found,) = refit_with_exact_step(p, baseline, nuisance_jacobian)
    assert found.fit.point["a"] == pytest.approx(0.8, abs=0.02)
    assert found.fit.converged
    assert refined.discretisation.coarsening == 2
    again, (same,) = refit_with_exact_step(refined, found, nuisance_jacobian)
    assert (again, same) == (refined, found)


def test_a_wall_that_exact_runs_have_too_is_the_machines():
    p, baseline, nuisance_jacobian = walled(lambda step: True)
    refined, (found,) = refit_with_exact_step(p, baseline, nuisance_jacobian)
    assert (refined, found) == (p, baseline)


def test_the_refit_keeps_its_steps_where_shorter_ones_do_not_run():
    p, baseline, nuisance_jacobian = walled(lambda step: step > 2.5)
    stalls = replace(p, model=lambda point, step: None if step == 2.0 else p.model(point, step))
    refined, (found,) = refit_with_exact_step(stalls, baseline, nuisance_jacobian)
    assert refined.discretisation.coarsening == 4
    assert found.penalised_deviance < baseline.penalised_deviance - 20.0


def test_steps_of_a_fits_runs_are_halved_while_they_are_far_from_exact_ones_at_the_best():
    truth = machine({"a": 0.4, "m.e": 4.6})
    hunting = FormulaProblem(  # where it is delayed, and in steps above 1.5
        lambda point, step: machine(point) + (step > 1.5) * point.get("m.e", 0.0) * np.sin(7.0 * T),
        measured(lambda _: truth, {}, T), (GAIN,),
    ).with_discretisation(coarsening=4)  # fmt: skip
    nuisance_jacobian = nuisance_jacobian_at(hunting, machine({}))
    baseline = refit_base(hunting, nuisance_jacobian, simulate_nominal(hunting, nuisance_jacobian))
    (there,) = exact_hypotheses_at(hunting, [((DELAY,), {"m.e": 4.4})], nuisance_jacobian)
    refined, (best, *_, last) = refine_fit_step(hunting, [there, baseline], nuisance_jacobian)
    assert refined.discretisation.coarsening == 1
    assert best.fit.point["m.e"] == pytest.approx(4.6, abs=0.02)
    assert best.fit.rms == pytest.approx(1.0, abs=0.1)
    assert last.candidates == ()
    at_ease, _ = refine_fit_step(hunting, [baseline, there], nuisance_jacobian)
    assert at_ease is hunting, "what is far at others than the best does not count"


def test_hypotheses_far_behind_are_laid_aside():
    p, nuisance_jacobian = problem({"m.e": 4.6}, late=0.4)
    baseline, delay = fitted(p, nuisance_jacobian)
    crowd = [delay, *[Hypothesis((), baseline.fit) for _ in range(p.settings.numerics.refitted)]]
    _, (best, *_, last) = refine_macro_step(p, crowd, nuisance_jacobian)
    assert best.candidates == (DELAY,)
    assert last is crowd[-1]


def test_the_judged_fits_stay_where_they_are():
    p, nuisance_jacobian = problem({"a": 0.3, "m.e": 4.6}, late=0.0)
    baseline, delay = fitted(p, nuisance_jacobian)
    wide = widen_derivatives(p, [delay, baseline], nuisance_jacobian)
    for before, after in zip([delay, baseline], wide, strict=True):
        assert after.fit.point == before.fit.point
        assert after.candidates == before.candidates
        assert after.fit.rms == pytest.approx(before.fit.rms, rel=1e-3)
    assert wide[0].fit.jacobian[:, 1] == pytest.approx(0.4 * np.sin(9.0 * T), abs=1e-6)
