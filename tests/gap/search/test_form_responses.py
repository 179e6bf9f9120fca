"""Effects in other forms among a bank's responses."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from deepsea_cosim.gap.problem.parameters import EffectForm, EstimatedParameter
from deepsea_cosim.gap.search.baseline import simulate_nominal
from deepsea_cosim.gap.search.form_responses import add_forms
from deepsea_cosim.gap.search.sets import Projection

from .made import T, bank_at, effect, first_round, posed


def shape(name, low, high, *starts):
    return EstimatedParameter(name, "effect", 0.0, 1.0, low, high, 2.0, shape=True, starts=starts)


SLOW = EffectForm("slow", "late", (shape("late", 0.0, 4.0, 1.0, 3.0),))
LATE = replace(effect("p"), forms=(SLOW,))


def sinking(p):
    """A shift that calibration's bias takes up, unless it comes late."""
    late = p.get("late", 0.0)
    way = -np.expm1(-T / late) if late > 0.0 else np.ones_like(T)
    return (1.0 + 0.05 * p.get("a", 0.0)) * np.sin(T) + 0.1 * p.get("p", 0.0) * way


UNEQUAL = EffectForm("unequal", "each its own", tuple(shape(f"e{k}", -1.0, 2.0, -0.5, 0.5) for k in range(3)))
LANDS = replace(effect("p", 0.0), forms=(UNEQUAL,))


def three(p):
    """A part in proportion to the size, and three to a share of their own, too."""
    y = (1.0 + 0.05 * p.get("a", 0.0)) * np.sin(T) + 0.1 * p.get("p", 0.0) * np.cos(7.0 * T)
    for k in range(3):
        y = y + 0.1 * p.get("p", 0.0) * (1.0 + p.get(f"e{k}", 0.0)) * np.cos((3.0 + k) * T)
    return y


def forms_of(machine, truth, c):
    p, columns = posed(machine, truth, [c])
    bank = bank_at(p, simulate_nominal(p, columns).fit)
    return add_forms(p, bank, Projection.of_all(p, bank, columns)).responses


def test_an_effect_that_shows_in_another_form_only_is_found_in_that():
    found = forms_of(sinking, {"p": 0.8, "late": 2.5}, LATE)
    assert {(x.candidate.name, x.values.get("late")) for x in found} == {("p", None), ("p [slow]", 3.0)}
    best = first_round(*posed(sinking, {"p": 0.8, "late": 2.5}, [LATE])).hypotheses[0]
    assert best.candidates[0].name == "p [slow]"
    assert best.fit.rms == pytest.approx(1.0, abs=0.1)


def test_an_effect_that_is_in_a_form_is_run_in_no_other():
    assert {x.candidate.name for x in forms_of(sinking, {}, LATE.in_form(SLOW))} == {"p [slow]"}


def test_a_form_is_run_at_the_size_that_would_make_what_is_left():
    sizes = {x.size for x in forms_of(three, {"p": 8.0}, LANDS) if x.candidate.form}
    assert sizes == {8.0}


def test_the_parameters_of_a_form_are_mixed_as_suits_best():
    """One land alone looks like nothing; what all do together is exactly a mixture."""
    truth = {"p": 1.0, "e0": 0.6, "e1": -0.7, "e2": 0.4}
    mixed = forms_of(three, truth, LANDS)[-1]
    assert [mixed.values[f"e{k}"] for k in range(3)] == pytest.approx([0.6, -0.7, 0.4], abs=0.05)


def test_where_nothing_is_left_forms_are_run_at_the_usual_size():
    p, columns = posed(sinking, {}, [LATE])
    p = replace(p, observations=replace(p.observations, noise_std=2.0 * p.observations.noise_std))
    bank = bank_at(p, simulate_nominal(p, columns).fit)
    found = add_forms(p, bank, Projection.of_all(p, bank, columns)).responses
    assert {abs(x.size) for x in found if x.candidate.form is not None} == {1.0}
