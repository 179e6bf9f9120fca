"""Records hold what scores, baselines and the calibration read: from them comes what comes from the folders."""

from __future__ import annotations

import json

import pytest

from benchmarks.blind.baselines import table
from benchmarks.blind.calibrate import case_of, recalibrated
from benchmarks.blind.records import Record, load, load_all, merge
from benchmarks.blind.scoring.outcome import outcomes
from benchmarks.blind.scoring.report import as_text
from benchmarks.blind.scoring.table import score

BASE = {"penalty": 3.25, "occam": 1.5, "prior": 2.0}


def hypothesis(effects, energy):
    return {
        "effects": effects, "held_out_shared": energy, "held_out_rms": energy**0.5, "fit_rms": energy**0.5,
        "unknowns": 12 + len(effects), "terms": {**BASE, "score": 7.0}, "parameters": {"a": 1.0},
    }  # fmt: skip


def judged(effects, energy):
    terms = {"fit": 1.0, "penalty": 0.5, "occam": 2.0, "prior": 3.0}
    curvature = {"energy": [0.5, 10.0], "place": [0.1, -1.0], "shared": [0.25]}
    return {"effects": effects, "label": " + ".join(effects), "structured_energy": energy, "fit_rms": energy**0.5,
            "dispersion": 1.0, "status": "converged", "terms": terms, "curvature": curvature}  # fmt: skip


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
    assert as_text(score(outcomes(kept))) == as_text(score(outcomes(whole)))
    assert outcomes(kept)[0].covered == [True]
    assert table(kept) == table(whole)


def test_records_of_schema_2_keep_effects_budget_hypotheses_and_what_the_oracle_found(folder):
    effects = {"a": {"inclusion_probability": 0.912345, "share": 0.5}, "b": {"inclusion_probability": 0.1, "share": 0}}
    part = {
        "kind": "effect", "group": "friction", "effects": ["a"], "share": 0.8, "ci95": [0.7, 0.9],
        "inclusion_probability": 0.9, "parameters": {"x.y": {"value": 1.0, "ci95": [0.5, 1.5], "unit": "m"}},
    }  # fmt: skip
    told = {
        "schema": 2, "verdict": "explained", "headline": "of no interest", "effects": effects,
        "budget": {"noise": 1.0, "delivered": 9.0, "calibrated": 5.0, "explained": 1.1, "parts": [part]},
        "hypotheses": [{"effects": ["a"], "probability": 0.9, "left": 1.2, "parameters": {"x": 1.0}, "deviance": 7.0}],
        "timing": {"wall_s": 31.0, "first_budget_s": 9.0}, "curves": [],
        "evidence": {"readings": 2000, "hypotheses": [judged([], 60.0), judged(["a"], 1.25)]},
    }  # fmt: skip
    oracle = {"true": {"effects": ["a"], "left": 1.1, "deviance": 5.0, "point": {"x.y": 1.0}}, "said": {}}
    (folder / "diagnoses" / "case_0000" / "diagnosis.json").write_text(json.dumps(told))
    (folder / "diagnoses" / "case_0000" / "oracle.json").write_text(json.dumps(oracle))
    file = folder / "records.jsonl"
    merge(file, load(folder))
    whole, kept = load(folder)[0], load(file)[0]
    assert kept.diagnosis["effects"]["a"]["inclusion_probability"] == 0.91234
    assert kept.diagnosis["hypotheses"] == [{"effects": ["a"], "probability": 0.9, "left": 1.2, "deviance": 7.0}]
    assert kept.oracle["true"] == {"effects": ["a"], "left": 1.1, "deviance": 5.0}
    assert "headline" not in kept.diagnosis
    assert as_text(score(outcomes([kept]))) == as_text(score(outcomes([whole])))
    assert case_of(kept.answer, kept.diagnosis) == case_of(whole.answer, whole.diagnosis)
    again = recalibrated(kept).diagnosis["effects"]
    assert again == recalibrated(whole).diagnosis["effects"]
    assert again["a"]["inclusion_probability"] > 0.5


def test_what_an_earlier_method_judged_stays(folder):
    record = load(folder)[0]
    assert recalibrated(record) is record


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


def test_cases_of_two_seeds_and_those_that_one_place_lacks(folder):
    first, second = load(folder)
    other = Record(first.name, {**first.answer, "seed": -1}, first.diagnosis)
    a, b = folder / "a.jsonl", folder / "b.jsonl"
    merge(a, [first._replace(diagnosis=None), other])
    assert len(load(a)) == 2
    merge(b, [first, second])
    every = load_all([a, b])
    assert len(every) == 3
    assert all(record.diagnosis is not None for record in every if record.name == first.name)
