"""How a gap is shared out among effects that explain it together: the Shapley value of a small game.

An effect's share is what is lost without it, averaged over the orders in which effects can be added (Shapley 1953).
"""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from itertools import combinations
from math import factorial
from typing import TypeVar

import numpy as np

Player = TypeVar("Player", bound=Hashable)
Game = Mapping[frozenset[Player], np.ndarray]
"""What every set of players is worth, the empty set among them; arrays of one shape, element by element a game."""


def subsets(players: frozenset[Player]) -> list[frozenset[Player]]:
    """All subsets, the smaller first."""
    return [frozenset(c) for k in range(len(players) + 1) for c in combinations(sorted(players, key=str), k)]


def monotone(game: Game[Player]) -> dict[frozenset[Player], np.ndarray]:
    """The game in which no set is worth less than nothing, nor more than one that contains it: all together are worth
    what they leave, and what one of them spoils in data that were not fitted is nobody's share."""
    worth: dict[frozenset[Player], np.ndarray] = {}
    players = max(game, key=len)
    for s in sorted(game, key=len, reverse=True):
        above = [worth[s | {p}] for p in players - s if s | {p} in worth]
        worth[s] = np.minimum.reduce([np.maximum(game[s], 0.0), *above])
    return worth


def shapley(game: Game[Player]) -> dict[Player, np.ndarray]:
    """The share of every player; they add up to what all are worth together less what none is worth."""
    players = max(game, key=len)
    n = len(players)
    shares: dict[Player, np.ndarray] = {}
    for p in sorted(players, key=str):  # in the same order in every process, for hashes are not
        total = np.zeros_like(game[players])
        for s in subsets(players - {p}):
            weight = factorial(len(s)) * factorial(n - len(s) - 1) / factorial(n)
            total = total + weight * (game[s | {p}] - game[s])
        shares[p] = total
    return shares
