"""Small blind cases from generation to score: one run each, few channels; none of these seeds is reported.

Some minutes of CPU time; the parts have tests of their own, and test_diagnose.py finds such effects in small.
"""

import json
from functools import cache

import pytest
from deepsea_cosim.gap.cli import main

from benchmarks.blind.generate import write_case
from benchmarks.blind.records import Record
from benchmarks.blind.scoring.outcome import outcomes
from benchmarks.blind.scoring.table import score

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("plant")]

SEED = 5
CASES = {176: "valve_dead_zone, 0.4 floors"}
MORE = {231: "nothing wrong, one channel", 158: "a valve with play, not in the catalogue"}


@pytest.fixture(scope="module")
def diagnosed(built, tmp_path_factory):
    """What came of a case, by its index."""
    folder = tmp_path_factory.mktemp("blind")

    @cache
    def outcome(index):
        answer = write_case(SEED, index, folder, built / "deepsea_0km.ssp", refit=False, edition=1)
        assert answer["case"] == index
        name = f"case_{index:04d}"
        out = folder / "diagnoses" / name
        campaign = str(folder / name / "campaign.toml")
        assert main(["diagnose", campaign, "--out", str(out), "--no-report", "--quiet"]) == 0
        sealed = json.loads((folder / "answers" / f"{name}.json").read_text())
        return outcomes([Record(name, sealed, json.loads((out / "diagnosis.json").read_text()))])[0]

    return outcome


@pytest.mark.slow
@pytest.mark.parametrize("index", [pytest.param(k, id=v) for k, v in {**CASES, **MORE}.items()])
def test_right_answer(diagnosed, index):
    assert diagnosed(index).exact, diagnosed(index).said.statements


@pytest.mark.slow
def test_scores(diagnosed):
    result = score([diagnosed(index) for index in CASES])
    assert result["cases"] == len(CASES)
    assert result["failed"] == 0
    assert result["false_alarms"]["hits"] == 0
    assert result["calibration_error"] < 0.2


@pytest.mark.slow
def test_no_effect_is_said_where_the_catalogue_lacks_it(diagnosed):
    assert score([diagnosed(index) for index in (*CASES, *MORE)])["named_outside"]["hits"] == 0
