"""The refit of the base parameters where the way to the data is not straight."""

import numpy as np
from deepsea_cosim.gap.estimation.nuisances import nuisance_columns
from deepsea_cosim.gap.problem.parameters import EstimatedParameter
from deepsea_cosim.gap.selection.baseline import refit_base

from tests.gap.formula import FormulaProblem, at_any_step, measured

T = np.linspace(0.0, 10.0, 800)
BASE = tuple(EstimatedParameter(name, "base", 1.0, 0.05, -1.0, 1.0, 0.6) for name in "ab")


def refit(machine, truth):
    p = FormulaProblem(at_any_step(machine), measured(machine, truth, T), BASE)
    return refit_base(p, nuisance_columns(p, machine({"a": 0.0, "b": 0.0}))).fit


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
