"""Prior probabilities of hypotheses."""

import numpy as np
from deepsea_cosim.gap.estimation.fit import Fit
from deepsea_cosim.gap.problem.parameters import EffectCandidate, EstimatedParameter
from deepsea_cosim.gap.selection.evidence import prior
from deepsea_cosim.gap.selection.hypothesis import Hypothesis

from tests.gap.formula import FormulaProblem, one_channel

FIT = Fit((), *[np.zeros(0)] * 4, 0, np.zeros(0), np.zeros(0), 1.0)


def test_prior_of_one_sensors_effect_in_two_channels():
    bias = EstimatedParameter("sensor.m.x.bias", "sensor", 0.0, 1.0, -1.0, 1.0, 3.0)
    one = tuple(EffectCandidate("bias", "bias", "sensor", (bias,), 0.5) for _ in range(2))
    nothing = one_channel(np.arange(2.0), np.zeros(2), 1.0)
    problem = FormulaProblem(lambda point, step: None, nothing, candidates=one)
    assert 0.0 < prior(problem, Hypothesis(one, FIT)) < prior(problem, Hypothesis((), FIT))
