"""Effects that act alike, tried in each other's place, where a bank foretells badly what the other would do."""

from __future__ import annotations

import numpy as np
import pytest
from deepsea_cosim.gap.search.polish import polish
from deepsea_cosim.gap.search.relatives import swap_relatives

from .made import T, effect, posed, start

DELAY, LAG, LEAK = effect("delay", 0.0, group="timing"), effect("lag", 0.0, group="timing"), effect("leak", 0.0)
ALL = [DELAY, LAG, LEAK]


def loop(p):
    """A loop that a delay or a lag makes swing, each with a frequency of its own; a leak drifts."""
    delay, lag = p.get("delay", 0.0), p.get("lag", 0.0)
    swing = max(0.0, delay - 1.0) * np.sin((6.0 - 0.4 * delay) * T) + max(0.0, lag - 1.0) * np.sin(4.5 * T)
    return (1.0 + 0.05 * p.get("a", 0.0)) * np.sin(0.6 * T) + 0.3 * swing + 0.05 * p.get("leak", 0.0) * T


def stood(p, nuisance_jacobian, candidates, point):
    return polish(p, [start(p, nuisance_jacobian, candidates, point)], nuisance_jacobian, 4)[0]


def test_the_right_one_takes_the_place_of_what_acts_like_it():
    p, N = posed(loop, {"a": 0.4, "delay": 2.9}, ALL)
    wrong = stood(p, N, [LAG], {"lag": 1.5})
    assert wrong.fit.rms > 10.0
    found = swap_relatives(p, [wrong], N)
    assert found[0].ids == ("delay",)
    assert found[0].fit.rms == pytest.approx(1.0, abs=0.1)
    assert found[0].fit.point["delay"] == pytest.approx(2.9, abs=0.02)
    assert wrong in found


def test_the_others_stay_beside_it():
    p, N = posed(loop, {"delay": 2.9, "leak": 1.5}, ALL)
    wrong = stood(p, N, [LAG, LEAK], {"lag": 1.5, "leak": 1.5})
    found = swap_relatives(p, [wrong], N)
    assert found[0].ids == ("delay", "leak")
    assert found[0].fit.point["leak"] == pytest.approx(1.5, abs=0.05)


def test_one_that_is_in_at_a_wrong_size_does_alone():
    p, N = posed(loop, {"delay": 2.9}, ALL)
    both = stood(p, N, [LAG, DELAY], {"lag": 1.5, "delay": 0.5})
    assert both.fit.rms > 10.0
    found = swap_relatives(p, [both], N)
    assert found[0].ids == ("delay",)
    assert found[0].fit.point["delay"] == pytest.approx(2.9, abs=0.02)


def test_what_stood_by_the_wrong_one_goes_with_it():
    """The leak has nothing to do beside the right effect: the set without it is fitted, too."""
    p, N = posed(loop, {"delay": 2.9}, ALL)
    wrong = stood(p, N, [LAG, LEAK], {"lag": 1.5, "leak": 0.5})
    assert swap_relatives(p, [wrong], N)[0].ids == ("delay",)


def test_the_right_one_keeps_its_place():
    p, N = posed(loop, {"delay": 2.9}, ALL)
    right = stood(p, N, [DELAY], {"delay": 2.8})
    assert swap_relatives(p, [right], N)[0].ids == ("delay",)


def test_what_has_no_relatives_costs_nothing():
    p, N = posed(loop, {"leak": 1.0}, ALL)
    alone = stood(p, N, [LEAK], {"leak": 0.8})
    before = len(p.asked)
    assert swap_relatives(p, [alone], N) == [alone]
    assert len(p.asked) == before


def test_a_relative_that_does_not_run_is_passed_over():
    p, N = posed(lambda q: None if q.get("delay") else loop(q), {"lag": 1.9}, ALL)
    stands = stood(p, N, [LAG], {"lag": 1.8})
    assert swap_relatives(p, [stands], N)[0].ids == ("lag",)


def test_asked_to_stop_what_is_there_stays():
    from dataclasses import replace

    p, N = posed(loop, {"delay": 2.9}, ALL)
    wrong = stood(p, N, [LAG], {"lag": 1.5})
    assert swap_relatives(replace(p, stop_requested=True), [wrong], N) == [wrong]
