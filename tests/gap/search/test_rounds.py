"""A whole round of the search on formulas, so that the answer is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from deepsea_cosim.gap.problem.parameters import EstimatedParameter
from deepsea_cosim.gap.search.baseline import simulate_nominal
from deepsea_cosim.gap.search.rounds import (
    best_of_each_set,
    choose_proposals,
    drop_each_effect,
    fit_leaders,
    idle_effects,
    look_first,
    next_start,
    run_quick_round,
    search_cost,
    search_round,
)
from deepsea_cosim.gap.search.sets import Proposal
from deepsea_cosim.gap.settings import SCORING

from tests.gap.formula import at_any_step

from .made import BASE, T, effect, first_round, moving, posed, start


def linear(u):
    return 0.1 * u


LINEAR = dict.fromkeys(("p", "q", "r", "s", "v"), linear)
EFFECTS = [effect(name) for name in LINEAR]


def best(found):
    return best_of_each_set(found.hypotheses)[0]


def finds(machine, truth, candidates, tolerance=0.03, rounds=1):
    """The best hypothesis of some rounds, which has to be the truth."""
    p, nuisance_jacobian = posed(machine, truth, candidates)
    at, found = simulate_nominal(p, nuisance_jacobian), []
    for _ in range(rounds):
        found = best_of_each_set([*found, *search_round(p, nuisance_jacobian, at).hypotheses])
        at = found[0]
    assert at.ids == tuple(sorted(set(truth) - {"a"}))
    assert at.fit.point == pytest.approx({**dict.fromkeys(at.fit.point, 0.0), **truth}, abs=tolerance)
    assert at.fit.rms == pytest.approx(1.0, abs=0.1)
    return at


def test_the_exact_pair_of_a_linear_formula():
    finds(moving(LINEAR), {"a": 0.6, "p": 0.7, "r": -2.2}, EFFECTS, 0.06)


def test_a_first_look_finds_what_is_plain_with_half_of_the_runs_and_none_is_run_again():
    p, nuisance_jacobian = posed(moving(LINEAR), {"a": 0.6, "p": 0.7, "r": -2.2}, EFFECTS)
    nominal = simulate_nominal(p, nuisance_jacobian)
    p.asked.clear()
    first = look_first(p, nuisance_jacobian, nominal)
    soon = sum(len(coarse) for coarse, _ in p.asked)
    assert min(first.hypotheses, key=search_cost).ids == ("p", "r")
    found = run_quick_round(p, nuisance_jacobian, nominal, first.bank)
    asked = [tuple(sorted(point.items())) for coarse, _ in p.asked for point in coarse]
    assert best(found).ids == ("p", "r")
    assert soon < 0.5 * len(asked)
    in_bank = {(x.candidate.label, x.size) for x in first.bank.responses}
    again = [point for point in asked[soon:] if len(point) == 1 and point[0] in in_bank]
    assert not again, "what the bank has"


def test_no_effect_is_better_than_some_where_nothing_is_to_be_found():
    p, nuisance_jacobian = posed(moving(LINEAR), {"a": 0.6}, EFFECTS)
    assert best(first_round(p, nuisance_jacobian)).ids == ()


@pytest.mark.parametrize("size", [0.55, 1.7, 5.5])
def test_a_pair_whose_responses_are_quadratic_at_sizes_between_those_of_the_grid(size):
    laws = {**LINEAR, "q": lambda u: 0.05 * u * abs(u), "r": lambda u: 0.1 * np.sinh(u)}
    finds(moving(laws), {"q": size, "r": -1.8}, EFFECTS)


@pytest.mark.parametrize("size", [3.4, 4.6, 7.0])
def test_an_effect_that_shows_nothing_at_its_usual_size_is_found_at_a_larger_one(size):
    """The machine swings once the loop's delay is above 2.5; a drag shows at once, but is wrong."""

    def machine(p):
        swing = max(0.0, p.get("delay", 0.0) - 2.5)
        slow = 0.02 * p.get("drag", 0.0)
        return (1.0 + 0.05 * p.get("a", 0.0) - slow) * np.sin(T) + 0.4 * swing * np.sin(9.0 * T)

    finds(machine, {"a": 0.4, "delay": size}, [effect("delay", 0.0), effect("drag", 0.0)], 0.05)


