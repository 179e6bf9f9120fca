"""The refit of the base parameters where the way to the data is not straight."""

from types import SimpleNamespace

import numpy as np
from deepsea_cosim.gap.estimation.gauss_newton import nuisance_columns
from deepsea_cosim.gap.problem.observations import gather
from deepsea_cosim.gap.problem.problem import EstimatedParameter
from deepsea_cosim.gap.selection.pipeline import _refit

T = np.linspace(0.0, 10.0, 800)
NOISE = 0.01
BASE = tuple(EstimatedParameter(name, "base", 1.0, 0.05, -1.0, 1.0, 0.6) for name in "ab")


def refit(machine, truth):
    y = machine(truth) + np.random.default_rng(0).normal(0.0, NOISE, len(T))
    observations = gather([(0, 0, "m.x", T, y, NOISE, None, True)])
    p = SimpleNamespace(observations=observations, runs=[0], difference=1e-4, smooth={}, hurry=lambda: False, base=BASE, factor=1)
    p.evaluate = lambda points: [machine(q) for q in points]
    p.answer = lambda a, b: (p.evaluate(a), p.evaluate(b))
    return _refit(p, nuisance_columns(p, machine({"a": 0.0, "b": 0.0}))).fit


def test_a_swing_is_no_wall():
    """Below a = 0.6 the machine swings, at a pitch that changes with a, so its derivative does not lead out."""

    def machine(p):
        swing = max(0.0, 0.6 - p["a"])
        slow = 0.02 * p["a"] * np.cos(T) + (1.0 + 0.05 * p["b"]) * np.sin(T)
        return slow + swing * np.sin((9.0 + 4.0 * p["a"]) * T)

    found = refit(machine, {"a": 0.85, "b": -0.4})
    assert found.rms < 1.1
    assert abs(found.point["a"] - 0.85) < 0.1


def test_parameters_stay_within_their_tolerances():
    def machine(p):
        return (1.0 + 0.05 * p["a"]) * np.sin(T) + 0.05 * p["b"] * np.cos(T)

    found = refit(machine, {"a": 1.6, "b": 0.5})
    assert found.point["a"] == 1.0
    assert found.rms > 1.5
    assert refit(machine, {"a": 0.9, "b": 0.5}).rms < 1.1
