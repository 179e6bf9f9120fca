"""How much of a metric each parameter makes: shares that are known in closed form."""

from __future__ import annotations

import numpy as np
import pytest
from deepsea_cosim.study.sweep.axes import parse_axis
from deepsea_cosim.study.sweep.cases import sample
from deepsea_cosim.study.sweep.sensitivity import sensitivities


@pytest.mark.parametrize("kind", ["saltelli", "sobol"])
def test_shares_of_a_sum_of_squares_known_in_closed_form(kind):
    """y = 3 a + b with a, b uniform on [0, 1]: the variances are as 9 to 1."""
    pytest.importorskip("SALib")
    axes = [parse_axis("a=0:1"), parse_axis("b=0:1"), parse_axis("c=5:6")]
    cases = sample(axes, kind, 512)
    found = sensitivities(axes, kind, cases, [3 * c["a"] + c["b"] for c in cases])
    shares = {n: v["value"] for n, v in found["first order"].items()}
    assert shares == pytest.approx({"a": 0.9, "b": 0.1, "c": 0.0}, abs=0.05)
    assert "does not vary" in sensitivities(axes, kind, cases, [1.0] * len(cases))
    missing = sensitivities(axes, kind, cases, [None, *(3 * c["a"] + c["b"] for c in cases[1:])])
    if kind == "saltelli":
        assert "1 of 4096 cases have no value" in missing
    else:
        assert missing["first order"]["a"]["value"] == pytest.approx(0.9, abs=0.05)


@pytest.mark.parametrize("sampling", ["sobol", "lhs"])
@pytest.mark.parametrize(
    "texts", [("a=0:1", "b=0:1", "c=0:1"), ("a=0,1", "b=0,1", "c=0,1"), ("a=0:1", "b=0,1,2,3", "c=0:1")]
)
@pytest.mark.parametrize("number", [64, 256])
def test_first_order_shares_of_a_linear_model(sampling, texts, number):
    """y = 4 a + 2 b + c: shares are those of the terms' variances."""
    axes = [parse_axis(text) for text in texts]
    spread = [1 / 12 if a.is_range else float(np.var(a.values)) for a in axes]
    parts = np.array([16.0, 4.0, 1.0]) * spread
    worst = []
    for seed in range(6):
        cases = sample(axes, sampling, number, seed)
        found = sensitivities(axes, sampling, cases, [4 * c["a"] + 2 * c["b"] + c["c"] for c in cases])["first order"]
        errors = [found[n]["value"] - p for n, p in zip("abc", parts / parts.sum(), strict=True)]
        worst.append(max(map(abs, errors)))
        assert all(0.0 <= found[n]["half_width"] < 0.3 for n in "abc")
    assert max(worst) < (0.06 if sampling == "sobol" else 2.4 / number**0.5)  # that of chance
    assert float(np.mean(worst)) < (0.05 if sampling == "sobol" else 1.2 / number**0.5)


def test_shares_over_a_list_of_more_values_than_the_sample_can_tell_apart():
    """Every case has a value of its own."""
    axes = [parse_axis("a=0:11000:50"), parse_axis("b=0:1")]
    cases = sample(axes, "lhs", 64)
    assert len({c["a"] for c in cases}) == 64
    found = sensitivities(axes, "lhs", cases, [3.0 * c["a"] / 11000.0 + c["b"] for c in cases])["first order"]
    assert found["a"]["value"] == pytest.approx(0.9, abs=0.1)
    assert found["b"]["value"] == pytest.approx(0.1, abs=0.15)
    assert np.isfinite([v["half_width"] for v in found.values()]).all()


def test_first_order_shares_of_ishigamis_function():
    """Closed form: 0.3139, 0.4424 and 0."""
    axes = [parse_axis(f"{n}=-3.14159265:3.14159265") for n in "abc"]
    cases = sample(axes, "sobol", 512)
    y = [np.sin(c["a"]) + 7 * np.sin(c["b"]) ** 2 + 0.1 * c["c"] ** 4 * np.sin(c["a"]) for c in cases]
    found = sensitivities(axes, "sobol", cases, y)["first order"]
    assert [found[n]["value"] for n in "abc"] == pytest.approx([0.3139, 0.4424, 0.0], abs=0.03)
