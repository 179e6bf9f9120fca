"""A whole diagnosis of a machine whose effect is in another form than the plain one."""

import json

import numpy as np
import pytest
from deepsea_cosim.gap.campaign.read import read
from deepsea_cosim.gap.diagnose import diagnose
from deepsea_cosim.gap.result.document import document

from .oscillator import EFFECTS, campaign, measure

FORM = """
[[effect.form]]
id = "unequal_directions"
text = "greater one way than the other"
[[effect.form.parameter]]
address = "o.uneven"
neutral = 0
bounds = [-0.9, 0.9]
prior = 0.3
starts = [-0.4, 0.4]
"""

WITH_FORM = EFFECTS.replace('\n[[effect]]\nid = "cubic_spring"', FORM + '\n[[effect]]\nid = "cubic_spring"')


def machine(uneven):
    """Two runs of a machine that rubs with 0.5 N, so much more while moving out than while moving in."""
    def friction(t, x, v):
        s = np.tanh(v / 0.01)
        return -0.5 * (1.0 + uneven * s) * s

    return [measure(seed, friction) for seed in (1, 2)]


def diagnosed(toys, folder, uneven, held_out=""):
    path = campaign(folder, toys, machine(uneven))
    text = path.read_text()
    if held_out:
        text = text.replace(f'file = "{held_out}"', f'file = "{held_out}"\nuse = "holdout"')
    path.write_text(text)
    (folder / "effects.toml").write_text(WITH_FORM)
    return document(diagnose(read(path), processes=1))


def friction_of(data):
    (part,) = [p for p in data["budget"]["parts"] if p["kind"] == "effect" and p["group"] == "force"]
    return part


@pytest.fixture(scope="module")
def uneven(toys, tmp_path_factory):
    return diagnosed(toys, tmp_path_factory.mktemp("uneven"), 0.5)


def test_effect_and_form_are_found_with_their_sizes(uneven):
    assert uneven["verdict"] == "explained"
    part = friction_of(uneven)
    assert part["effects"] == ["friction"]
    assert part["form"]["id"] == "unequal_directions"
    assert part["form"]["inclusion_probability"] > 0.9
    assert part["parameters"]["o.F_c"]["value"] == pytest.approx(0.5, rel=0.05)
    assert part["parameters"]["o.uneven"]["value"] == pytest.approx(0.5, abs=0.05)
    low, high = part["parameters"]["o.uneven"]["ci95"]
    assert low < 0.5 < high
    assert uneven["hypotheses"][0]["forms"] == {"friction": "unequal_directions"}
    assert uneven["budget"]["explained"] < 1.15


def test_the_form_has_a_share_within_that_of_its_effect(uneven):
    part = friction_of(uneven)
    assert 0.0 < part["form"]["share"] < part["share"]
    assert sum(p["share"] for p in uneven["budget"]["parts"]) == pytest.approx(1.0)
    plain = next(h for h in uneven["evidence"]["hypotheses"] if h["label"] == "friction")
    assert plain["held_out_rms"] > 2.0 > 1.1 > uneven["budget"]["explained"]


@pytest.mark.slow
def test_with_a_run_held_out_the_share_is_what_the_plain_form_leaves_there(toys, tmp_path):
    """Simulated there before the processes end: written after, the whole diagnosis was lost."""
    data = diagnosed(toys, tmp_path, 0.5, held_out="run1.csv")
    part, budget = friction_of(data), data["budget"]
    assert part["form"]["id"] == "unequal_directions"
    assert budget["held_out"].startswith("runs")
    assert budget["explained"] == pytest.approx(1.0, abs=0.05)
    plain = next(h for h in data["evidence"]["hypotheses"] if h["label"] == "friction")
    like_learned = (plain["held_out_rms"] ** 2 - 1.0) / (budget["calibrated"] ** 2 - 1.0)
    assert part["form"]["share"] == pytest.approx(like_learned, rel=0.5)


def test_the_plain_form_is_said_of_a_machine_that_has_it(toys, tmp_path):
    data = diagnosed(toys, tmp_path, 0.0)
    part = friction_of(data)
    assert part["form"] is None
    assert data["hypotheses"][0]["forms"] == {}
    assert json.dumps(data["hypotheses"][0]["parameters"]).count("uneven") == 0
