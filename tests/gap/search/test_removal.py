"""Sets of effects without one of them, fitted anew."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from deepsea_cosim.gap.search.polish import polish
from deepsea_cosim.gap.search.removal import drop_effects

from tests.gap.formula import at_any_step

from .made import LINEAR, P, Q, T, effect, moved, moving, posed, start


def test_without_an_effect_the_others_begin_where_the_derivatives_say_that_they_go():
    """A clock that runs fast by a base parameter or by an effect alike: from where both were half of it the base
    parameter alone is a whole turn away at the end of the run."""

    def turning(point):
        return np.sin(20.0 * T * (1.0 + 0.05 * (point.get("a", 0.0) + point.get("p", 0.0)))) + moving(LINEAR)(
            {"q": point.get("q", 0.0)}
        )

    p, columns = posed(turning, {"a": 0.9, "q": 0.5}, [P, Q])
    (both,) = polish(p, [start(p, columns, [P, Q], {"a": 0.1, "p": 0.8, "q": 0.5})], columns, 4)
    assert both.fit.rms < 1.1
    (alone,) = drop_effects(p, [(both, P)], columns)
    assert alone.fit.point["a"] == pytest.approx(0.9, abs=0.05)
    assert alone.fit.rms < 1.1


@pytest.mark.parametrize(("size", "looks"), [(0.15, 1), (3.0, 0)])
def test_without_an_effect_that_explains_nearly_all_nothing_is_fitted_to_the_end(size, looks):
    """But where it stands there is an exact run."""
    p, columns = posed(moving(LINEAR), {"a": 0.3, "p": size, "q": 0.5}, [P, Q])
    (both,) = polish(p, [start(p, columns, [P, Q], {"p": size, "q": 0.5})], columns, 4)
    p.asked.clear()
    (left,) = drop_effects(p, [(both, P)], columns)
    assert left.fit.status == "converged"
    starts, *derivatives = moved(p, [len(coarse) for coarse, _ in p.asked])
    assert starts == 2
    assert derivatives == [2] * (1 + looks)
    assert sum(len(exact) for _, exact in p.asked) >= 1


def test_an_effect_that_is_hardly_there_gives_way_to_a_base_parameter_that_does_the_same():
    """The base parameter drifts the machine only beyond 0.1, without derivative below; a trace of a leak does, too."""
    leak = effect("leak", 0.0)

    def machine(p):
        drift = max(0.0, p.get("a", 0.0) - 0.1) + 10.0 * p.get("leak", 0.0)
        return np.sin(T) + 0.3 * drift * np.tanh(T - 5.0) ** 3

    p, nuisance_jacobian = posed(machine, {"a": 0.3}, [leak])
    (winner,) = polish(p, [start(p, nuisance_jacobian, [leak], {"leak": 0.018})], nuisance_jacobian, 3)
    assert winner.fit.rms < 1.1
    assert winner.fit.point["leak"] < 0.05
    (left,) = drop_effects(p, [(winner, leak)], nuisance_jacobian)
    assert left.candidates == ()
    assert left.fit.rms < 1.1
    assert left.fit.point["a"] == pytest.approx(0.3, abs=0.03)


def test_without_a_large_effect_the_others_take_over_what_they_can():
    p, nuisance_jacobian = posed(moving(LINEAR), {"a": 0.4, "p": 0.8, "q": -0.6}, [P, Q])
    (both,) = polish(p, [start(p, nuisance_jacobian, [P, Q], {"p": 0.5, "q": -0.5})], nuisance_jacobian, 3)
    (left,) = drop_effects(p, [(both, P)], nuisance_jacobian)
    assert left.ids == ("q",)
    assert [x.name for x in left.fit.parameters] == ["a", "q"]
    assert left.fit.point["q"] == pytest.approx(-0.6, abs=0.06)
    assert left.fit.rms > 3.0
    assert left.fit.status == "converged"


def test_where_the_model_does_not_run_without_an_effect_there_is_no_fit():
    p, nuisance_jacobian = posed(moving(LINEAR), {"p": 0.7}, [P])
    h = start(p, nuisance_jacobian, [P], {"p": 0.7})
    still = replace(p, model=at_any_step(lambda x: moving(LINEAR)(x) if x.get("p", 0.0) > 0.1 else None))
    assert drop_effects(still, [(h, P)], nuisance_jacobian) == [None]


def test_an_effect_that_nothing_leads_back_from_is_squeezed_out():
    """A clock that runs fast by a base parameter and its square, or by an effect: without the effect it is 40 rad
    behind, and where the derivatives send the base parameter it is far ahead."""

    def turning(point):
        a = point.get("a", 0.0)
        clock = 1.0 + 0.05 * (a + 0.3 * a**2 + point.get("p", 0.0))
        return np.sin(60.0 * T * clock) + moving(LINEAR)({"q": point.get("q", 0.0)})

    p, columns = posed(turning, {"a": 0.8, "q": 0.5}, [P, Q])
    stands = {"a": 0.1, "p": 0.8 + 0.3 * 0.8**2 - 0.1 - 0.3 * 0.1**2, "q": 0.5}
    (both,) = polish(p, [start(p, columns, [P, Q], stands)], columns, 4)
    assert both.fit.rms < 1.1
    at_once = replace(p, settings=replace(p.settings, search=replace(p.settings.search, squeeze=())))
    (stuck,) = drop_effects(at_once, [(both, P)], columns)
    assert stuck.fit.rms > 10.0
    (alone,) = drop_effects(p, [(both, P)], columns)
    assert alone.candidates == (Q,)
    assert alone.fit.point == pytest.approx({"a": 0.8, "q": 0.5}, abs=0.03)
    assert alone.fit.rms < 1.1
