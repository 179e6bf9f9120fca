"""Records hold what scores, baselines and the calibration read: from them comes what comes from the folders."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from deepsea_cosim.gap.selection.calibration import Calibration

from benchmarks.blind import records
from benchmarks.blind.baselines import table
from benchmarks.blind.calibrate import features_of, recalibrated, scores
from benchmarks.blind.records import Record, load, merge
from benchmarks.blind.report import as_text
from benchmarks.blind.score import outcomes_of, score

BASE = {"penalty": 3.25, "occam": 1.5, "prior": 2.0}


def hypothesis(effects, energy):
    return {
        "effects": effects, "held_out_shared": energy, "held_out_rms": energy**0.5, "fit_rms": energy**0.5,
        "unknowns": 12 + len(effects), "terms": {**BASE, "score": 7.0}, "parameters": {"a": 1.0},
    }  # fmt: skip


def diagnosis(cause, energy):
    return {
        "campaign": "of no interest",
        "verdict": "explained",
        "causes": [
            {
                "effects": [cause], "probability": 2.0 / 3.0, "ambiguous_with": ["other"], "evidence": "a sentence",
                "parameters": {"x.y": {"value": 1.0, "ci95": [0.5, 1.5], "unit": "m"}},
            },
        ],
        "probabilities": {"none": 0.0, "unknown": 1.0 / 3.0},
        "gap": {"before": 9.0, "after_calibration": 8.0, "after": 1.0, "reduction": 0.9, "explainable_reduction": 0.95},
        "timing": {"wall_s": 31.0, "stages": {}},
        "evidence": {
            "readings": 2000,
            "hypotheses": [hypothesis([], 60.0), hypothesis([cause], energy)],
            "screening": [{"effect": cause, "gain": 0.9}, {"effect": "b", "gain": 0.1}],
        },
    }  # fmt: skip


@pytest.fixture
def folder(tmp_path):
    """Three cases: one diagnosed right, one that failed, one that is still to do."""
    (tmp_path / "answers").mkdir()
    for k in range(3):
        effect = {"id": "a", "group": "friction", "alike": ["a"], "library": {"x.y": 1.2}, "plant": {"z": 1.0}}
        answer = {"case": k, "seed": 1, "kind": "single", "effects": [effect], "size": 5.0, "base": {}}
        (tmp_path / "answers" / f"case_{k:04d}.json").write_text(json.dumps(answer))
    for k in (0, 1):
        (tmp_path / "diagnoses" / f"case_{k:04d}").mkdir(parents=True)
    (tmp_path / "diagnoses" / "case_0000" / "diagnosis.json").write_text(json.dumps(diagnosis("a", 1.01)))
    (tmp_path / "diagnoses" / "case_0001" / "failed.txt").write_text("exit 1")
    return tmp_path


def test_cases_of_a_folder(folder):
    assert [c.name for c in load(folder)] == ["case_0000", "case_0001"]
    assert [c.name for c in load(folder, missing=True)] == ["case_0000", "case_0001", "case_0002"]
    assert load(folder)[1].diagnosis is None
    assert load(folder, folder / "elsewhere") == []


def test_what_is_read_from_records_is_what_the_folder_says(folder):
    file = folder / "records.jsonl"
    merge(file, load(folder))
    whole, kept = load(folder), load(file)
    assert "plant" not in file.read_text()
    assert as_text(score(*outcomes_of(kept))) == as_text(score(*outcomes_of(whole)))
    assert outcomes_of(kept)[0][0].covered() == [True]
    assert outcomes_of(kept)[0][0].said.others == (("other",),)
    assert table(kept) == table(whole)
    calibration = Calibration.load()
    assert scores(kept[0].diagnosis, calibration) == pytest.approx(scores(whole[0].diagnosis, calibration), rel=1e-5)
    assert np.allclose(features_of(kept[0].diagnosis, calibration), features_of(whole[0].diagnosis, calibration), 1e-5)


def test_records_grow_case_by_case_and_the_last_word_counts(folder):
    file = folder / "records.jsonl"
    first, second = load(folder)
    merge(file, [second])
    merge(file, [first])
    assert [c.name for c in load(file)] == ["case_0000", "case_0001"]
    merge(file, [Record("case_0001", second.answer, diagnosis("b", 2.0))])
    assert load(file)[1].diagnosis["causes"][0]["effects"] == ["b"]
    before = file.read_text()
    merge(file, load(file))
    assert file.read_text() == before


def test_a_record_is_judged_again_as_its_diagnosis_was():
    """With the calibration of commit ca363ed, of which the cases from 78 on are."""
    file = Path(records.__file__).parent / "records" / "development-20261125.jsonl"
    weights = (7.4215950977889635, 3.1057294571178846, 1.219103301980494)
    earlier = Calibration(15.0, 0.01, 1.0, 0.2, weights, misjudged=0.03, stuck=0.1)
    cases = [record for record in load(file) if record.name >= "case_0078"]
    assert len(cases) == 17
    for record in cases:
        again = recalibrated(record, earlier)
        (before, told), (after, now) = (
            (tuple(c["effects"]), c["probability"])
            for c in (max(r.diagnosis["causes"], key=lambda c: c["probability"]) for r in (record, again))
        )
        assert len(again.diagnosis["causes"]) == len(record.diagnosis["causes"])
        assert (after, now) == (before, pytest.approx(told, abs=2e-3))
        assert sum(c["probability"] for c in again.diagnosis["causes"]) == pytest.approx(1.0)
