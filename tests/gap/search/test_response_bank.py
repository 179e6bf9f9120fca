"""What a bank runs beyond usual sizes, and fits anew of sets that came to less than it foretold."""

from __future__ import annotations

import numpy as np
import pytest
from deepsea_cosim.gap.search.baseline import simulate_nominal
from deepsea_cosim.gap.search.response_bank import rms
from deepsea_cosim.gap.search.sets import propose_sets
from deepsea_cosim.gap.search.starts import fit_disappointing, fit_proposals

from .made import T, bank_at, effect, moving, posed


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
