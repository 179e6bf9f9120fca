"""Steps of the search on formulas, so that the answer is known."""

from types import SimpleNamespace

import numpy as np
import pytest
from deepsea_cosim.gap.estimation.gauss_newton import WIDE, fit, nuisance_columns, run_fit
from deepsea_cosim.gap.problem.observations import gather
from deepsea_cosim.gap.problem.problem import EffectCandidate, EstimatedParameter
from deepsea_cosim.gap.selection import greedy as search
from deepsea_cosim.gap.selection.greedy import Hypothesis
from deepsea_cosim.gap.selection.pipeline import _pairs

T = np.linspace(0.0, 10.0, 800)
NOISE = 0.01
BASE = (EstimatedParameter("a", "base", 1.0, 0.05, -1.0, 1.0, 0.6),)


def effect(name):
    return EffectCandidate(name, name, name, (EstimatedParameter(name, "effect", 0.0, 1.0, 0.0, 8.0, 3.0),))


def problem(machine, truth, candidates):
    y = machine(truth) + np.random.default_rng(0).normal(0.0, NOISE, len(T))
    observations = gather([(0, 0, "m.x", T, y, NOISE, None, True)])
    p = SimpleNamespace(observations=observations, runs=[0], difference=1e-4, smooth={}, hurry=lambda: False, base=BASE, factor=1)
    p.candidates = candidates
    p.evaluate = p.exact = lambda points: [machine(q) for q in points]
    p.answer = lambda a, b: (p.evaluate(a), p.exact(b))
    return p, nuisance_columns(p, machine({}))


def fitted(p, nuisance_jacobian, candidates, start):
    parameters = (*BASE, *(u for c in candidates for u in c.parameters))
    return Hypothesis(candidates, run_fit(p, fit(p, parameters, np.array(start), nuisance_jacobian, 8)))


def test_an_effect_that_is_hardly_there_gives_way_to_a_base_parameter_that_does_the_same():
    """The base parameter drifts the machine only beyond 0.1, without derivative below; a trace of a leak does, too."""
    leak = effect("leak")

    def machine(p):
        drift = max(0.0, p.get("a", 0.0) - 0.1) + 10.0 * p.get("leak", 0.0)
        return np.sin(T) + 0.3 * drift * np.tanh(T - 5.0) ** 3

    p, nuisance_jacobian = problem(machine, {"a": 0.3}, (leak,))
    winner = fitted(p, nuisance_jacobian, (leak,), [0.0, 0.02])
    assert winner.fit.rms < 1.1
    assert winner.fit.normalised[1] < search.HARDLY
    assert fitted(p, nuisance_jacobian, (), [winner.fit.normalised[0]]).fit.rms > 2.0
    left = search.drop_effect(p, winner, leak, nuisance_jacobian, search.QUICK)
    assert left.candidates == ()
    assert left.fit.rms < 1.1


def test_without_a_large_effect_nothing_else_is_tried():
    leak = effect("leak")
    p, nuisance_jacobian = problem(lambda p: np.sin(T) + 0.3 * p.get("leak", 0.0) * np.cos(3.0 * T), {"leak": 1.0}, (leak,))
    winner = fitted(p, nuisance_jacobian, (leak,), [0.0, 0.5])
    points = []
    p.evaluate = lambda q: points.extend(q) or [np.sin(T) for _ in q]
    search.drop_effect(p, winner, leak, nuisance_jacobian, search.QUICK)
    assert points
    assert all(abs(q["a"] - winner.fit.normalised[0]) <= WIDE for q in points)


def test_a_second_effect_that_shows_only_beside_the_first_is_found():
    """The valve's flow counts only once the narrow line lets some through; a droop shows at once but is wrong."""
    line, *_ = candidates = effect("line"), effect("valve"), effect("droop")

    def machine(p):
        through = p.get("line", 0.0)
        made = np.sin(T) + 0.05 * p.get("a", 0.0) * np.cos(T) + 0.2 * through * np.sin(2.0 * T)
        return made + 0.1 * max(0.0, through - 1.5) * p.get("valve", 0.0) * np.cos(4.0 * T) + 0.1 * p.get("droop", 0.0)

    p, nuisance_jacobian = problem(machine, {"line": 3.0, "valve": 2.0}, candidates)
    baseline, single = fitted(p, nuisance_jacobian, (), [0.0]), fitted(p, nuisance_jacobian, (line,), [0.0, 1.0])
    assert baseline.fit.rms > search.MUCH
    found = search.screen_effects(p, baseline.fit, nuisance_jacobian)
    assert not any(s.label == "valve" and s.gain > 0.01 for s in found)
    best = min(_pairs(p, baseline, [single], found, nuisance_jacobian), key=lambda h: h.penalised_deviance)
    assert best.ids == ("line", "valve")
    assert best.fit.point["valve"] == pytest.approx(2.0, rel=0.05)
