"""What a hypothesis leaves without some of its effects."""

from __future__ import annotations

from dataclasses import replace

import pytest
from deepsea_cosim.gap.search.baseline import refit_base, simulate_nominal
from deepsea_cosim.gap.search.polish import polish
from deepsea_cosim.gap.search.subsets import complete_subsets
from deepsea_cosim.gap.selection.evidence import rank_hypotheses

from .made import effect, moving, posed, start

LINEAR = {name: (lambda u: 0.1 * u) for name in ("p", "q", "r")}
TRUTH = {"a": 0.4, "p": 0.8, "q": -0.6, "r": 0.3}


@pytest.mark.parametrize("in_time", [True, False])
def test_every_subset_has_a_fit_of_its_own(in_time):
    """Without time it is foretold by the derivatives, which on a linear formula is the same."""
    effects = [effect(name) for name in LINEAR]
    p, nuisance_jacobian = posed(moving(LINEAR), TRUTH, effects)
    baseline = refit_base(p, nuisance_jacobian, simulate_nominal(p, nuisance_jacobian))
    (whole,) = polish(p, [start(p, nuisance_jacobian, effects, {"p": 0.7, "q": -0.5, "r": 0.3})], nuisance_jacobian, 3)
    ranked = rank_hypotheses(p, [whole, baseline], nuisance_jacobian)
    p = p if in_time else replace(p, stop_requested=True, asked=[])
    made = complete_subsets(p, ranked, ranked[0], nuisance_jacobian)
    names = ["", "p", "q", "r", "pq", "pr", "qr", "pqr"]
    assert set(made) == {frozenset(x) for x in names}
    assert made[whole.labels].hypothesis is whole
    assert made[frozenset()].hypothesis is baseline
    for labels, r in made.items():
        assert r.hypothesis.labels == labels
        left = sum(TRUTH[x] ** 2 for x in set("pqr") - labels)  # squared amplitudes of orthogonal oscillations
        assert r.hypothesis.fit.rms ** 2 == pytest.approx(1.0 + 50.0 * left, rel=0.1)
    assert in_time or p.asked == []


def test_what_another_alternative_has_fitted_is_not_fitted_again():
    effects = [effect(name) for name in LINEAR]
    p, nuisance_jacobian = posed(moving(LINEAR), TRUTH, effects)
    baseline = refit_base(p, nuisance_jacobian, simulate_nominal(p, nuisance_jacobian))
    (whole,) = polish(p, [start(p, nuisance_jacobian, effects, {"p": 0.7, "q": -0.5, "r": 0.3})], nuisance_jacobian, 3)
    ranked = rank_hypotheses(p, [whole, baseline], nuisance_jacobian)
    made = complete_subsets(p, ranked, ranked[0], nuisance_jacobian)
    asked = len(p.asked)
    again = complete_subsets(p, [*ranked, *made.values()], ranked[0], nuisance_jacobian)
    assert {labels: r.hypothesis.fit.rms for labels, r in again.items()} == {
        labels: r.hypothesis.fit.rms for labels, r in made.items()
    }
    assert len(p.asked) == asked > 0
