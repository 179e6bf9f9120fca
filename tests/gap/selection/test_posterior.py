"""Probabilities of hypotheses and of effects from the evidence."""

import numpy as np
import pytest
from deepsea_cosim.gap.selection.posterior import (
    Evidence,
    apply_doubts,
    expected_reduction,
    inclusion,
    inclusion_features,
    inclusions,
    posterior_of,
)
from deepsea_cosim.gap.selection.probability_calibration import Curvature, ProbabilityCalibration, chance
from deepsea_cosim.gap.settings import SCORING, PosteriorSettings
from scipy.optimize import minimize

READINGS = 5000
PLAIN = ProbabilityCalibration(20.0, 0.01, 0.0, 0.0, 1.0, (np.log(2.0), 0.0, 2.0))
"""The odds of an inclusion are twice the square of those of what it is expected to take."""
SHIPPED = ProbabilityCalibration.load()


def weighed(energies, calibration=PLAIN, price=0.0):
    """The posterior of hypotheses with these energies; those with effects cost `price` more."""
    evidence = [Evidence(ids, energy, price if ids else 0.0) for ids, energy in energies.items()]
    return posterior_of(evidence, calibration, READINGS)


def probability(posterior, ids):
    return sum(p for e, p in zip(posterior.evidence, posterior.probability, strict=True) if e.ids == ids)


def included(id, energies, calibration=PLAIN, price=0.0):
    return inclusion(weighed(energies, calibration, price), frozenset([id]))


@pytest.mark.parametrize("calibration", [PLAIN, SHIPPED])
def test_probabilities_add_up_and_follow_the_energies(calibration):
    found = weighed({(): 8.0, ("a",): 0.1, ("b",): 0.2, ("a", "b"): 0.1}, calibration, 2.0)
    assert found.probability.sum() == pytest.approx(1.0)
    assert probability(found, ("a",)) > probability(found, ("b",)) > probability(found, ())
    assert np.argmax(found.probability) == 1


def test_what_calibration_takes_over_of_an_effect_is_left_without_it():
    """Both hypotheses leave little, but the one without the effect only as calibration does the effect's work."""
    same = {(): 0.06, ("a",): 0.05}
    evidence = [Evidence((), 0.06, 9.0), Evidence(("a",), 0.05, 0.0, without={(): 30.0})]
    known = posterior_of(evidence, PLAIN, READINGS)
    assert expected_reduction(known, frozenset("a")) == pytest.approx(known.probability[1], abs=0.01)
    assert expected_reduction(weighed(same), frozenset("a")) < 0.5


def test_odds_are_those_of_the_closed_form():
    """Energies of which nothing is chance or discrepancy: (E_b / E_a)^(n / 2), and exp(-price / 2)."""
    bare = ProbabilityCalibration(20.0, 0.0, 0.0, 0.0, 1.0, PLAIN.inclusion)
    found = posterior_of(
        [Evidence((), 100.0, 0.0), Evidence(("a",), 1e3, 0.0), Evidence(("b",), 1e3, 3.0)], bare, 10**12
    )
    assert found.probability[0] / found.probability[1] == pytest.approx(10.0**10)
    assert found.probability[1] / found.probability[2] == pytest.approx(np.exp(1.5))


def test_a_higher_temperature_makes_all_more_alike():
    energies = {(): 1.0, ("a",): 0.8}
    hot = weighed(energies, ProbabilityCalibration(20.0, 0.01, 0.0, 0.0, 4.0, PLAIN.inclusion))
    cold = weighed(energies)
    odds = [p.probability[1] / p.probability[0] for p in (cold, hot)]
    assert odds[1] == pytest.approx(odds[0] ** 0.25)


def test_near_equals_share_where_the_best_leaves_much():
    """20 % less left is decisive where next to nothing is left, and no reason where the best leaves much."""
    scattered = ProbabilityCalibration(20.0, 0.01, 0.0, 3.0, 1.0, PLAIN.inclusion)
    ratios = []
    for calibration in (PLAIN, scattered):
        found = weighed({(): 50.0, ("a",): 4.0, ("b",): 5.0}, calibration)
        ratios.append(probability(found, ("a",)) / probability(found, ("b",)))
    assert ratios[0] > 5.0
    assert 1.0 < ratios[1] < 2.0
    little = weighed({(): 50.0, ("a",): 0.0, ("b",): 1.0}, scattered)
    assert probability(little, ("a",)) > 0.99


