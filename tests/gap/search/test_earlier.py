"""Sets of an earlier diagnosis, as a problem can have them."""

from dataclasses import replace

import pytest
from deepsea_cosim.gap.problem.parameters import EffectForm
from deepsea_cosim.gap.search.baseline import simulate_nominal
from deepsea_cosim.gap.search.earlier import EarlierDiagnosis, EarlierSet, baseline_point, refit_sets, transferable_sets

from .made import effect, moving, posed

P, Q = effect("p"), effect("q")
LAWS = {name: (lambda u: 0.1 * u) for name in ("p", "q")}
BENT = EffectForm("bent", "bends", effect("bend").parameters)


def problem(candidates, accepted=()):
    p, nuisance_jacobian = posed(moving(LAWS), {"p": 0.7, "q": -0.3}, candidates)
    base = (*p.base, *(x for c in accepted for x in c.parameters))
    return replace(p, base=base, accepted=tuple(c.as_accepted() for c in accepted)), nuisance_jacobian


def test_what_is_accepted_is_no_longer_of_a_set():
    both = EarlierSet({"p": None, "q": None}, {"a": 0.1, "p": 0.7, "q": -0.3})
    alone = EarlierSet({"q": None}, {"a": 0.4, "q": -0.5})
    p, _ = problem([Q], [P])
    (found,) = transferable_sets(p, EarlierDiagnosis((alone, both), True))
    assert found == EarlierSet({"q": None}, both.point)
    assert baseline_point(p, [found]) == {"a": 0.1, "p": 0.7}


def test_what_was_accepted_and_is_not_now_is_left_out_of_the_points():
    """Else the model would be simulated with an effect that the fit does not have."""
    p, nuisance_jacobian = problem([P, Q])
    found = transferable_sets(p, EarlierDiagnosis((EarlierSet({"q": None}, {"a": 0.1, "p": 0.7, "q": -0.3}),), True))
    assert found == [EarlierSet({"q": None}, {"a": 0.1, "q": -0.3})]
    (h,) = refit_sets(p, found, simulate_nominal(p, nuisance_jacobian), nuisance_jacobian)
    assert h.fit.model == pytest.approx(p.model(h.fit.point, 1.0))


def test_sets_with_effects_or_forms_that_are_not_there_any_more_are_left_out():
    sets = (EarlierSet({"r": None}, {}), EarlierSet({"p": "bent"}, {"p": 0.1}), EarlierSet({"p": None}, {"p": 0.2}))
    p, _ = problem([P])
    assert transferable_sets(p, EarlierDiagnosis(sets, True)) == [sets[2]]
    p, _ = problem([replace(P, forms=(BENT,))])
    assert transferable_sets(p, EarlierDiagnosis(sets, True)) == [sets[1], sets[2]]
