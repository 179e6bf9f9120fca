"""The budget of made residuals whose energies are known."""

import numpy as np
import pytest
from deepsea_cosim.gap.analysis.budget import Alternative, budget, split
from deepsea_cosim.gap.problem.observations import RawBlock, gather
from deepsea_cosim.gap.settings import BootstrapSettings

T = np.arange(4000) / 100.0
SETTINGS = BootstrapSettings(form=0.0)
GROUPS = {"a": "first", "b": "second", "c": "second"}
ONE = gather([RawBlock(0, 0, "m.x", T, np.zeros(len(T)), 1.0, None, True)])
TWO = gather([RawBlock(0, k, f"m.{k}", T, np.zeros(len(T)), 1.0, None, True) for k in range(2)])


def level(excess, observations=ONE):
    """A residual whose every square is 1 + excess, of either sign in turn."""
    return np.sqrt(1.0 + excess) * np.where(np.arange(len(observations)) % 2, 1.0, -1.0)


def alternative(excess, probability=1.0, observations=ONE):
    """excess: squared normalised residual above the noise that each set leaves, by the letters of its effects."""
    return Alternative(probability, {frozenset(s): level(e, observations) for s, e in excess.items()})


PAIR = {"": 10.0, "a": 4.0, "b": 7.0, "ab": 1.0}
"""Alone a explains 6, b 3, and both 9 of 10."""


def test_shares_of_effects_that_do_not_meet():
    found = split([alternative(PAIR)])
    assert found.effects == pytest.approx({"a": 0.6, "b": 0.3})
    assert found.unexplained == pytest.approx(0.1)
    assert found.calibrated == pytest.approx(np.sqrt(11.0))
    assert found.explained == pytest.approx(np.sqrt(2.0))


def test_effects_that_imitate_each_other_share_what_either_explains():
    found = split([alternative({"": 10.0, "a": 2.0, "b": 2.0, "ab": 2.0})])
    assert found.effects == pytest.approx({"a": 0.4, "b": 0.4})
    assert found.unexplained == pytest.approx(0.2)


def test_an_effect_that_makes_held_out_data_worse_explains_nothing():
    """And both together explain what they leave, not what the other one would leave alone."""
    found = split([alternative({"": 10.0, "a": 2.0, "b": 11.0, "ab": 3.0})])
    assert found.effects == pytest.approx({"a": 0.7, "b": 0.0})
    assert found.unexplained == pytest.approx(0.3)
    assert found.explained == pytest.approx(2.0)


def test_what_is_worse_than_the_refit_is_said_to_be():
    found = split([alternative({"": 3.0, "a": 8.0})])
    assert found.effects == {"a": 0.0}
    assert found.unexplained == 1.0
    assert found.explained == pytest.approx(3.0)


def test_hypotheses_are_averaged_with_their_probabilities():
    alternatives = [alternative(PAIR, 0.75), alternative({"": 10.0, "c": 5.0}, 0.25)]
    found = split(alternatives)
    assert found.effects == pytest.approx({"a": 0.45, "b": 0.225, "c": 0.125})
    assert found.unexplained == pytest.approx(0.75 * 0.1 + 0.25 * 0.5)
    assert found.explained**2 - 1.0 == pytest.approx(10.0 * found.unexplained)
    whole = budget(ONE, alternatives, GROUPS, SETTINGS)
    assert whole.groups["second"].share == pytest.approx(0.35)
    assert sum(p.share for p in whole.groups.values()) + whole.unexplained.share == pytest.approx(1.0)


def test_parts_add_up_in_all_and_in_each_channel():
    rng = np.random.default_rng(0)
    size = {"": 3.0, "a": 2.0, "b": 2.5, "ab": 1.4}
    made = {frozenset(s): rng.normal(0.0, sd, len(TWO)) * (1.0 + TWO.channel) for s, sd in size.items()}
    alternatives = [Alternative(1.0, made)]
    for mask in (slice(None), TWO.channel == 0, TWO.channel == 1, TWO.time > 30.0):
        found = split(alternatives, mask)
        assert sum(found.effects.values()) + found.unexplained == pytest.approx(1.0)
        assert min(*found.effects.values(), found.unexplained) >= 0.0
    whole = budget(TWO, alternatives, GROUPS, SETTINGS)
    assert sum(p.share for p in whole.groups.values()) + whole.unexplained.share == pytest.approx(1.0)
    assert whole.effects == split(alternatives).effects


def test_an_effect_explains_the_channel_in_which_it_acts():
    left = {frozenset(): level(8.0, TWO), frozenset("a"): np.where(TWO.channel == 0, level(0, TWO), level(8.0, TWO))}
    alternatives = [Alternative(1.0, left)]
    assert split(alternatives, TWO.channel == 0).effects["a"] == pytest.approx(1.0)
    assert split(alternatives, TWO.channel == 1).effects["a"] == pytest.approx(0.0)
    assert split(alternatives).effects["a"] == pytest.approx(0.5)


def test_where_nothing_is_above_the_noise_nothing_is_shared_out():
    found = split([alternative({"": 0.0, "a": 0.0})])
    assert (found.calibrated, found.explained) == (1.0, 1.0)
    assert found.effects == {"a": 0.0}
    assert found.unexplained == 1.0


def test_the_refit_alone_explains_nothing():
    found = budget(ONE, [alternative({"": 3.0})], GROUPS, SETTINGS)
    assert not found.groups
    assert found.unexplained.share == 1.0
    assert found.unexplained.ci95 == pytest.approx((1.0, 1.0))
    assert found.calibrated == found.explained == pytest.approx(2.0)