def test_what_a_right_effect_may_miss_for_its_form_is_no_reason_for_another_one():
    """A thousandth of a gap of a hundred times the noise is 3 % of what the effect does."""
    energies, price = {(): 1e4, ("a",): 10.0, ("a", "b"): 0.0}, 10.0
    forms = ProbabilityCalibration(20.0, 0.01, 0.1, 0.0, 1.0, PLAIN.inclusion)
    assert included("b", energies, PLAIN, price) > 0.95
    assert included("b", energies, forms, price) < 0.05
    little = {ids: e / 1e3 for ids, e in energies.items()}
    assert included("a", energies, forms, price) == pytest.approx(included("a", little, forms, price), abs=0.05)


def test_forms_of_one_set_are_told_apart_by_all_that_they_leave():
    """The same two residuals as of two sets, and as of one set in two forms."""
    forms = ProbabilityCalibration(20.0, 0.01, 0.1, 0.0, 1.0, PLAIN.inclusion)
    nothing, more, less = Evidence((), 1e4, 0.0), Evidence(("a",), 10.0, 8.0), Evidence(("a",), 0.1, 8.0)
    sets = posterior_of([nothing, more, less._replace(ids=("b",))], forms, READINGS)
    form = posterior_of([nothing, more, less], forms, READINGS)
    for found, discrepancy in ((sets, 0.01 + 0.1**2 * 1e4), (form, 0.01)):
        floor = discrepancy + chance(READINGS)
        odds = ((more.energy + floor) / (less.energy + floor)) ** 10.0
        assert found.probability[2] / found.probability[1] == pytest.approx(odds)
    assert form.probability.sum() == pytest.approx(1.0)


def test_what_an_effect_is_expected_to_take_is_the_mean_over_all_hypotheses():
    energies = {(): 10.0, ("s",): 4.0, ("u",): 6.0, ("s", "t"): 3.0, ("t", "u"): 5.5}
    found = weighed(energies)
    p = dict(zip(energies, found.probability, strict=True))

    def taken(without, left):
        before, after = (PLAIN.beyond_chance(e, READINGS) for e in (without, left))
        return 1.0 - after / before

    wanted = {
        "s": p["s",] * taken(10.0, 4.0) + p["s", "t"] * taken(10.0, 3.0),
        "t": p["s", "t"] * taken(4.0, 3.0) + p["t", "u"] * taken(6.0, 5.5),
        "u": p["u",] * taken(10.0, 6.0) + p["t", "u"] * taken(10.0, 5.5),
        "st": p["s",] * taken(10.0, 4.0) + p["s", "t"] * taken(10.0, 3.0) + p["t", "u"] * taken(6.0, 5.5),
    }
    for members, share in wanted.items():
        assert expected_reduction(found, frozenset(members)) == pytest.approx(share), members
    effects, of_groups = inclusions(found, {"s": "sensors", "t": "sensors", "u": "other", "v": "other"})
    assert effects["v"] == 0.0, "not looked at"
    assert effects["s"] == inclusion(found, frozenset("s"))
    assert of_groups["sensors"] == pytest.approx(inclusion(found, frozenset("st")))
    assert of_groups["other"] == effects["u"]


def test_a_sensors_effect_in_two_channels_is_one_effect():
    evidence = [Evidence(("s",), 1.0, 0.0), Evidence(("s",), 1.0, 0.0), Evidence((), 3.0, 0.0)]
    twice, once = posterior_of(evidence, PLAIN, READINGS), posterior_of(evidence[1:], PLAIN, READINGS)
    took = [expected_reduction(w, frozenset("s")) / (1.0 - w.probability[-1]) for w in (twice, once)]
    assert took[0] == pytest.approx(took[1])


def test_a_smaller_effect_that_takes_what_a_larger_one_leaves_is_as_sure():
    """Friction makes 90 % of the gap and a delay the rest, which nothing else explains."""
    energies = {(): 100.0, ("f",): 10.0, ("d",): 95.0, ("d", "f"): 0.0, ("e", "f"): 9.0}
    sure = {id: included(id, energies, SHIPPED, 10.0) for id in "fde"}
    assert min(sure["f"], sure["d"]) > PosteriorSettings().sure
    assert sure["e"] < 0.05


def test_a_right_effect_that_two_others_imitate_together_is_as_sure_as_it_is_probable():
    """Two effects cost twice what one does; at the same price right and wrong would be equally probable."""
    energies, costs = {(): 10.0, ("a",): 0.0, ("b",): 7.0, ("b", "c"): 0.0}, 6.0
    sure = []
    for known in (list(energies)[:3], list(energies)):
        found = posterior_of([Evidence(ids, energies[ids], costs * len(ids)) for ids in known], SHIPPED, READINGS)
        sure.append(inclusion(found, frozenset("a")))
    alone, imitated = sure
    assert 0.5 < imitated < alone
    assert included("a", energies, SHIPPED, costs) < 0.5


