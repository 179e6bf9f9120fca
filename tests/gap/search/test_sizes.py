"""Sizes that an effect is run at, and how far each of them serves."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from deepsea_cosim.gap.problem.parameters import EffectCandidate, EstimatedParameter
from deepsea_cosim.gap.search.response_bank import Response
from deepsea_cosim.gap.search.sets import _reach
from deepsea_cosim.gap.search.sizes import grid, second_size, usual_sizes, variants
from deepsea_cosim.gap.settings import SearchSettings

SETTINGS = SearchSettings()
RANGES = [(0.0, 8.0), (-8.0, 8.0), (-0.02, 0.4), (-3.0, 0.0), (-1.0, 3.0), (0.0, 3.1), (0.0, 40.0), (0.0, 500.0)]


def parameter(low, high, name="x", shape=False, starts=()):
    return EstimatedParameter(name, "effect", 0.0, 1.0, low, high, 3.0, (), shape, starts)


def sides(sizes):
    """Absolute sizes to each side, that has any, in their order."""
    return [own for sign in (1.0, -1.0) if (own := [abs(s) for s in sizes if s * sign > 0.0])]


@pytest.mark.parametrize(("low", "high"), RANGES)
def test_a_grid_reaches_from_small_sizes_to_the_ends_of_the_range_in_even_steps(low, high):
    sizes = grid(parameter(low, high), SETTINGS)
    assert set(sizes) >= {e for e in (low, high) if e}
    assert all(low <= s <= high for s in sizes)
    for own in sides(sizes):
        assert own == sorted(set(own))
        assert own[0] <= SETTINGS.sizes[0]
        ratios = np.divide(own[1:], own[:-1])
        assert all(r <= SETTINGS.max_size_ratio * (1.0 + 1e-9) for r in ratios)


@pytest.mark.parametrize(("low", "high"), RANGES)
def test_the_usual_size_is_one_of_the_grid_to_each_side(low, high):
    x = parameter(low, high)
    usual, sizes = usual_sizes(x, SETTINGS), grid(x, SETTINGS)
    assert set(usual) <= set(sizes)
    assert [len(own) for own in sides(usual)] == [1] * len(sides(sizes))
    assert usual_sizes(parameter(-8.0, 8.0), SETTINGS) == [1.0, -1.0]


def test_the_second_size_is_the_small_one_unless_an_effect_would_have_to_be_large_to_make_the_gap():
    """Friction of a seal that was 43 times the usual one was left out: around 0.1 and 1 it looked like nothing."""
    x = parameter(-8.0, 50.0)
    upwards = {gap: second_size(x, 1.0, 0.5, gap, SETTINGS) for gap in (0.0, 0.1, 1.4, 2.0, 12.0, 1e3)}
    sizes = [s for s in grid(x, SETTINGS) if s > 0.0]
    nearest = {wanted: min(sizes, key=lambda s: abs(np.log(s / wanted))) for wanted in (4.0, 24.0)}
    assert upwards == {0.0: 0.1, 0.1: 0.1, 1.4: 0.1, 2.0: nearest[4.0], 12.0: nearest[24.0], 1e3: 50.0}
    assert second_size(x, -1.0, 0.5, 1e3, SETTINGS) == -8.0
    assert second_size(x, 1.0, 0.0, 1e3, SETTINGS) == 0.1, "what does nothing is no smaller for that"
    assert second_size(parameter(0.0, 0.02), 0.02, 1.0, 1.0, SETTINGS) is None


def responses(x, sizes):
    candidate = EffectCandidate("x", "x", "x", (x,))
    return [Response(candidate, {"x": s}, np.ones(3)) for s in sizes]


@pytest.mark.parametrize(("low", "high"), RANGES)
@pytest.mark.parametrize("choice", [grid, usual_sizes])
def test_between_two_sizes_no_size_is_out_of_reach(low, high, choice):
    x = parameter(low, high)
    sizes = choice(x, SETTINGS)
    least, most = _reach(responses(x, sizes), SETTINGS)
    assert np.all(least <= 1.0)
    assert np.all(most >= 1.0)
    for sign, end in ((1.0, high), (-1.0, -low)):
        own = sorted((abs(s), a, b) for s, a, b in zip(sizes, least, most, strict=True) if s * sign > 0.0)
        for (s, _, b), (t, a, _) in pairwise(own):
            assert s * b == pytest.approx(t * a), "one ends where the next begins"
        if own:
            assert own[-1][0] * own[-1][2] == pytest.approx(min(end, SETTINGS.extrapolation * own[-1][0]))
            assert own[0][0] * own[0][1] == pytest.approx(own[0][0] / SETTINGS.extrapolation)


def test_an_effect_that_is_taken_away_is_so_in_whole():
    candidate = EffectCandidate("x", "x", "x", (parameter(0.0, 8.0),))
    assert [r.tolist() for r in _reach([Response(candidate, {}, np.ones(3))], SETTINGS)] == [[1.0], [1.0]]


def test_every_size_is_run_with_the_starts_of_the_shapes():
    shape = parameter(-1.0, 1.0, "v", True, (-0.5, 0.5, 0.9))
    candidate = EffectCandidate("x", "x", "x", (parameter(0.0, 8.0), shape))
    points = variants(candidate, [0.1, 1.0], SETTINGS)
    assert points == [{"x": s, "v": v} for s in (0.1, 1.0) for v in (-0.5, 0.5, 0.9)]


def test_many_shapes_are_run_at_the_usual_size_alone_but_all_of_them():
    """Frequencies: a force that comes again shows at its own only."""
    rates, phases = (0.1, 0.2, 0.3, 0.4, 0.5), (0.0, 1.5)
    shapes = (parameter(-1.0, 1.0, "f", True, rates), parameter(-2.0, 2.0, "phi", True, phases))
    candidate = EffectCandidate("x", "x", "x", (parameter(-8.0, 8.0), *shapes))
    points = variants(candidate, [0.1, -0.1, 0.9, -0.9, 8.0], SETTINGS)
    assert points == [{"x": s, "f": f, "phi": v} for s in (0.9, -0.9) for f in rates for v in phases]
    plain = EffectCandidate("x", "x", "x", (parameter(0.0, 8.0), parameter(-1.0, 1.0, "v", True)))
    assert variants(plain, [1.0], SETTINGS) == [{"x": 1.0, "v": 0.0}]
