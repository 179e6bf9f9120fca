"""Macro steps where an effect makes the machine depend on them, on a formula that swings from a threshold on."""

import numpy as np
import pytest
from deepsea_cosim.gap.estimation.gauss_newton import fit
from deepsea_cosim.gap.estimation.nuisances import nuisance_columns
from deepsea_cosim.gap.estimation.scheduler import run_fit
from deepsea_cosim.gap.problem.parameters import EffectCandidate, EstimatedParameter
from deepsea_cosim.gap.selection.greedy_steps import refine_macro_step
from deepsea_cosim.gap.selection.hypothesis import Hypothesis

from tests.gap.formula import FormulaProblem, measured

T = np.linspace(0.0, 10.0, 800)
GAIN = EstimatedParameter("a", "base", 1.0, 0.05, -2.0, 2.0, 0.6)
DELAY = EstimatedParameter("m.e", "effect", 0.0, 1.0, 0.0, 8.0, 3.0)


def machine(p, late=0.0):
    """Swings once the delay is above 2.5; the step adds to the delay, and is not seen before."""
    swing = max(0.0, p.get("m.e", 0.0) + late - 2.5)
    return (1.0 + 0.05 * p.get("a", 0.0)) * np.sin(T) + 0.4 * swing * np.sin(9.0 * T)


def problem(truth, late):
    """late: what a macro step of 1 adds to the delay."""
    p = FormulaProblem(lambda point, step: machine(point, late * step), measured(machine, truth, T), (GAIN,))
    return p.with_discretisation(coarsening=4)


def hypotheses(p, nuisance_jacobian):
    parameters = (GAIN, DELAY)
    baseline = Hypothesis((), run_fit(p, fit(p, parameters[:1], np.zeros(1), nuisance_jacobian, 8)))
    swinging = fit(p, parameters, np.array([0.0, 4.0]), nuisance_jacobian, 8)
    return [baseline, Hypothesis((EffectCandidate("delay", "late", "timing", (DELAY,)),), run_fit(p, swinging))]


def test_steps_are_halved_while_the_best_fit_depends_on_them():
    p = problem({"m.e": 4.6}, late=0.4)
    nuisance_jacobian = nuisance_columns(p, machine({}))
    found = hypotheses(p, nuisance_jacobian)
    assert found[1].fit.point["m.e"] == pytest.approx(4.2, abs=0.02)
    halved, (baseline, delay) = refine_macro_step(p, found, nuisance_jacobian)
    assert halved.macro_step == pytest.approx(0.5**p.settings.numerics.max_halvings)
    assert delay.fit.point["m.e"] == pytest.approx(4.6 - 0.4 * halved.macro_step, abs=0.02)
    assert baseline.fit.rms > 10.0 * delay.fit.rms


def test_steps_stay_where_the_best_fit_does_not_depend_on_them():
    p = problem({"a": 1.0, "m.e": 1.0}, late=0.4)
    nuisance_jacobian = nuisance_columns(p, machine({}))
    found = hypotheses(p, nuisance_jacobian)[:1]
    kept, (baseline,) = refine_macro_step(p, found, nuisance_jacobian)
    assert kept.macro_step == 1.0
    assert baseline.fit is found[0].fit


def test_a_hypothesis_far_behind_is_laid_aside():
    p = problem({"m.e": 4.6}, late=0.4)
    nuisance_jacobian = nuisance_columns(p, machine({}))
    baseline, delay = hypotheses(p, nuisance_jacobian)
    crowd = [delay, *[Hypothesis((), baseline.fit) for _ in range(p.settings.numerics.refitted)]]
    _, left = refine_macro_step(p, crowd, nuisance_jacobian)
    assert not left[1].finished
    assert left[-1].finished
    assert left[-1].fit.converged
