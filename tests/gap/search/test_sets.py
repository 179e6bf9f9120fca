"""Sets on a bank's Gram matrix against the least squares that they stand for."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from deepsea_cosim.gap.problem.parameters import EstimatedParameter
from deepsea_cosim.gap.search.baseline import simulate_nominal
from deepsea_cosim.gap.search.response_bank import Response, ResponseBank
from deepsea_cosim.gap.search.sets import ProjectedBank, propose_sets, shares_alone
from deepsea_cosim.gap.settings import SCORING
from scipy.optimize import lsq_linear

from tests.gap.formula import FormulaProblem, at_any_step, one_channel

from .made import BASE, T, bank_at, effect, moving, pitch, posed

N, DISPERSION, NOISE = 120, 2.5, 0.3


def random_bank(seed, alike):
    """Eight effects and three base parameters with random responses, which have a share in common."""
    rng = np.random.default_rng(seed)
    base = tuple(EstimatedParameter(f"b{k}", "base", 1.0, 0.05, -1.0, 1.0, sd) for k, sd in enumerate((0.6, 0.2, 2.0)))
    problem = FormulaProblem(
        at_any_step(lambda p: np.zeros(N)), one_channel(np.arange(float(N)), rng.normal(size=N), NOISE), base
    )
    same = rng.normal(size=N)
    change = [np.sqrt(1.0 - alike) * rng.normal(size=N) + np.sqrt(alike) * same for _ in range(8)]
    responses = [Response(effect(f"e{k}", 0.0, 8.0), {f"e{k}": 1.0}, x) for k, x in enumerate(change)]
    point = {"b0": 0.3, "b1": -0.1}
    jacobian = NOISE * rng.normal(size=(N, 3))
    bank = ResponseBank(point, rng.normal(size=N), np.zeros(N), (), base, jacobian, slice(None), tuple(responses))
    return problem, bank, NOISE * rng.normal(size=(N, 2))


def least_squares(problem, bank, nuisance_jacobian, chosen, low, high):
    """Sizes and cost with base parameters and nuisances free, their priors as rows."""
    columns = np.concatenate([bank.jacobian, nuisance_jacobian], axis=1) / NOISE
    sd = np.array([*(x.sd for x in bank.parameters), 1.0, 1.0])
    u = np.array([*(bank.point.get(x.name, 0.0) for x in bank.parameters), 0.0, 0.0])
    responses = np.array([bank.responses[i].change for i in chosen]).T
    A = np.concatenate([
        np.concatenate([columns, responses], axis=1) / np.sqrt(DISPERSION),
        np.concatenate([np.diag(1.0 / sd), np.zeros((len(sd), len(chosen)))], axis=1),
    ])  # fmt: skip
    r = np.concatenate([(problem.observations.y - bank.model) / NOISE / np.sqrt(DISPERSION), -u / sd])
    free = np.full(len(sd), np.inf)
    found = lsq_linear(A, r, (np.r_[-free, low], np.r_[free, high]), method="bvls", tol=1e-14)
    return found.x, 2.0 * found.cost


@pytest.mark.parametrize("size", [1, 2, 3])
@pytest.mark.parametrize("alike", [0.0, 0.9, 0.99])
def test_sizes_and_costs_are_those_of_bounded_least_squares(size, alike):
    problem, bank, nuisance_jacobian = random_bank(size, alike)
    projected = ProjectedBank(problem, bank, nuisance_jacobian, DISPERSION)
    sets = np.array(list(combinations(range(8), size)))
    t, cost = projected.solve(sets)
    price = SCORING.price * size
    bounded = 0
    for chosen, own, total in zip(sets, t, cost, strict=True):
        low, high = projected.low[chosen], projected.high[chosen]
        x, wanted = least_squares(problem, bank, nuisance_jacobian, chosen, low, high)
        assert total == pytest.approx(wanted + price, abs=1e-6)
        assert own == pytest.approx(x[5:], abs=1e-6)
        bounded += np.any((own == low) | (own == high))
        proposal = projected.proposal(chosen, own, total)
        for k, b in enumerate(bank.parameters):  # they follow, within their range
            assert proposal.point[b.name] == pytest.approx(np.clip(bank.point.get(b.name, 0.0) + x[k], -1, 1), abs=1e-6)
    assert bounded, "some sizes are at their bounds"


def test_an_effect_that_is_taken_away_earns_its_price():
    problem, bank, nuisance_jacobian = random_bank(0, 0.0)
    gone = replace(bank.responses[0], values={})
    with_it = replace(bank, candidates=(gone.candidate,), responses=(gone, *bank.responses[1:]))
    projected = ProjectedBank(problem, with_it, nuisance_jacobian, DISPERSION)
    t, cost = projected.solve(np.array([[0]]))
    assert t.tolist() == [[1.0]]
    _, wanted = least_squares(problem, with_it, nuisance_jacobian, [0], np.array([1.0 - 1e-12]), np.array([1.0]))
    assert cost[0] == pytest.approx(wanted - SCORING.price, rel=1e-6)
    assert projected.proposal([0], t[0], cost[0]).candidates == ()


def bank_of(machine, truth, candidates):
    p, nuisance_jacobian = posed(machine, truth, candidates)
    fit = simulate_nominal(p, nuisance_jacobian).fit
    return p, nuisance_jacobian, bank_at(p, fit)


LINEAR = {name: (lambda u: 0.1 * u) for name in ("p", "q", "r", "s")}


def test_a_bank_has_the_derivatives_and_the_responses_of_the_formula():
    p, _, bank = bank_of(moving(LINEAR), {}, [effect("p"), effect("q", 0.0, 0.5)])
    assert bank.jacobian[:, 0] == pytest.approx(0.05 * np.sin(T))
    sizes = [(x.candidate.id, x.size) for x in bank.responses]
    assert sizes == [("p", 1.0), ("p", -1.0), ("q", 0.5), ("p", 0.1), ("p", -0.1), ("q", 0.1)]
    for x in bank.responses:
        wave = np.cos(pitch("pq".index(x.candidate.id)) * T)
        assert x.change == pytest.approx(0.1 * x.size * wave / p.observations.noise_std)


def test_an_effect_that_changes_nothing_has_no_response():
    _, _, bank = bank_of(moving({"p": lambda u: 0.1 * u}), {}, [effect("p"), effect("idle")])
    assert {x.candidate.id for x in bank.responses} == {"p"}


def test_where_much_is_left_an_effect_is_run_at_the_size_that_would_make_it():
    """Around 0.1 and 1 it seems to lead away; only where it is large does it come near."""
    laws = {"p": lambda u: 0.1 * u if u > 5.0 else -0.02 * u, "q": lambda u: 0.1 * u}
    _, _, bank = bank_of(moving(laws), {"p": 8.0}, [effect("p"), effect("q")])
    sizes = [x.size for x in bank.responses if x.candidate.id == "p"]
    assert sizes == pytest.approx([1.0, -1.0, 8.0, -8.0, 4.757, 7.025], abs=1e-3)  # the last two: where it sets in


def test_an_effect_that_shows_next_to_nothing_is_run_at_every_size():
    laws = {"p": lambda u: 0.1 * u, "q": lambda u: 1e-4 * u + 0.1 * max(0.0, u - 2.0)}
    _, _, bank = bank_of(moving(laws), {}, [effect("p"), effect("q", -0.5, 8.0)])
    sizes = [x.size for x in bank.responses if x.candidate.id == "q"]
    assert sorted(s for s in sizes if not 1.0 < s < 3.0) == [-0.5, -0.3, -0.1, -0.03, 0.03, 0.1, 0.3, 1.0, 3.0, 8.0]
    assert len(sizes) == 13  # three more between 1 and 3, where it sets in
    assert [x.size for x in bank.responses if x.candidate.id == "p"] == [1.0, -1.0, 0.1, -0.1]


def test_an_effect_that_does_the_same_at_the_first_sizes_is_run_at_every_size():
    laws = {"p": lambda u: 0.1 * u, "q": lambda u: 0.1 * (u > 0.0) * (1.0 + max(0.0, u - 2.0))}
    _, _, bank = bank_of(moving(laws), {}, [effect("p"), effect("q", 0.0)])
    assert [x.size for x in bank.responses if x.candidate.id == "q"] == [1.0, 0.1, 0.03, 0.3, 3.0, 8.0]
    assert [x.size for x in bank.responses if x.candidate.id == "p"] == [1.0, -1.0, 0.1, -0.1]


def test_gains_are_the_shares_of_the_residual_that_each_effect_can_explain():
    """Oscillations that are orthogonal, so shares are those of the squared amplitudes."""
    p, nuisance_jacobian, bank = bank_of(moving(LINEAR), {"p": 1.0, "q": -0.5}, [effect(x) for x in LINEAR])
    found = shares_alone(p, bank, nuisance_jacobian)
    assert set(found) == set(LINEAR)
    assert found["p"] == pytest.approx(0.8, abs=0.03)
    assert found["q"] == pytest.approx(0.2, abs=0.03)
    assert max(found["r"], found["s"]) < 0.03


def test_without_effects_there_is_nothing_to_gain():
    p, nuisance_jacobian, bank = bank_of(moving({}), {"a": 0.5}, [])
    assert shares_alone(p, bank, nuisance_jacobian) == {}
    assert [x.candidates for x in propose_sets(p, bank, nuisance_jacobian)[1]] == [()]


def test_the_cheapest_set_is_the_true_one_at_its_sizes():
    truth = {"a": 0.6, "p": 0.7, "q": -2.2, "s": 5.0}
    p, nuisance_jacobian, bank = bank_of(moving(LINEAR), truth, [effect(x) for x in LINEAR])
    grown, proposals = propose_sets(p, bank, nuisance_jacobian)
    assert proposals[0].labels == {"p", "q", "s"}
    assert {k: proposals[0].point[k] for k in truth} == pytest.approx(truth, abs=0.1)
    assert len(grown.responses) > len(bank.responses), "sizes that the best sets asked for"
    assert [x.cost for x in proposals] == sorted(x.cost for x in proposals)
    assert len({x.labels for x in proposals}) == len(proposals)
    assert max(len(x.labels) for x in proposals) == p.settings.search.most_effects
    assert BASE[0].name in proposals[-1].point