def test_an_effect_that_does_the_same_at_all_small_sizes_is_found_at_a_large_one():
    """A valve that holds a load only beyond 5 has a loss of its own whenever it is there."""

    def machine(p):
        u = p.get("valve", 0.0)
        loss, held = 0.05 * (u > 0.0), 0.3 * max(0.0, u - 5.0)
        return (1.0 + 0.05 * p.get("a", 0.0)) * np.sin(T) + loss * np.cos(5.0 * T) + held * np.sin(9.0 * T)

    finds(machine, {"a": 0.4, "valve": 7.5}, [effect("valve", 0.0)], 0.05)


def test_an_effect_that_shows_only_beside_another_is_found_around_that():
    """The valve's flow counts only once the narrow line lets some through; a droop shows at once but is wrong."""

    def machine(p):
        through = p.get("line", 0.0)
        made = np.sin(T) + 0.05 * p.get("a", 0.0) * np.cos(T) + 0.2 * through * np.sin(2.0 * T)
        return made + 0.1 * max(0.0, through - 1.5) * p.get("valve", 0.0) * np.cos(4.0 * T) + 0.1 * p.get("droop", 0.0)

    candidates = [effect(name, 0.0) for name in ("line", "valve", "droop")]
    finds(machine, {"line": 3.0, "valve": 2.0}, candidates, 0.05, rounds=2)


def test_sizes_at_which_an_effect_does_not_run_do_not_end_the_round():
    p, nuisance_jacobian = posed(moving(LINEAR), {"p": 0.4, "r": -0.2}, EFFECTS)

    def runs(point):
        return None if abs(point.get("p", 0.0)) > 0.5 or point.get("q", 0.0) else moving(LINEAR)(point)

    found = best(first_round(replace(p, model=at_any_step(runs)), nuisance_jacobian))
    assert found.ids == ("p", "r")
    assert found.fit.point["p"] == pytest.approx(0.4, abs=0.05)


def test_where_no_effect_runs_the_base_parameters_are_fitted():
    p, nuisance_jacobian = posed(moving(LINEAR), {"a": 0.6}, EFFECTS)

    def runs(point):
        return None if set(point) - {"a"} else moving(LINEAR)(point)

    found = first_round(replace(p, model=at_any_step(runs)), nuisance_jacobian)
    assert [h.ids for h in found.hypotheses] == [()]
    assert found.hypotheses[0].fit.point["a"] == pytest.approx(0.6, abs=0.05)
    assert found.shares_alone == {}


def test_an_effect_of_a_sensor_is_found():
    """Readings that come late: at every size of the grid, for it costs no simulation."""
    late = effect("sensor.m.x.delay", 0.0, 6.0, kind="sensor")

    def machine(p):
        t = T - 0.05 * p.get("sensor.m.x.delay", 0.0)
        return (1.0 + 0.05 * p.get("a", 0.0)) * np.sin(3.0 * t) + 0.1 * p.get("p", 0.0) * np.cos(5.0 * T)

    p, nuisance_jacobian = posed(machine, {"a": -0.4, "sensor.m.x.delay": 1.7}, [effect("p"), late])
    found = best(first_round(p, nuisance_jacobian))
    assert found.candidates == (late,)
    assert found.label == "sensor.m.x.delay(m.x)"
    assert found.fit.point["sensor.m.x.delay"] == pytest.approx(1.7, abs=0.1)


def test_a_set_of_three_is_the_most():
    truth = {"p": 0.7, "q": 1.5, "r": -0.9, "s": 0.5, "v": -0.4}
    p, nuisance_jacobian = posed(moving(LINEAR), truth, EFFECTS)
    found = first_round(p, nuisance_jacobian)
    assert max(len(h.candidates) for h in found.hypotheses) == 3
    assert best(found).ids == ("p", "q", "r"), "the largest"
    again = search_round(p, nuisance_jacobian, best(found))
    assert max(len(h.candidates) for h in again.hypotheses) == 3


