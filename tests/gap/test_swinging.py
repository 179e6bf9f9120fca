"""A whole diagnosis of a machine that swings by itself, which no shift of time makes keep pace with its model."""

import json
import re

import numpy as np
import pytest
from deepsea_cosim.gap.campaign.read import read
from deepsea_cosim.gap.diagnose import diagnose
from deepsea_cosim.gap.problem.stop import StopToken
from deepsea_cosim.gap.report import write_report
from deepsea_cosim.gap.report.collect import collect
from deepsea_cosim.gap.result.write import write

from .oscillator import campaign, measure

DRIVE = """
[[effect]]
id = "drive"
text = "something drives the swing"
group = "force"
[[effect.parameter]]
address = "o.mu"
neutral = 0
bounds = [0, 20]
prior = 2
"""


def push(t, seed):
    """A slow force [N], which the machine follows without swinging."""
    return 0.4 * np.sin(0.5 * np.asarray(t) + seed)


def written(d, folder):
    """The files of a diagnosis."""
    write_report(write(d, folder), collect(d.state), folder)


@pytest.fixture(scope="module")
def posed(toys, tmp_path_factory):
    """A campaign of a machine with a drive of 6.3 N s/m."""
    folder = tmp_path_factory.mktemp("swinging")
    runs = [measure(seed, lambda t, x, v: 6.3 * (1.0 - (x / 0.02) ** 2) * v, push=push) for seed in (1, 2)]
    return read(campaign(folder, toys, runs, effects=DRIVE))


@pytest.fixture(scope="module")
def swinging(posed, tmp_path_factory):
    """Its diagnosis on disk."""
    folder = tmp_path_factory.mktemp("out")
    written(diagnose(posed, processes=1), folder)
    return folder


def diagnosis(folder):
    return json.loads((folder / "diagnosis.json").read_text())


def swings(data):
    return [o["swing"] for o in data["observations"] if o["as"] == "swing"]


def test_the_drive_is_found_with_its_size(swinging):
    data = diagnosis(swinging)
    assert data["verdict"] == "explained"
    assert data["hypotheses"][0]["effects"] == ["drive"]
    assert data["hypotheses"][0]["parameters"]["o.mu"]["value"] == pytest.approx(6.3, rel=0.05)
    assert data["budget"]["explained"] < 1.2


def test_it_is_told_how_machine_and_models_swing(swinging):
    found = swings(diagnosis(swinging))
    assert len(found) == 2
    for x in found:
        assert x["swings"]
        assert x["explained"]["swings"]
        assert not x["model"]["swings"]
        assert x["frequency"] == pytest.approx(np.sqrt(78.0 / 2.05) / (2.0 * np.pi), rel=0.05)
        assert x["explained"]["frequency"] == pytest.approx(x["frequency"], rel=0.02)
        assert x["explained"]["amplitude"] == pytest.approx(x["amplitude"], rel=0.1)


def test_the_page_tells_it_and_draws_all_samples(swinging):
    text = (swinging / "report.html").read_text(encoding="utf-8")
    assert "swings by itself" in text
    embedded = json.loads(re.search(r'id="signals-data">(.*?)</script>', text)[1])
    assert [len(run["traces"]) for run in embedded["runs"]] == [1, 1]


@pytest.mark.parametrize("stage", ["finite differences", "comparing sets of effects"])
def test_stopped_early_the_page_is_drawn_without_what_was_not_simulated(posed, tmp_path, stage):
    said = []
    written(diagnose(posed, on_stage=said.append, processes=1, stop=StopToken(lambda: stage in said)), tmp_path)
    data = diagnosis(tmp_path)
    assert not data["finished"]
    assert swings(data)
    assert (tmp_path / "report.html").exists()
    assert "NaN" not in (tmp_path / "diagnosis.json").read_text()
