"""Parts of the search that are left out are there, and what is diagnosed without them is counted on the same cases."""

import json
import subprocess

import pytest
from deepsea_cosim.gap.pipeline.pipeline import PIPELINE

from benchmarks.blind.ablation import COLUMNS, PARTS, ROOT, command, left_out, place, row, table
from benchmarks.blind.records import load

RECORDS = ROOT / "benchmarks" / "blind" / "records"


@pytest.mark.parametrize("part", PARTS)
def test_every_part_is_one_of_the_pipeline(part):
    assert len(left_out(PIPELINE, PARTS[part])) == len(PIPELINE) - len(PARTS[part])


def test_a_part_that_is_none_is_told():
    with pytest.raises(ValueError, match="no stage is called guessing"):
        left_out(PIPELINE, ["guessing"])


def test_the_program_is_called_like_the_diagnosis(tmp_path):
    told = subprocess.run([command(tmp_path, "curves"), "--help"], capture_output=True, text=True, cwd=tmp_path)
    assert "diagnose" in told.stdout, told.stderr


def test_only_cases_that_every_part_has_are_counted(tmp_path):
    """Of recorded cases: all of them as the whole, and all but the first without forms."""
    records = load(RECORDS / "development-20261128-again.jsonl")[:4]
    (tmp_path / "answers").mkdir()
    for part in ("whole", "forms"):
        for record in records[part == "forms" :]:
            (tmp_path / "answers" / f"{record.name}.json").write_text(json.dumps(record.answer))
            (told := place(tmp_path, part) / record.name).mkdir(parents=True)
            (told / "diagnosis.json").write_text(json.dumps(record.diagnosis))
    head, whole, forms = table(tmp_path, ["whole", "forms"])
    assert head == COLUMNS
    assert whole[1:] == forms[1:] == row("whole", records[1:])[1:]
    assert whole[1] == "3"
