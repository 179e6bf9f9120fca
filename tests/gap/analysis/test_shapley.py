"""The Shapley value of small games."""

from itertools import permutations

import numpy as np
import pytest
from deepsea_cosim.gap.analysis.shapley import monotone, shapley, subsets


def game(players, worth):
    """worth: of a set of players, as a number or array."""
    return {s: np.asarray(worth(s), float) for s in subsets(frozenset(players))}


def random_game(players, seed=0, shape=()):
    rng = np.random.default_rng(seed)
    return game(players, lambda s: rng.normal(size=shape) if s else np.zeros(shape))


def brute_force(made):
    """What each player adds, averaged over all orders."""
    players = sorted(max(made, key=len))
    total = dict.fromkeys(players, 0.0)
    orders = list(permutations(players))
    for order in orders:
        for k, p in enumerate(order):
            total[p] = total[p] + made[frozenset(order[: k + 1])] - made[frozenset(order[:k])]
    return {p: x / len(orders) for p, x in total.items()}


@pytest.mark.parametrize("players", ["a", "ab", "abc", "abcd"])
def test_the_mean_over_all_orders(players):
    made = random_game(players, seed=len(players))
    found, expected = shapley(made), brute_force(made)
    assert set(found) == set(expected)
    for p in players:
        assert found[p] == pytest.approx(expected[p])


def test_shares_add_up_in_each_game_of_an_array():
    made = random_game("abc", shape=(7,))
    assert sum(shapley(made).values()) == pytest.approx(made[frozenset("abc")])


def test_players_of_the_same_use_share_alike():
    found = shapley(game("abc", lambda s: (3.0 if s & {"a", "b"} else 0.0) + (1.0 if "c" in s else 0.0)))
    assert found["a"] == found["b"] == pytest.approx(1.5)
    assert found["c"] == pytest.approx(1.0)


def test_a_player_of_no_use_has_nothing():
    found = shapley(game("abc", lambda s: 2.0 * ("a" in s) + 5.0 * ({"a", "b"} <= s)))
    assert found["c"] == pytest.approx(0.0)
    assert found["a"] == pytest.approx(4.5)


def test_nobody_is_no_game_to_share():
    assert shapley({frozenset(): np.array(1.0)}) == {}


def test_no_set_is_worth_more_than_one_that_contains_it():
    made = random_game("abcd", 3, (5,))
    closed = monotone(made)
    for s in made:
        above = [t for t in made if s <= t]
        for t in above:
            assert (closed[s] <= closed[t]).all()
        assert closed[s] == pytest.approx(np.min([np.maximum(made[t], 0.0) for t in above], axis=0))
    for share in shapley(closed).values():
        assert (share >= 0.0).all()


def test_a_monotone_game_stays_as_it_is():
    made = game("ab", len)
    assert monotone(made) == made


def test_players_are_in_the_same_order_in_every_process():
    """Random draws follow that order, and a set of texts has another one in every process."""
    names = [f"effect {k}" for k in range(8)]
    game = {s: np.array([float(len(s))]) for s in subsets(frozenset(names))}
    assert list(shapley(game)) == names
