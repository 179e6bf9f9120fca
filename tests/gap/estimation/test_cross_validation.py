"""What a fit says about stretches of time that it has not seen."""

import numpy as np
import pytest
from deepsea_cosim.gap.estimation.cross_validation import folds, predict_folds
from deepsea_cosim.gap.problem.noise import rms

from .wave import T, X, problem, solve, wave


def test_left_out_folds_are_predicted_from_the_rest():
    p = problem(wave, {"a": 0.3, "b": 0.1, "c": 0.1})
    found, nuisance_jacobian = solve(p, X)
    settings = p.settings.validation
    masks = folds(p.observations, settings.folds, settings.folds)
    assert np.sum(masks, axis=0).tolist() == [1] * len(T)
    held, spread = predict_folds(p, found, nuisance_jacobian)
    assert np.all((spread >= 1.0) & (spread < 1.5))
    assert rms(held) >= found.rms
    assert rms(held) == pytest.approx(1.0, abs=0.1)
