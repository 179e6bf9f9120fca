"""One word for a budget and its probabilities."""

import numpy as np
import pytest
from deepsea_cosim.gap.analysis.budget import Budget, Part
from deepsea_cosim.gap.analysis.verdict import EXPLAINED, IN_PART, NO_GAP, UNEXPLAINED, verdict
from deepsea_cosim.gap.settings import BudgetSettings, PosteriorSettings

NAMED = PosteriorSettings().named
ALLOWED = BudgetSettings().adequate_excess


def word(calibrated, explained, surest, groups=None, adequate=False, scatter=0.0):
    """calibrated, explained: squared normalised residual above the noise."""
    left, nothing = np.sqrt(1.0 + calibrated), np.sqrt(1.0 + explained)
    made = Budget(left, nothing, {}, {}, Part(explained / calibrated, (0.0, 1.0)))
    groups = groups or {"g": surest}
    return verdict(made, {"a": surest, "b": 0.0}, groups, adequate, scatter, PosteriorSettings(), BudgetSettings())


def test_what_each_verdict_takes():
    assert word(9.0, 0.5 * ALLOWED, 0.95) == EXPLAINED
    assert word(9.0, 2.0, 0.95) == IN_PART
    assert word(9.0, 8.0, 0.2) == UNEXPLAINED
    assert word(0.5 * ALLOWED, 0.5 * ALLOWED, 0.2) == NO_GAP


@pytest.mark.parametrize(("probability", "expected"), [(NAMED, IN_PART), (NAMED - 1e-9, UNEXPLAINED)])
def test_an_effect_is_named_from_a_probability_on(probability, expected):
    assert word(9.0, 2.0, probability) == expected


def test_a_group_whose_members_cannot_be_told_apart_is_named_too():
    assert word(9.0, 2.0, 0.4, groups={"g": 0.9}) == IN_PART


def test_a_refit_that_leaves_noise_alone_is_no_gap_whatever_its_size():
    assert word(1.0, 1.0, 0.2, adequate=True) == NO_GAP


def test_stated_scatter_is_no_gap():
    assert word(9.0, 2.0, 0.95, scatter=2.0) == EXPLAINED
    assert word(2.0, 2.0, 0.2, scatter=2.0) == NO_GAP


def test_nothing_in_the_catalogue_is_unexplained():
    made = Budget(3.0, 3.0, {}, {}, Part(1.0, (1.0, 1.0)))
    assert verdict(made, {}, {}, False, 0.0, PosteriorSettings(), BudgetSettings()) == UNEXPLAINED
