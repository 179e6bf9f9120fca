"""A command replaces what it has made itself, and nothing else."""

import os

import pytest
from deepsea_cosim.core.errors import OutputError
from deepsea_cosim.core.files import replacing
from deepsea_cosim.core.owned import read_object, refuse_others


@pytest.mark.parametrize("text", ["", "{", "[]", "[" * 100_000, "null", '"text"', "\udcff"])
def test_what_is_no_object_is_an_empty_one(tmp_path, text):
    (tmp_path / "a.json").write_bytes(text.encode("utf-8", "surrogateescape"))
    assert read_object(tmp_path / "a.json") == {}
    assert read_object(tmp_path / "none.json") == {}


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="there are no pipes here")
def test_a_pipe_is_not_waited_for(tmp_path):
    os.mkfifo(tmp_path / "a.json")
    assert read_object(tmp_path / "a.json") == {}
    os.mkfifo(tmp_path / ".b.part.json")
    with replacing(tmp_path / "b.json") as part:
        part.write_text("{}")
    assert (tmp_path / "b.json").read_text() == "{}"


def test_files_of_others_are_refused(tmp_path):
    (tmp_path / "b").symlink_to(tmp_path / "nowhere")
    refuse_others(tmp_path, ("a",), "a run")
    with pytest.raises(OutputError, match="holds 'b', which a run has not left there; --out names another folder"):
        refuse_others(tmp_path, ("a", "b"), "a run")
