"""A whole diagnosis of a machine whose friction has no formula: the free curve over velocity."""

import numpy as np
import pytest
from deepsea_cosim.gap.campaign.read import read
from deepsea_cosim.gap.diagnose import diagnose
from deepsea_cosim.gap.result.document import document

from tests.toys.toy_oscillator import KNOTS

from .oscillator import campaign, measure

CURVE = f"""
[[curve]]
id = "friction_curve"
text = "friction of the slide over its velocity"
effects = ["friction"]
x = "m/s"
y = "N"
knots = {list(KNOTS)}
parameters = {[f"o.y{k}" for k in range(1, len(KNOTS) + 1)]}
prior = 0.4
formula = "F_c * tanh(x / 0.01)"
names = {{ F_c = "o.F_c" }}
""".replace("'", '"')


def law(v):
    """Coulomb's with a hump where it moves out fast, which no formula of the catalogue has [N]."""
    return 0.4 * np.tanh(v / 0.01) + 0.5 * np.exp(-(((v - 0.25) / 0.15) ** 2))


@pytest.fixture(scope="module")
def found(toys, tmp_path_factory):
    folder = tmp_path_factory.mktemp("curve")
    path = campaign(folder, toys, [measure(1, lambda t, x, v: -law(v))], effects=CURVE)
    return document(diagnose(read(path), processes=1))


def test_friction_is_named_with_its_curve(found):
    (part,) = [p for p in found["budget"]["parts"] if p["kind"] == "effect" and p["group"] == "force"]
    assert part["effects"] == ["friction"]
    assert part["form"]["id"] == "friction_curve"
    plain = next(h for h in found["evidence"]["hypotheses"] if h["label"] == "friction")
    assert plain["held_out_rms"] > 1.5 * found["budget"]["explained"]


def test_the_curve_is_that_of_the_machine(found):
    (curve,) = found["curves"]
    x, y = np.array(curve["points"]).T
    low, high = np.array(curve["band95"]).T
    seen = np.abs(x) < 0.3
    assert np.abs(y - law(x))[seen].max() < 0.12
    assert np.mean((low < law(x)) & (law(x) < high)) > 0.68
    assert np.median(high - low) < 0.2
    (_, plain) = np.array(curve["plain"]).T
    assert np.abs(plain - law(x))[seen].max() > 0.25
    assert curve["probability"] > 0.9


def test_its_values_are_the_parameters_to_simulate_with(found):
    values = found["hypotheses"][0]["parameters"]
    assert "o.F_c" in values
    assert not any("curve" in name for name in values)
    (curve,) = found["curves"]
    assert [x for x, _ in curve["knots"]] == list(KNOTS)