@pytest.mark.parametrize("calibration", [PLAIN, SHIPPED])
def test_inclusion_grows_with_the_evidence(calibration):
    found = [included("a", {(): 8.0, ("a",): e, ("b",): 4.0}, calibration) for e in (7.0, 5.0, 3.0, 1.0, 0.1)]
    assert found == sorted(found)
    assert found[0] < 0.3 < 0.5 < found[-1] <= SCORING.max_probability
    dear = [included("a", {(): 8.0, ("a",): 1.0, ("b",): 4.0}, calibration, price) for price in (0.0, 10.0, 40.0)]
    assert dear == sorted(dear, reverse=True)


def test_what_is_left_makes_an_effect_less_sure_with_the_shipped_calibration():
    good = included("a", {(): 100.0, ("a",): 0.0, ("b",): 70.0}, SHIPPED)
    bad = included("a", {(): 100.0, ("a",): 64.0, ("b",): 70.0}, SHIPPED)
    assert bad < 0.5 < 0.8 < good


def test_the_same_rest_is_less_of_a_doubt_where_it_is_less_of_the_gap():
    """What one of the catalogue imitates leaves part of a small gap; a right cause of another law, of a large one."""
    small = included("a", {(): 1.0, ("a",): 0.5}, SHIPPED)
    large = included("a", {(): 1000.0, ("a",): 0.5}, SHIPPED)
    assert small < PosteriorSettings().sure < large


def test_the_features_of_a_baseline_as_good_as_all_are_finite():
    found = weighed({(): 0.0, ("a",): 0.0})
    assert np.isfinite(inclusion_features(found, frozenset("a"))).all()


def test_doubts_multiply_the_odds():
    assert apply_doubts(0.8, []) == pytest.approx(0.8)
    assert apply_doubts(0.8, [0.5]) == pytest.approx(2.0 / 3.0)
    assert apply_doubts(0.8, [0.5, 0.5]) == pytest.approx(0.5)
    assert apply_doubts(0.0, [0.5]) == 0.0
    assert 0.0 < apply_doubts(1.0, [0.5]) <= 1.0
    tempered = [apply_doubts(p, [0.2]) for p in (0.1, 0.5, 0.9, 0.99)]
    assert tempered == sorted(tempered)


def test_a_fit_is_judged_where_evidence_and_priors_together_are_best():
    """Against a minimum found numerically, with the second derivative's determinant there."""
    bare = ProbabilityCalibration(15.0, 0.05, 0.0, 0.0, 1.0, PLAIN.inclusion)
    around = Curvature((0.0, 0.4, 30.0), (2.0, -3.0, 1.5), (0.2,))
    floor = 0.05 + chance(READINGS)
    rise, place = np.array(around.energy), np.array(around.place)

    def cost(d):
        return 15.0 * np.log(2.0 + floor + rise @ d**2) + ((place + d) ** 2).sum()

    best = minimize(cost, np.zeros(3), tol=1e-12).x
    weight = 15.0 / (2.0 + floor + rise @ best**2)
    judged = bare.evidence_terms(2.0, around, 0.0, READINGS)
    assert judged.fit + judged.penalty == pytest.approx(cost(best), abs=1e-6)
    assert judged.penalty == pytest.approx(((place + best) ** 2).sum(), abs=1e-5)
    assert judged.occam == pytest.approx(np.log1p(weight * rise).sum() - np.log1p(weight * 0.2), abs=1e-6)


def test_parameters_that_the_data_say_nothing_of_cost_nothing():
    nothing = Curvature((0.0, 0.0), (5.0, -2.0), ())
    assert PLAIN.evidence_terms(1.0, nothing, 0.0, READINGS)[1:] == (0.0, 0.0)


def test_the_more_the_data_say_the_more_a_value_far_from_the_prior_costs():
    found = [PLAIN.evidence_terms(1.0, Curvature((r,), (3.0,), ()), 0.0, READINGS) for r in (0.01, 0.1, 1.0, 100.0)]
    for one in ("penalty", "occam", "fit"):
        costs = [getattr(j, one) for j in found]
        assert costs == sorted(costs) or one == "fit"
    assert found[-1].penalty == pytest.approx(9.0, rel=0.01)
