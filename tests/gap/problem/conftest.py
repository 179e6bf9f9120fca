"""A campaign of a toy with its catalogue."""

import pytest
from deepsea_cosim.gap.campaign.read import read
from deepsea_cosim.gap.campaign.read_catalogue import load

from tests.gap.oscillator import campaign, measure


@pytest.fixture
def posed(toys, tmp_path):
    """Campaign and catalogue of an oscillator with nothing wrong."""
    told = read(campaign(tmp_path, toys, [measure(1, lambda t, x, v: 0.0)]))
    return told, load(told.effects)
