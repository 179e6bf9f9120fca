"""Which diagnosis.json is read, and what is said of the others."""

import json

import pytest
from deepsea_cosim.core.errors import CosimError
from deepsea_cosim.gap.result.read import load

from ..report.made import diagnosis


def test_reads_a_file_and_a_folder(tmp_path):
    (tmp_path / "diagnosis.json").write_text(json.dumps(diagnosis()))
    assert load(tmp_path) == load(tmp_path / "diagnosis.json") == json.loads(json.dumps(diagnosis()))


@pytest.mark.parametrize("text", ['{"schema": 1}', '{"schema": 3}', '{"schema": "2"}', "{}", "[]", "no json", "\udcff"])
def test_refuses_others_in_one_line(tmp_path, text):
    path = tmp_path / "diagnosis.json"
    path.write_bytes(text.encode("utf-8", "surrogateescape"))
    with pytest.raises(CosimError) as caught:
        load(path)
    assert str(caught.value).startswith(str(path))
    assert "\n" not in str(caught.value)


def test_a_missing_file(tmp_path):
    with pytest.raises(CosimError, match="cannot be read"):
        load(tmp_path / "none.json")
