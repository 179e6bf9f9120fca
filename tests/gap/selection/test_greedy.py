"""Steps of the search on formulas, so that the answer is known."""

from dataclasses import replace

import numpy as np
import pytest
from deepsea_cosim.gap.estimation.gauss_newton import fit
from deepsea_cosim.gap.estimation.nuisances import nuisance_columns
from deepsea_cosim.gap.estimation.scheduler import run_fit
from deepsea_cosim.gap.problem.parameters import EffectCandidate, EstimatedParameter
from deepsea_cosim.gap.selection.greedy import HARDLY, QUICK, drop_effect
from deepsea_cosim.gap.selection.greedy_screening import MUCH, screen_effects
from deepsea_cosim.gap.selection.greedy_stages import fit_pairs
from deepsea_cosim.gap.selection.hypothesis import Hypothesis

from tests.gap.formula import FormulaProblem, at_any_step, measured

T = np.linspace(0.0, 10.0, 800)
BASE = (EstimatedParameter("a", "base", 1.0, 0.05, -1.0, 1.0, 0.6),)


def effect(name):
    return EffectCandidate(name, name, name, (EstimatedParameter(name, "effect", 0.0, 1.0, 0.0, 8.0, 3.0),))


def problem(machine, truth, candidates):
    p = FormulaProblem(at_any_step(machine), measured(machine, truth, T), BASE, candidates)
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
    assert winner.fit.normalised[1] < HARDLY
    assert fitted(p, nuisance_jacobian, (), [winner.fit.normalised[0]]).fit.rms > 2.0
    left = drop_effect(p, winner, leak, nuisance_jacobian, QUICK)
    assert left.candidates == ()
    assert left.fit.rms < 1.1


def test_without_a_large_effect_nothing_else_is_tried():
    leak = effect("leak")

    def machine(p):
        return np.sin(T) + 0.3 * p.get("leak", 0.0) * np.cos(3.0 * T)

    p, nuisance_jacobian = problem(machine, {"leak": 1.0}, (leak,))
    winner = fitted(p, nuisance_jacobian, (leak,), [0.0, 0.5])
    still = replace(p, model=lambda point, step: np.sin(T), asked=[])
    drop_effect(still, winner, leak, nuisance_jacobian, QUICK)
    points = [point for coarse, exact in still.asked for point in (*coarse, *exact)]
    assert points
    wide = p.settings.fit.wide_step
    assert all(abs(point["a"] - winner.fit.normalised[0]) <= wide for point in points)


def test_a_second_effect_that_shows_only_beside_the_first_is_found():
    """The valve's flow counts only once the narrow line lets some through; a droop shows at once but is wrong."""
    line, *_ = candidates = effect("line"), effect("valve"), effect("droop")

    def machine(p):
        through = p.get("line", 0.0)
        made = np.sin(T) + 0.05 * p.get("a", 0.0) * np.cos(T) + 0.2 * through * np.sin(2.0 * T)
        return made + 0.1 * max(0.0, through - 1.5) * p.get("valve", 0.0) * np.cos(4.0 * T) + 0.1 * p.get("droop", 0.0)

    p, nuisance_jacobian = problem(machine, {"line": 3.0, "valve": 2.0}, candidates)
    baseline, single = fitted(p, nuisance_jacobian, (), [0.0]), fitted(p, nuisance_jacobian, (line,), [0.0, 1.0])
    assert baseline.fit.rms > MUCH
    found = screen_effects(p, baseline.fit, nuisance_jacobian)
    assert not any(s.label == "valve" and s.gain > 0.01 for s in found)
    pairs = fit_pairs(p, baseline, [single], found, nuisance_jacobian)
    best = min(pairs, key=lambda h: h.penalised_deviance)
    assert best.ids == ("line", "valve")
    assert best.fit.point["valve"] == pytest.approx(2.0, rel=0.05)
