"""Effects in other forms: foretold, fitted from two starts, compared with the plain one."""

from dataclasses import replace

import numpy as np
import pytest
from deepsea_cosim.gap.problem.parameters import EffectForm, EstimatedParameter
from deepsea_cosim.gap.search.forms import adopt_forms, any_forms_left, try_forms
from deepsea_cosim.gap.search.polish import polish
from deepsea_cosim.gap.search.rounds import best_of_each_set
from deepsea_cosim.gap.search.starts import FitStart, hypotheses_at

from .made import T, effect, posed, start


def shape(name, starts=(-0.5, 0.5)):
    return EstimatedParameter(name, "effect", 0.0, 1.0, -1.0, 1.0, 0.5, shape=True, starts=starts)


UNEVEN = EffectForm("uneven", "more one way", (shape("lean"),))
BENT = EffectForm("bent", "bends", (shape("bend"),))
P = replace(effect("p"), forms=(UNEVEN, BENT))


def machine(p):
    s = np.sin(2.0 * T)
    rub = np.tanh(4.0 * s) * (1.0 + p.get("lean", 0.0) * np.tanh(4.0 * s)) + p.get("bend", 0.0) * s**3
    return (1.0 + 0.05 * p.get("a", 0.0)) * np.sin(T) + 0.3 * p.get("p", 0.0) * rub


def fitted(truth):
    p, nuisance_jacobian = posed(machine, truth, [P])
    plain = polish(p, [start(p, nuisance_jacobian, [P], {"p": 0.8})], nuisance_jacobian, 3)
    return p, best_of_each_set(plain), try_forms(p, plain, nuisance_jacobian)


def test_the_form_that_the_machine_has_comes_first():
    p, plain, found = fitted({"a": 0.3, "p": 0.9, "lean": 0.4})
    assert plain[0].fit.rms > 3.0
    assert found[0].label == "p [uneven]"
    assert found[0].fit.rms < 1.1
    assert found[0].fit.point["lean"] == pytest.approx(0.4, abs=0.02)
    assert {h.label for h in found} == {"p", "p [uneven]", "p [bent]"}
    (c,) = adopt_forms(p, found[0]).candidates
    assert c.form is UNEVEN


def test_the_plain_form_stays_first_where_it_is_right():
    p, _, found = fitted({"a": 0.3, "p": 0.9})
    assert found[0].label == "p"
    assert adopt_forms(p, found[0]) is p


def test_what_has_no_forms_is_left_alone():
    q = effect("q")
    p, nuisance_jacobian = posed(machine, {}, [q])
    plain = [start(p, nuisance_jacobian, [q], {})]
    assert not any_forms_left(plain)
    assert try_forms(p, plain, nuisance_jacobian) == plain


def test_hypotheses_stand_where_they_are_put():
    p, nuisance_jacobian = posed(machine, {"p": 0.9}, [P])
    near = start(p, nuisance_jacobian, [P], {"p": 0.8}).fit
    p.asked.clear()
    there, astray = (FitStart((P,), point, near.correction) for point in ({"p": 0.5, "a": 0.1}, {"p": 0.7}))
    found = hypotheses_at(p, [there, astray], nuisance_jacobian)
    assert [h.fit.point["p"] for h in found] == [0.5, 0.7]
    assert found[0].fit.model == pytest.approx(machine({"p": 0.5, "a": 0.1}))
    assert sum(len(coarse) + len(exact) for coarse, exact in p.asked) == 2


@pytest.mark.parametrize(("truth", "tried"), [({"q": 0.8}, False), ({"q": 0.8, "bend": 0.3, "p": 0.9}, True)])
def test_where_the_best_leaves_the_noise_sets_that_leave_far_more_are_tried_in_no_form(truth, tried):
    q = effect("q")

    def both(point):
        return machine(point) + 0.1 * point.get("q", 0.0) * np.cos(9.0 * T)

    p, columns = posed(both, truth, [P, q])
    found = polish(p, [start(p, columns, [q], {"q": 0.5}), start(p, columns, [P], {"p": 0.5})], columns, 3)
    p.asked.clear()
    made = try_forms(p, best_of_each_set(found), columns)
    assert any("[" in h.label for h in made) is tried
    assert bool(p.asked) is tried


def test_an_effect_is_tried_in_its_forms_behind_others_that_serve_better_than_its_plain_one():
    bowed = EffectForm("bowed", "bows", (shape("bow"),))
    q, r = (replace(effect(name), forms=(bowed,)) for name in "qr")

    def imitated(point):
        s = np.tanh(4.0 * np.sin(2.0 * T))
        others = point.get("q", 0.0) * (s + 0.3 * s**2) + point.get("r", 0.0) * (s + 0.5 * s**2)
        return machine(point) + 0.3 * others * (1.0 + point.get("bow", 0.0) * np.cos(9.0 * T))

    p, columns = posed(imitated, {"p": 0.9, "lean": 0.4}, [P, q, r])
    begun = [start(p, columns, [e], {e.main.name: 0.8}) for e in (P, q, r)]
    plain = best_of_each_set(polish(p, begun, columns, 3))
    assert plain[-1].label == "p"
    assert try_forms(p, plain, columns)[0].label == "p [uneven]"
