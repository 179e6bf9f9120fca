"""What a bank runs beyond usual sizes, and fits anew of sets that came to less than it foretold."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from deepsea_cosim.gap.problem.parameters import EffectForm, EstimatedParameter
from deepsea_cosim.gap.search.baseline import simulate_nominal
from deepsea_cosim.gap.search.response_bank import rms
from deepsea_cosim.gap.search.sets import propose_sets
from deepsea_cosim.gap.search.starts import fit_disappointing, fit_proposals

from .made import T, bank_at, effect, first_round, moving, posed


def bank_of(machine, truth, candidates):
    p, columns = posed(machine, truth, candidates)
    return p, columns, bank_at(p, simulate_nominal(p, columns).fit)


def holds(u):
    """Nothing up to 5, then steeply more."""
    return max(0.0, u - 5.0) ** 2


def test_where_an_effect_sets_in_it_is_run_between():
    _, _, bank = bank_of(moving({"p": holds}), {"p": 5.7}, [effect("p", 0.0, 8.0)])
    far = {x.size: rms(x.change) for x in bank.responses}
    assert any(5.0 < s < 7.0 for s in far), far
    left = 0.7**2 / 9.0 * far[8.0]
    assert min(abs(np.log(x / left)) for x in far.values()) < np.log(4.0)  # else a tenth, or 18 times


def test_an_effect_that_grows_with_its_size_is_not():
    _, _, bank = bank_of(moving({"p": lambda u: 0.1 * u}), {"p": 3.7}, [effect("p", 0.0, 8.0)])
    assert len(bank.responses) == 2


LAG = EstimatedParameter("late", "effect", 0.0, 1.0, 0.0, 4.0, 2.0, shape=True, starts=(1.0, 3.0))
SLOW = EffectForm("slow", "late", (LAG,))
LATE = replace(effect("p"), forms=(SLOW,))


def sinking(p):
    """A shift that calibration's bias takes up, unless it comes late."""
    late = p.get("late", 0.0)
    way = -np.expm1(-T / late) if late > 0.0 else np.ones_like(T)
    return (1.0 + 0.05 * p.get("a", 0.0)) * np.sin(T) + 0.1 * p.get("p", 0.0) * way


def test_an_effect_that_shows_in_another_form_only_is_found_in_that():
    p, columns, bank = bank_of(sinking, {"p": 0.8, "late": 2.5}, [LATE])
    assert {(x.candidate.name, x.values.get("late")) for x in bank.responses} == {
        ("p", None), ("p [slow]", 3.0),
    }  # fmt: skip
    best = first_round(p, columns).hypotheses[0]
    assert best.candidates[0].name == "p [slow]"
    assert best.fit.rms == pytest.approx(1.0, abs=0.1)


def test_an_effect_of_the_point_or_in_a_form_is_run_in_no_other():
    p, _, bank = bank_of(sinking, {}, [LATE.in_form(SLOW)])
    assert all(x.candidate.form is SLOW for x in bank.responses)
    assert p.candidates[0].form is SLOW


def turning(p):
    """With the effect, the base parameter does the opposite of what it does without."""
    u = p.get("p", 0.0)
    return (1.0 + 0.05 * p.get("a", 0.0) * (1.0 - 4.0 * min(u, 1.0))) * np.sin(T) + 0.5 * u * np.cos(3.0 * T)


def test_a_set_that_came_to_less_than_was_foretold_is_fitted_with_derivatives_of_its_own():
    p, columns, bank = bank_of(turning, {"p": 1.0, "a": 0.6}, [effect("p", 0.0, 8.0)])
    bank, proposals = propose_sets(p, bank, columns)
    (single,) = [q for q in proposals if q.candidates]
    assert single.left < 2.0
    quick = fit_proposals(p, bank, [single], columns, 0)
    assert quick[0].fit.rms > 3.0
    (anew,) = fit_disappointing(p, bank, [single], quick, columns)
    assert anew.fit.rms < 1.1
    assert anew.fit.point["a"] == pytest.approx(0.6, abs=0.1)


def test_a_set_that_kept_its_promise_is_not():
    p, columns, bank = bank_of(moving({"p": lambda u: 0.1 * u}), {"p": 0.8}, [effect("p", 0.0, 8.0)])
    bank, proposals = propose_sets(p, bank, columns)
    quick = fit_proposals(p, bank, proposals, columns, 6)
    p.asked.clear()
    assert fit_disappointing(p, bank, proposals, quick, columns) == []
    assert not p.asked