def test_an_effect_gives_way_to_another_that_is_right():
    """From a set with a wrong member the next round takes it away and adds the right one."""
    laws = {**LINEAR, "w": linear}
    p, nuisance_jacobian = posed(moving(laws), {"p": 0.7, "r": -2.2}, [*EFFECTS, effect("w")])
    at = start(p, nuisance_jacobian, [EFFECTS[0], EFFECTS[4]], {"p": 0.7, "v": 0.5})
    found = best(search_round(p, nuisance_jacobian, at))
    assert found.ids == ("p", "r")
    assert found.fit.rms == pytest.approx(1.0, abs=0.1)


def test_idle_effects_are_dropped():
    p, nuisance_jacobian = posed(moving(LINEAR), {"p": 0.7}, EFFECTS)
    negligible = p.settings.search.negligible
    idle = start(p, nuisance_jacobian, EFFECTS[:2], {"p": 0.7, "q": 0.5 * negligible})
    busy = start(p, nuisance_jacobian, EFFECTS[:2], {"p": 0.7, "q": -2.0 * negligible})
    assert idle_effects(idle, negligible)
    assert not idle_effects(busy, negligible)
    assert not idle_effects(simulate_nominal(p, nuisance_jacobian), negligible)
    found = first_round(p, nuisance_jacobian).hypotheses
    quick = [h for h in found if h.quick]
    assert not any(idle_effects(h, negligible) for h in quick)


def test_an_idle_shape_or_base_parameter_is_none():
    p, nuisance_jacobian = posed(moving(LINEAR), {}, EFFECTS)
    shape = EstimatedParameter("p.v", "effect", 0.0, 1.0, -1.0, 1.0, 1.0, shape=True)
    candidate = replace(EFFECTS[0], parameters=(*EFFECTS[0].parameters, shape))
    assert not idle_effects(start(p, nuisance_jacobian, [candidate], {"p": 0.5}), 0.01)


def test_gains_of_a_round_are_those_of_its_beginning():
    p, nuisance_jacobian = posed(moving(LINEAR), {"p": 1.0, "q": -0.5}, EFFECTS)
    gains = first_round(p, nuisance_jacobian).shares_alone
    assert sorted(gains, key=gains.__getitem__)[-2:] == ["q", "p"]
    assert gains["p"] == pytest.approx(0.8, abs=0.05)


def proposal(names, cost, by_name):
    return Proposal(tuple(by_name[n] for n in names), {}, cost)


def test_of_every_size_of_set_some_are_fitted_and_relatives_of_what_is_in():
    by_name = {name: effect(name, group="like p" if name in "pw" else "") for name in "pqrsvw"}
    p, nuisance_jacobian = posed(moving(LINEAR), {}, EFFECTS)
    at = start(p, nuisance_jacobian, [by_name["p"]], {"p": 0.7})
    triples = [proposal("pqr", 1.0, by_name), proposal("pqs", 2.0, by_name), proposal("qrs", 3.0, by_name)]
    pairs = [proposal("pq", 4.0, by_name), proposal("qr", 5.0, by_name)]
    singles = [proposal(n, 6.0 + k, by_name) for k, n in enumerate("pqrsvw")]
    proposals = [*triples, *pairs, *singles, proposal("", 20.0, by_name)]
    chosen = choose_proposals(proposals, at, 8)
    assert [len(x.candidates) for x in chosen].count(0) == 1
    assert {"p", "q"} <= {x.candidates[0].id for x in chosen if len(x.candidates) == 1}
    assert any(x.labels == {"w"} for x in chosen), "a relative of p, in its place"
    assert len(chosen) == 8
    assert len(set(map(id, chosen))) == 8


def test_an_effect_that_does_not_pay_is_dropped_from_the_best():
    """From where the best stands: a fit without it that has stopped on its way does not count."""
    p, nuisance_jacobian = posed(moving(LINEAR), {"a": 0.5, "p": 0.7}, EFFECTS)
    both = start(p, nuisance_jacobian, EFFECTS[:2], {"a": 0.5, "p": 0.7, "q": 0.02})
    lost = start(p, nuisance_jacobian, EFFECTS[:1], {"a": -0.9, "p": 0.1})
    kept = drop_each_effect(p, best_of_each_set([both, lost]), nuisance_jacobian)
    assert kept[0].ids == ("p",)
    assert kept[0].fit.point == pytest.approx({"a": 0.5, "p": 0.7}, abs=0.06)
    assert {h.ids for h in kept} >= {("p", "q"), ("q",), ("p",), ()}


