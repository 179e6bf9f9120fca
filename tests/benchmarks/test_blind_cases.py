"""Small blind cases from generation to score: one run each, few channels; none of these seeds is reported."""

import json

import pytest
from deepsea_cosim.gap.cli import main

from benchmarks.blind.generate import write_case
from benchmarks.blind.score import Outcome, Said, Truth, score

SEED = 5
CASES = {
    176: "valve_dead_zone, 0.4 floors",
    231: "nothing wrong, one channel",
    158: "a valve with play, not in the catalogue",
}


@pytest.fixture(scope="module")
def outcomes(built, tmp_path_factory):
    folder = tmp_path_factory.mktemp("blind")
    made = {}
    for index in CASES:
        answer = write_case(SEED, index, folder, built / "deepsea_0km.ssp", refit=False)
        assert answer["case"] == index
        name = f"case_{index:04d}"
        out = folder / "diagnoses" / name
        campaign = str(folder / name / "campaign.toml")
        assert main(["diagnose", campaign, "--out", str(out), "--no-report", "--quiet"]) == 0
        sealed = json.loads((folder / "answers" / f"{name}.json").read_text())
        made[index] = Outcome(name, Truth.of(sealed), Said.of(json.loads((out / "diagnosis.json").read_text())))
    return made


@pytest.mark.parametrize("index", [pytest.param(k, id=v) for k, v in CASES.items()])
def test_right_answer(outcomes, index):
    assert outcomes[index].exact, outcomes[index].said.names


def test_scores(outcomes):
    result = score(list(outcomes.values()))
    assert result["cases"] == len(CASES)
    assert result["failed"] == 0
    assert result["false_alarms"]["hits"] == 0
    assert result["unknown_recall"]["hits"] == 1
    assert 0.0 <= result["brier"] <= 2.0
