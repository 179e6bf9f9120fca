"""Macro steps where an effect makes the machine depend on them, on a formula that swings from a threshold on."""

from types import SimpleNamespace

import numpy as np
import pytest
from deepsea_cosim.gap.estimation.gauss_newton import fit, nuisance_columns, run_fit
from deepsea_cosim.gap.problem import step_size as steps
from deepsea_cosim.gap.problem.observations import gather
from deepsea_cosim.gap.problem.problem import EstimatedParameter
from deepsea_cosim.gap.selection.greedy import Hypothesis

T = np.linspace(0.0, 10.0, 800)
NOISE = 0.01
GAIN = EstimatedParameter("a", "base", 1.0, 0.05, -2.0, 2.0, 0.6)
DELAY = EstimatedParameter("m.e", "effect", 0.0, 1.0, 0.0, 8.0, 3.0)


def machine(p, late):
    """Swings once the delay is above 2.5; the step adds to the delay, and is not seen before."""
    swing = max(0.0, p.get("m.e", 0.0) + late - 2.5)
    return (1.0 + 0.05 * p.get("a", 0.0)) * np.sin(T) + 0.4 * swing * np.sin(9.0 * T)


def problem(truth, late):
    """late: what a macro step of 1 adds to the delay."""
    y = machine(truth, 0.0) + np.random.default_rng(0).normal(0.0, NOISE, len(T))
    observations = gather([(0, 0, "m.x", T, y, NOISE, None, True)])
    p = SimpleNamespace(observations=observations, runs=[0], difference=1e-4, smooth={}, hurry=lambda: False, base=(GAIN,), factor=4)
    p.macro_step, p.richardson_order, p.method = 1.0, 0, "gauss-seidel"
    p.evaluate = lambda points: [machine(q, late * p.macro_step * p.coarsening) for q in points]
    p.exact = lambda points: [machine(q, late * p.macro_step) for q in points]
    p.answer = lambda a, b: (p.evaluate(a), p.exact(b))
    return p


def hypotheses(p, nuisance_jacobian):
    parameters = (GAIN, DELAY)
    made = [Hypothesis((), run_fit(p, fit(p, parameters[:1], np.zeros(1), nuisance_jacobian, 8)))]
    swinging = fit(p, parameters, np.array([0.0, 4.0]), nuisance_jacobian, 8)
    return [*made, Hypothesis((SimpleNamespace(label="delay", parameters=(DELAY,)),), run_fit(p, swinging))]


def test_steps_are_halved_while_the_best_fit_depends_on_them():
    p = problem({"m.e": 4.6}, late=0.4)
    nuisance_jacobian = nuisance_columns(p, machine({}, 0.0))
    baseline, delay = found = hypotheses(p, nuisance_jacobian)
    assert delay.fit.point["m.e"] == pytest.approx(4.2, abs=0.02)
    steps.refine_macro_step(p, found, nuisance_jacobian)
    assert p.macro_step == pytest.approx(0.5**steps.HALVINGS)
    assert delay.fit.point["m.e"] == pytest.approx(4.6 - 0.4 * p.macro_step, abs=0.02)
    assert baseline.fit.rms > 10.0 * delay.fit.rms


def test_steps_stay_where_the_best_fit_does_not_depend_on_them():
    p = problem({"a": 1.0, "m.e": 1.0}, late=0.4)
    nuisance_jacobian = nuisance_columns(p, machine({}, 0.0))
    found = hypotheses(p, nuisance_jacobian)[:1]
    before = found[0].fit
    steps.refine_macro_step(p, found, nuisance_jacobian)
    assert p.macro_step == 1.0
    assert found[0].fit is before


def test_a_hypothesis_far_behind_is_laid_aside():
    p = problem({"m.e": 4.6}, late=0.4)
    nuisance_jacobian = nuisance_columns(p, machine({}, 0.0))
    baseline, delay = hypotheses(p, nuisance_jacobian)
    crowd = [delay, *[Hypothesis((), baseline.fit) for _ in range(steps.REFITTED)]]
    steps.refine_macro_step(p, crowd, nuisance_jacobian)
    assert not crowd[1].finished
    assert crowd[-1].finished
    assert crowd[-1].fit.converged
