"""Macro steps where an effect makes the machine depend on them, on a formula that swings from a threshold on."""

from types import SimpleNamespace

import numpy as np
import pytest
from deepsea_cosim.gap.estimation.gauss_newton import fit, nuisances, went
from deepsea_cosim.gap.problem import step_size as steps
from deepsea_cosim.gap.problem.observations import gather
from deepsea_cosim.gap.problem.problem import Unknown
from deepsea_cosim.gap.selection.greedy import Hypothesis

T = np.linspace(0.0, 10.0, 800)
NOISE = 0.01
GAIN = Unknown("a", "base", 1.0, 0.05, -2.0, 2.0, 0.6)
DELAY = Unknown("m.e", "effect", 0.0, 1.0, 0.0, 8.0, 3.0)


def machine(p, late):
    """Swings once the delay is above 2.5; the step adds to the delay, and is not seen before."""
    swing = max(0.0, p.get("m.e", 0.0) + late - 2.5)
    return (1.0 + 0.05 * p.get("a", 0.0)) * np.sin(T) + 0.4 * swing * np.sin(9.0 * T)


def problem(truth, late):
    """late: what a macro step of 1 adds to the delay."""
    y = machine(truth, 0.0) + np.random.default_rng(0).normal(0.0, NOISE, len(T))
    obs = gather([(0, 0, "m.x", T, y, NOISE, None, True)])
    p = SimpleNamespace(obs=obs, runs=[0], difference=1e-4, smooth={}, hurry=lambda: False, base=(GAIN,), factor=4)
    p.fine, p.order, p.method = 1.0, 0, "gauss-seidel"
    p.evaluate = lambda points: [machine(q, late * p.fine * p.factor) for q in points]
    p.exact = lambda points: [machine(q, late * p.fine) for q in points]
    p.answer = lambda a, b: (p.evaluate(a), p.exact(b))
    return p


def hypotheses(p, N):
    unknowns = (GAIN, DELAY)
    made = [Hypothesis((), went(p, fit(p, unknowns[:1], np.zeros(1), N, 8)))]
    swinging = fit(p, unknowns, np.array([0.0, 4.0]), N, 8)
    return [*made, Hypothesis((SimpleNamespace(label="delay", unknowns=(DELAY,)),), went(p, swinging))]


def test_steps_are_halved_while_the_best_fit_depends_on_them():
    p = problem({"m.e": 4.6}, late=0.4)
    N = nuisances(p, machine({}, 0.0))
    null, delay = found = hypotheses(p, N)
    assert delay.fit.point["m.e"] == pytest.approx(4.2, abs=0.02)
    steps.resolve(p, found, N)
    assert p.fine == pytest.approx(0.5**steps.HALVINGS)
    assert delay.fit.point["m.e"] == pytest.approx(4.6 - 0.4 * p.fine, abs=0.02)
    assert null.fit.rms > 10.0 * delay.fit.rms


def test_steps_stay_where_the_best_fit_does_not_depend_on_them():
    p = problem({"a": 1.0, "m.e": 1.0}, late=0.4)
    N = nuisances(p, machine({}, 0.0))
    found = hypotheses(p, N)[:1]
    before = found[0].fit
    steps.resolve(p, found, N)
    assert p.fine == 1.0
    assert found[0].fit is before


def test_a_hypothesis_far_behind_is_laid_aside():
    p = problem({"m.e": 4.6}, late=0.4)
    N = nuisances(p, machine({}, 0.0))
    null, delay = hypotheses(p, N)
    crowd = [delay, *[Hypothesis((), null.fit) for _ in range(steps.REFITTED)]]
    steps.resolve(p, crowd, N)
    assert not crowd[1].finished
    assert crowd[-1].finished
    assert crowd[-1].fit.converged
