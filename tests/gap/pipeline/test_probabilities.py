"""The budget's residuals: what an effect does is not calibration's, though calibration may do the same."""

from types import SimpleNamespace

import numpy as np
import pytest
from deepsea_cosim.gap.estimation.nuisances import usual_bias
from deepsea_cosim.gap.pipeline.probabilities import _bias_absorbed_by_nuisance
from deepsea_cosim.gap.settings import DEFAULT

OBSERVATIONS = SimpleNamespace(
    channel=np.array([0, 0, 1, 1]), noise_std=np.array([0.1, 0.2, 0.5, 0.5]), span=np.array([10.0, 4.0]),
    level=np.array([10.0, 4.0]), takes_bias=np.ones(4, bool),
)  # fmt: skip


class Readings(SimpleNamespace):
    def __len__(self):
        return len(self.channel)


def ranked(biases, *candidates):
    fit = SimpleNamespace(nuisances=np.array(biases))
    return SimpleNamespace(
        hypothesis=SimpleNamespace(candidates=candidates, labels=frozenset(c.label for c in candidates), fit=fit)
    )


def effect(label, kind, name):
    return SimpleNamespace(label=label, parameters=(SimpleNamespace(kind=kind, name=name),))


def test_a_bias_that_calibration_takes_over_is_the_effects():
    observations = Readings(**vars(OBSERVATIONS))
    problem = SimpleNamespace(observations=observations, settings=DEFAULT, labels=("a.x", "b.y"))
    state = SimpleNamespace(problem=problem, scoring=problem)
    bias = effect("sensor_bias(b.y)", "sensor", "sensor.b.y.bias")
    friction = effect("friction", "effect", "a.effect.friction.F")
    whole = ranked([0.2, 0.5], bias, friction)
    without = _bias_absorbed_by_nuisance(state, whole, ranked([0.1, 6.5], friction))
    assert without[:2].tolist() == [0.0, 0.0]
    assert without[2:] == pytest.approx(6.0 * usual_bias(problem, 1) / 0.5)
    assert not _bias_absorbed_by_nuisance(state, whole, ranked([0.1, 0.4], bias)).any()
    assert not _bias_absorbed_by_nuisance(state, whole, whole).any()
