"""Large effects from the model as delivered, on a formula that swings from a threshold on."""

from types import SimpleNamespace

import numpy as np
import pytest
from deepsea_cosim.gap.estimation.gauss_newton import nuisance_columns, rms
from deepsea_cosim.gap.problem import step_size as steps
from deepsea_cosim.gap.problem.observations import gather
from deepsea_cosim.gap.problem.problem import EffectCandidate, EstimatedParameter
from deepsea_cosim.gap.selection import greedy_large as large

T = np.linspace(0.0, 10.0, 800)
NOISE = 0.01
BASE = (EstimatedParameter("a", "base", 1.0, 0.05, -2.0, 2.0, 0.6),)
LOOP = EffectCandidate("loop_delay", "the loop answers late", "timing", (EstimatedParameter("m.e", "effect", 0.0, 1.0, 0.0, 8.0, 3.0),))
DRAG = EffectCandidate("drag", "it is slower", "loss", (EstimatedParameter("m.d", "effect", 0.0, 1.0, 0.0, 8.0, 3.0),))


def machine(p, step=0.0):
    """Swings once the delay is above 2.5; long steps bring that forward."""
    swing = max(0.0, p.get("m.e", 0.0) + step - 2.5)
    slow = 0.02 * p.get("m.d", 0.0)
    return (1.0 + 0.05 * p.get("a", 0.0) - slow) * np.sin(T) + 0.4 * swing * np.sin(9.0 * T)


def problem(truth, error=0.0):
    """error: what a macro step of four adds to the delay."""
    y = machine(truth) + np.random.default_rng(0).normal(0.0, NOISE, len(T))
    observations = gather([(0, 0, "m.x", T, y, NOISE, None, True)])
    p = SimpleNamespace(observations=observations, runs=[0], difference=1e-4, smooth={}, hurry=lambda: False, base=BASE, factor=8)
    p.candidates = LOOP, DRAG
    p.evaluate = lambda points: [machine(q, error * p.coarsening / 4) for q in points]
    p.exact = lambda points: [machine(q) for q in points]
    p.answer = lambda a, b: (p.evaluate(a), p.exact(b))
    return p


def test_an_effect_that_shows_nothing_at_its_usual_size_is_found_at_a_larger_one():
    p = problem({"a": 0.4, "m.e": 4.6})
    nuisance_jacobian = nuisance_columns(p, machine({}))
    starts = large.scan(p, nuisance_jacobian)
    assert starts[0].candidate is LOOP
    assert starts[0].normalised[-1] == 4.0
    best = large.fits(p, starts, nuisance_jacobian)[0]
    assert best.candidates == (LOOP,)
    assert best.fit.point["m.e"] == pytest.approx(4.6, abs=0.02)
    assert best.fit.rms == pytest.approx(1.0, abs=0.1)


def test_macro_steps_are_shortened_until_their_error_is_small_at_the_starts():
    p = problem({"m.e": 4.6}, error=1.0)
    starts = large.scan(p, nuisance_columns(p, machine({})))
    assert p.coarsening == large.SCAN
    p.coarsening = 8
    points = [s.point for s in starts]
    steps.shorten_fit_step(p, points, left=20.0)
    assert p.coarsening == steps.SHORTEST
    calm = problem({"m.e": 4.6})
    steps.shorten_fit_step(calm, points, left=20.0)
    assert calm.coarsening == 8


def test_a_start_counts_the_base_parameters_that_follow():
    p = problem({"a": 1.0})
    starts = large.scan(p, nuisance_columns(p, machine({})))
    drag = next(s for s in starts if s.candidate is DRAG)
    assert drag.normalised[0] > 1.0 - 1e-6  # has to make up for the drag
    assert rms(p.observations.whiten(machine(drag.point))) < rms(p.observations.whiten(machine({"m.d": drag.normalised[1]})))