def test_intervals_hold_the_shares_and_are_as_wide_as_the_data_say():
    even = budget(ONE, [alternative(PAIR)], GROUPS, SETTINGS)
    for part, share in ((even.groups["first"], 0.6), (even.groups["second"], 0.3), (even.unexplained, 0.1)):
        assert part.ci95 == pytest.approx((share, share), abs=1e-9), "every stretch of time says the same"
    burst = np.where(T < 10.0, 3.0, 0.3)
    uneven = {s: 1.0 + burst * (np.abs(r) - 1.0) for s, r in alternative(PAIR).residuals.items()}
    uneven[frozenset("a")] = np.where(T < 20.0, uneven[frozenset("a")], uneven[frozenset()])
    found = budget(ONE, [Alternative(1.0, uneven)], GROUPS, SETTINGS)
    for part in (*found.groups.values(), found.unexplained):
        assert part.ci95[0] <= part.share <= part.ci95[1]
    assert np.diff(found.groups["first"].ci95)[0] > 0.05


@pytest.mark.parametrize("seed", [0])
def test_intervals_cover_the_share_of_the_machine(seed):
    """Independent noise about a known deviation: of 40 measurements about 95 % hold the true share."""
    rng = np.random.default_rng(seed)
    deviation = 1.2 * np.sin(2.0 * np.pi * 0.7 * T)
    true = 1.0 - 0.25
    held = 0
    for _ in range(40):
        noise = rng.normal(size=len(T))
        made = {frozenset(): noise + deviation, frozenset("a"): noise + 0.5 * deviation}
        low, high = budget(ONE, [Alternative(1.0, made)], GROUPS, SETTINGS).groups["first"].ci95
        held += low <= true <= high
    assert held >= 34


def test_intervals_allow_for_the_form_that_effects_have_in_the_machine():
    """What either effect of a pair leaves without the other, and what both leave, is uncertain by 4 % of the gap (rms);
    what is left of a single effect may be its form."""
    pair = [alternative(PAIR)]
    exact, wide = (budget(ONE, pair, GROUPS, BootstrapSettings(form=form)) for form in (0.0, 0.04))
    assert {g: p.share for g, p in wide.groups.items()} == {g: p.share for g, p in exact.groups.items()}
    spread = {s: 2.0 * PAIR[s] ** 0.5 * 0.04 * PAIR[""] ** 0.5 / PAIR[""] for s in ("a", "b", "ab")}
    half = 1.96 * spread["ab"]
    assert wide.unexplained.ci95 == pytest.approx((0.1 - half, 0.1 + half), abs=0.2 * half)
    half = 1.96 * 0.5 * sum(x**2 for x in spread.values()) ** 0.5
    assert wide.groups["first"].ci95 == pytest.approx((0.6 - half, 0.6 + half), abs=0.2 * half)
    form = 0.05**2 * 10.0
    single = budget(ONE, [alternative({"": 10.0, "a": form})], GROUPS, BootstrapSettings(form=0.04))
    assert single.groups["first"].ci95[1] == 1.0
    assert single.groups["first"].ci95[0] > 0.98


@pytest.mark.parametrize(("probability", "least"), [(0.9, 0.0), (0.99, 0.6)])
def test_an_effect_that_a_plausible_set_goes_without_may_have_no_share(probability, least):
    """The share is the average over the sets, those without the effect too, and so is its interval."""
    sets = [alternative(PAIR, probability), alternative({"": 10.0, "c": 5.0}, 1.0 - probability)]
    found = budget(ONE, sets, GROUPS, SETTINGS).groups["first"]
    assert found.share == pytest.approx(0.6 * probability)
    assert found.ci95 == pytest.approx((min(least, found.share), 0.6))


def test_the_same_data_give_the_same_intervals():
    rng = np.random.default_rng(2)
    made = {frozenset(s): rng.normal(0.0, sd, len(T)) for s, sd in {"": 3.0, "a": 1.5}.items()}
    first, second = (budget(ONE, [Alternative(1.0, made)], GROUPS, SETTINGS) for _ in range(2))
    assert first.groups == second.groups
    assert first.unexplained == second.unexplained


def test_a_few_readings_have_a_budget_too():
    few = gather([RawBlock(0, 0, "m.x", np.arange(3) / 10.0, np.zeros(3), 1.0, None, True)])
    found = budget(few, [alternative(PAIR, observations=few)], GROUPS, SETTINGS)
    assert found.groups["first"].share == pytest.approx(0.6)


@pytest.mark.parametrize("seconds", [2.4, 3.0, 3.4, 4.9, 6.0])
def test_a_few_uneven_stretches_have_intervals_too(seconds):
    t = np.arange(0.0, seconds, 0.01)
    short = gather([RawBlock(0, 0, "m.x", t, np.zeros(len(t)), 1.0, None, True)])
    rng = np.random.default_rng(4)
    made = {frozenset(s): rng.normal(0.0, sd, len(t)) for s, sd in {"": 3.0, "a": 1.5}.items()}
    part = budget(short, [Alternative(1.0, made)], GROUPS, SETTINGS).groups["first"]
    assert part.ci95[0] < part.share < part.ci95[1]


def test_what_calibration_leaves_is_as_the_most_probable_hypothesis_sees_it():
    """Of another one, that has a sensor's bias, calibration leaves something else."""
    found = split([alternative(PAIR, 0.9), alternative({"": 5.0, "c": 1.0}, 0.1)])
    assert found.calibrated == pytest.approx(np.sqrt(11.0))
