from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from deepsea_cosim.gap.selection.calibration import HALF, SUREST, Calibration
from deepsea_cosim.gap.selection.posterior import NONE, UNKNOWN, causes, features, unknown_probability


def ranked(ids, score, gap=1.0):
    return SimpleNamespace(hypothesis=SimpleNamespace(ids=ids, candidates=ids), score=score, gap=gap)


PLAIN = Calibration(20.0, 0.05, 1.0, 0.0, (-30.0, 0.0, 0.0))


def test_probabilities_add_up_and_follow_the_scores():
    found = causes([ranked((), 10.0), ranked(("a",), 0.0), ranked(("b",), 4.0)], PLAIN, np.ones(3))
    assert [c.effects for c in found] == [("a",), ("b",), NONE, UNKNOWN]
    assert sum(c.probability for c in found) == pytest.approx(1.0)
    assert found[0].probability / found[1].probability == pytest.approx(np.exp(2.0))


def test_a_sensor_in_two_channels_is_one_cause():
    found = causes([ranked(("s",), 0.0), ranked(("s",), 0.0), ranked((), 0.0)], PLAIN, np.ones(3))
    assert found[0].effects == ("s",)
    assert found[0].probability == pytest.approx(2 / 3)


def test_near_rivals_are_named():
    scores = {("a",): 0.0, ("b",): 1.0, ("c",): 40.0, (): 60.0}
    found = causes([ranked(ids, score) for ids, score in scores.items()], PLAIN, np.ones(3))
    assert found[0].ambiguous_with == [("b",)]


def test_unknown_takes_its_share():
    sure = Calibration(20.0, 0.05, 1.0, 0.0, (30.0, 0.0, 0.0))
    found = causes([ranked(("a",), 0.0), ranked((), 9.0)], sure, np.ones(3))
    assert found[0].effects == UNKNOWN
    assert found[0].probability == pytest.approx(1.0)


def test_what_is_left_makes_unknown_likelier_with_the_shipped_calibration():
    shipped = Calibration.load()
    good = unknown_probability(shipped, features(shipped, 100.0, 0.0, 5000))
    bad = unknown_probability(shipped, features(shipped, 100.0, 64.0, 5000))
    assert good < 0.2 < 0.7 < bad


def test_the_same_rest_is_likelier_unknown_where_it_is_more_of_the_gap():
    """What one of the catalogue imitates leaves part of a small gap; a right cause of another law, of a large one."""
    shipped = Calibration.load()
    small, large = (unknown_probability(shipped, features(shipped, baseline, 0.5, 5000)) for baseline in (1.0, 1000.0))
    assert large < 0.3 < 0.5 < small


def test_a_surer_or_less_sure_first_answer_stays_the_first():
    scored = [ranked(("a",), 0.0), ranked(("b",), 0.5), ranked(("c",), 6.0), ranked((), 9.0)]
    plain = causes(scored, PLAIN, np.ones(3))
    for slope, shift in ((3.0, 2.0), (3.0, -4.0), (0.0, -5.0), (50.0, 0.0)):
        told = causes(scored, replace(PLAIN, slope=slope, shift=shift), np.ones(3))
        assert [c.effects for c in told] == [c.effects for c in plain]
        assert sum(c.probability for c in told) == pytest.approx(1.0)
        assert told[0].probability > told[1].probability
        first = plain[0].probability
        odds = slope * np.log(first / (1.0 - first)) + shift
        expected = max(min(1.0 / (1.0 + np.exp(-odds)), SUREST), min(first, HALF))
        if told[0].probability > told[1].probability * (1.0 + 1e-8):
            assert told[0].probability == pytest.approx(expected)
        else:
            assert expected < told[0].probability, "as sure as the second when it must be"
