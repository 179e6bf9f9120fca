"""What is left, in words."""

import numpy as np
import pytest
from deepsea_cosim.gap.analysis.character import Character, describe_residual, nearest_effects
from deepsea_cosim.gap.analysis.localisation import localise
from deepsea_cosim.gap.analysis.residual_structure import Structure
from deepsea_cosim.gap.problem.observations import RawBlock, gather

from tests.gap.formula import FormulaProblem

T = np.arange(4000) / 100.0
BLOCKS = [RawBlock(0, k, f"m.{name}", T, np.zeros(len(T)), 1.0, None, True) for k, name in enumerate("xp")]
PROBLEM = FormulaProblem(lambda point, step: None, gather(BLOCKS), labels=("m.x", "m.p"))


def described(x, p, masks=None, structure=None):
    """The character of residuals of two channels, noise added."""
    noise = np.random.default_rng(0).normal(size=2 * len(T))
    residual = noise + np.concatenate([x, p])
    return describe_residual(PROBLEM, residual, localise(PROBLEM, residual, masks or {}), structure)


NOTHING = np.zeros(len(T))


def test_noise_has_no_character():
    found = described(NOTHING, NOTHING)
    assert found == Character("", 0.0, "", "", None)
    assert found.text == "within the noise"


@pytest.mark.parametrize("frequency", [0.3, 4.0])
def test_channel_and_frequency_of_a_swing(frequency):
    found = described(NOTHING, 5.0 * np.sin(2 * np.pi * frequency * T))
    assert found.channel == "m.p"
    assert found.share > 0.95
    low, high = found.frequency
    assert low <= frequency + 0.03
    assert high >= frequency - 0.03
    assert high - low < 0.2
    assert "m.p" in found.text


def test_white_rest_has_no_frequency():
    assert described(3.0 * np.random.default_rng(1).normal(size=len(T)), NOTHING).frequency is None


def test_the_region_in_which_it_is():
    late = np.concatenate([T > 30.0, T > 30.0])
    found = described(6.0 * np.sin(2 * np.pi * T) * (T > 30.0), NOTHING, {"late": late})
    assert found.region == "late"
    assert "late" in found.text


def test_what_it_varies_with_is_told_where_it_is_predictable():
    swing = 5.0 * np.sin(2 * np.pi * T)
    for share, told in ((0.9, "m.p"), (0.0, "")):
        structure = Structure(share, {"m.x": share, "m.p": 0.9}, {"m.x": "m.p", "m.p": "rate of m.x"})
        assert described(swing, NOTHING, structure=structure).varies_with == told


def test_nearest_are_those_that_gain_most_but_for_what_is_named():
    gains = {"a": 3.0, "b": 9.0, "c": 5.0, "d": 0.0, "e": -1.0}
    assert nearest_effects(gains, ["b"], 3) == ("c", "a")
    assert nearest_effects(gains, [], 2) == ("b", "c")
    assert nearest_effects({}, [], 3) == ()
