"""What an effect does is not calibration's, though calibration may do the same: in the budget and in the evidence."""

from types import SimpleNamespace

import numpy as np
import pytest
from deepsea_cosim.gap.estimation.nuisances import usual_bias
from deepsea_cosim.gap.pipeline.absorbed_bias import absorbed_bias, energies_without_bias
from deepsea_cosim.gap.settings import DEFAULT

OBSERVATIONS = SimpleNamespace(
    channel=np.array([0, 0, 1, 1]), noise_std=np.array([0.1, 0.2, 0.5, 0.5]), span=np.array([10.0, 4.0]),
    level=np.array([10.0, 4.0]), takes_bias=np.ones(4, bool),
)  # fmt: skip


class Readings(SimpleNamespace):
    def __len__(self):
        return len(self.channel)

    def structured_energy(self, residual):
        return float(np.mean(residual**2))


def ranked(biases, *candidates):
    fit, labels = SimpleNamespace(nuisances=np.array(biases)), frozenset(c.label for c in candidates)
    ids = tuple(sorted(label.split("(")[0] for label in labels))
    hypothesis = SimpleNamespace(candidates=candidates, labels=labels, ids=ids, fit=fit)
    return SimpleNamespace(hypothesis=hypothesis, cv_residual=np.zeros(4), structured_energy=0.01)


def effect(label, kind, name):
    return SimpleNamespace(label=label, parameters=(SimpleNamespace(kind=kind, name=name),))


def test_a_bias_that_calibration_takes_over_is_the_effects():
    observations = Readings(**vars(OBSERVATIONS))
    problem = SimpleNamespace(observations=observations, settings=DEFAULT, labels=("a.x", "b.y"))
    bias = effect("sensor_bias(b.y)", "sensor", "sensor.b.y.bias")
    friction = effect("friction", "effect", "a.effect.friction.F")
    whole = ranked([0.2, 0.5], bias, friction)
    without = absorbed_bias(problem, observations, whole, ranked([0.1, 6.5], friction))
    assert without[:2].tolist() == [0.0, 0.0]
    assert without[2:] == pytest.approx(6.0 * usual_bias(problem, 1) / 0.5)
    assert not absorbed_bias(problem, observations, whole, ranked([0.1, 0.4], bias)).any()
    assert not absorbed_bias(problem, observations, whole, whole).any()


def test_a_set_without_a_sensors_bias_leaves_what_calibration_takes_over_of_it():
    observations = Readings(**vars(OBSERVATIONS))
    problem = SimpleNamespace(observations=observations, settings=DEFAULT, labels=("a.x", "b.y"))
    bias = effect("sensor_bias(b.y)", "sensor", "sensor.b.y.bias")
    friction, leakage = (effect(x, "effect", f"a.effect.{x}.c") for x in ("friction", "leakage"))
    whole, without = ranked([0.0, 0.5], bias, friction), ranked([0.0, 60.5], friction)
    others = [whole, without, ranked([0.0, 60.5]), ranked([0.0, 60.5], leakage), ranked([0.0, 0.4], bias)]
    given_back = 60.0 * usual_bias(problem, 1) / 0.5
    energies = energies_without_bias(problem, whole, others)
    assert energies == pytest.approx({("friction",): given_back**2 / 2, (): given_back**2 / 2})
    assert energies_without_bias(problem, without, others) == {}