def test_the_next_bank_is_made_at_the_best_set_else_at_its_best_part_where_there_has_been_none():
    p, nuisance_jacobian = posed(moving(LINEAR), {"p": 0.7, "q": -0.3}, EFFECTS)
    both = start(p, nuisance_jacobian, EFFECTS[:2], {"p": 0.7, "q": -0.3})
    part = start(p, nuisance_jacobian, EFFECTS[:1], {"p": 0.7})
    worse = start(p, nuisance_jacobian, EFFECTS[1:2], {"q": -0.3})
    other = start(p, nuisance_jacobian, EFFECTS[2:3], {})
    found = best_of_each_set([other, worse, part, both, simulate_nominal(p, nuisance_jacobian)])
    assert found[0] is both
    assert next_start(found, [frozenset()], True, None) is both
    assert next_start(found, [both.labels], False, None) is part
    assert next_start(found, [both.labels, part.labels], False, None) is worse
    assert next_start(found, [both.labels, part.labels, worse.labels], False, None) is None
    delivered = found[-1]
    assert next_start(found, [frozenset()], True, delivered) is both
    assert next_start(found, [frozenset()], False, delivered) is delivered
    assert next_start(found, [frozenset(), part.labels], True, delivered) is delivered
    assert next_start(found, [frozenset()], False, None) is both


def test_of_each_set_the_best_fit_counts_and_an_effect_has_its_price():
    p, nuisance_jacobian = posed(moving(LINEAR), {"p": 0.7}, EFFECTS)
    good = start(p, nuisance_jacobian, EFFECTS[:1], {"p": 0.7})
    bad = start(p, nuisance_jacobian, EFFECTS[:1], {"p": 0.2})
    both = start(p, nuisance_jacobian, EFFECTS[:2], {"p": 0.7})
    assert best_of_each_set([bad, both, good]) == [good, both]
    assert search_cost(both) - search_cost(good) == pytest.approx(SCORING.price)


def test_what_is_enough_alone_is_fitted_to_the_end_though_others_are_far_better_within_the_noise():
    """The noise is stated ten times too large: a larger set gains far below it, and is not what will be judged."""
    p, N = posed(moving(LINEAR), {"a": 0.5, "p": 0.7, "q": 0.05}, EFFECTS, noise=0.001)
    p = replace(p, observations=replace(p.observations, noise_std=np.full(len(p.observations), 0.01)))
    alone = replace(start(p, N, EFFECTS[:1], {"a": 0.5, "p": 0.66}), quick=True)
    both = start(p, N, EFFECTS[:2], {"a": 0.5, "p": 0.7, "q": 0.05})
    assert search_cost(alone) - search_cost(both) > p.settings.search.polish_within
    found = fit_leaders(p, best_of_each_set([alone, both]), N)
    (fitted,) = [h for h in found if h.ids == ("p",)]
    assert not fitted.quick
    assert fitted.fit.point["p"] == pytest.approx(0.7, abs=0.01)


def test_only_those_near_the_best_are_fitted_to_the_end():
    p, nuisance_jacobian = posed(moving(LINEAR), {"a": 0.5, "p": 0.7}, EFFECTS)
    near = replace(start(p, nuisance_jacobian, EFFECTS[:1], {"a": 0.5, "p": 0.68}), quick=True)
    far = replace(start(p, nuisance_jacobian, EFFECTS[1:2], {"q": 0.5}), quick=True)
    found = fit_leaders(p, best_of_each_set([near, far]), nuisance_jacobian)
    assert [(h.ids, h.quick) for h in found] == [(("p",), False), (("q",), True)]
    assert found[0].fit.point["p"] == pytest.approx(0.7, abs=0.01)
    assert BASE[0] in found[0].fit.parameters
