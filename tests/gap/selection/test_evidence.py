"""Prior probabilities of hypotheses, and how a fit's cost changes around it."""

import numpy as np
import pytest
from deepsea_cosim.gap.estimation.fit import Fit
from deepsea_cosim.gap.problem.parameters import EffectCandidate, EstimatedParameter
from deepsea_cosim.gap.selection.evidence import curvature, prior
from deepsea_cosim.gap.selection.hypothesis import Hypothesis

from tests.gap.formula import FormulaProblem, one_channel

FIT = Fit((), *[np.zeros(0)] * 4, 0, np.zeros(0), np.zeros(0), 1.0)


def test_prior_of_one_sensors_effect_in_two_channels():
    bias = EstimatedParameter("sensor.m.x.bias", "sensor", 0.0, 1.0, -1.0, 1.0, 3.0)
    one = tuple(EffectCandidate("bias", "bias", "sensor", (bias,), 0.5) for _ in range(2))
    nothing = one_channel(np.arange(2.0), np.zeros(2), 1.0)
    problem = FormulaProblem(lambda point, step: None, nothing, candidates=one)
    assert 0.0 < prior(problem, Hypothesis(one, FIT)) < prior(problem, Hypothesis((), FIT))


def test_curvature_of_a_linear_model():
    """What a prior standard deviation along a direction adds is what the model says there, per reading."""
    rng = np.random.default_rng(0)
    J, N, noise = rng.normal(size=(40, 3)), rng.normal(size=(40, 2)), 0.5
    sd = np.array([1.0, 3.0, 0.2])
    kinds = ("base", "effect", "effect")
    parameters = tuple(EstimatedParameter(f"p{k}", kinds[k], 0.0, 1.0, -9.0, 9.0, sd[k]) for k in range(3))
    u, clocks = np.array([0.3, -1.0, 0.1]), np.array([0.7, 5.0])
    fit = Fit(parameters, u, np.zeros(40), J, clocks, 1, np.zeros(40), np.zeros(40), 1.0)
    problem = FormulaProblem(lambda point, step: None, one_channel(np.arange(40.0), np.zeros(40), noise))
    found = curvature(problem, fit, N)
    A = np.concatenate([J * sd, N], axis=1) / noise
    assert sum(found.energy) == pytest.approx((A * A).sum() / 40)
    assert sum(found.shared) == pytest.approx((A[:, [0, 3, 4]] ** 2).sum() / 40)
    # where the fit stands, but for the clock, whose error costs nothing
    stands = np.array([*(u / sd), 0.7, 0.0])
    assert sum(q * q for q in found.place) == pytest.approx(stands @ stands)
    assert np.array(found.energy) @ np.array(found.place) ** 2 == pytest.approx(((A @ stands) ** 2).sum() / 40)
