"""A campaign in one file is read as the folder it was made of."""

import json
import zipfile
from importlib import import_module

import numpy as np
import pytest
from deepsea_cosim.core.errors import CosimError
from deepsea_cosim.gap.campaign.packed import opened
from deepsea_cosim.gap.campaign.read import read
from deepsea_cosim.gap.cli import main

from tests.gap.oscillator import campaign as write_campaign


@pytest.fixture(scope="module")
def campaign(toys, rig, tmp_path_factory):
    folder = tmp_path_factory.mktemp("campaign")
    return write_campaign(folder, toys, rig.runs, head='accept = []  # "kept"\n')


def test_what_is_packed_is_what_was_there(campaign, tmp_path):
    target = tmp_path / "one.zip"
    assert main(["pack", str(campaign), "--out", str(target)]) == 0
    with zipfile.ZipFile(target) as archive:
        assert {"campaign.toml", "toy.ssp", "effects.toml", "runs/run0.csv", "runs/run1.csv"} == set(archive.namelist())
        assert '# "kept"' in archive.read("campaign.toml").decode()
    before = read(campaign)
    with opened(target) as file:
        after = read(file)
        assert after.system.is_file()
        assert after.channels == before.channels
        for a, b in zip(after.runs, before.runs, strict=True):
            assert all(np.array_equal(x, y) for c in b.series for x, y in zip(a.series[c], b.series[c], strict=True))
    assert not file.exists()


def test_files_of_the_same_name_and_other_ways_to_write_toml(campaign, tmp_path):
    for k in (0, 1):
        (tmp_path / f"{k}").mkdir()
        (tmp_path / f"{k}" / "run.csv").write_bytes((campaign.parent / f"run{k}.csv").read_bytes())
    (tmp_path / "toy.ssp").write_bytes((campaign.parent / "toy.ssp").read_bytes())
    text = 'system = """toy.ssp"""\n'
    text += f'effects = "{campaign.parent / "effects.toml"}"\n'
    text += 'channel = [{ column = "u", connector = "o.u", unit = "N", role = "input" },\n'
    text += '           { column = "x", connector = "o.x", unit = "mm" }]\n'
    text += 'run = [{ file = "0/run.csv", parameters = { "o.m" = 2.5 } }, { file = "1/run.csv", use = "holdout" }]\n'
    (tmp_path / "c.toml").write_text(text)
    target = tmp_path / "c.zip"
    assert main(["pack", str(tmp_path / "c.toml"), "--out", str(target)]) == 0
    with opened(target) as file:
        runs = read(file).runs
    assert [r.parameters for r in runs] == [{"o.m": 2.5}, {}]
    assert runs[1].use == "holdout"
    assert not np.array_equal(runs[0].series["o.x"][1], runs[1].series["o.x"][1])


def test_check_reads_an_archive(campaign, tmp_path, capsys):
    target = tmp_path / "one.zip"
    assert main(["pack", str(campaign), "--out", str(target)]) == 0
    capsys.readouterr()
    assert main(["check", str(target), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["picture"] == str(tmp_path / "one_check.png")
    assert (tmp_path / "one_check.png").is_file()
    assert [row["channel"] for row in told["channels"]] == ["x"]
    assert told["findings"] == []
    assert main(["pack", str(campaign), "--out", str(target), "--json"]) == 2
    failed = capsys.readouterr()
    assert "is there already" in failed.err
    assert json.loads(failed.out) == {"error": failed.err.removeprefix("cosim-gap: ").strip(), "exit_code": 2}
    assert main(["pack", str(target), "--out", str(tmp_path / "again.zip")]) == 0


@pytest.mark.parametrize(
    ("names", "part"), [(("toy.ssp",), "holds no campaign.toml"), (("../campaign.toml",), "would leave the package")]
)
def test_archives_that_are_none(tmp_path, capsys, names, part):
    target = tmp_path / "bad.zip"
    with zipfile.ZipFile(target, "w") as archive:
        for name in names:
            archive.writestr(name, "")
    for command in (["check", str(target)], ["diagnose", str(target), "--out", str(tmp_path / "out")]):
        assert main(command) == 2
        error = capsys.readouterr().err
        assert part in error
        assert error.count("\n") == 1
    assert not (tmp_path / "out").exists()


def test_diagnose_reads_an_archive(campaign, tmp_path, monkeypatch):
    target, seen = tmp_path / "one.zip", []

    def diagnosed(given, *_, **__):
        assert given.system.is_file()
        seen.append([r.name for r in given.runs])
        raise CosimError("enough")

    monkeypatch.setattr(import_module("deepsea_cosim.gap.diagnose"), "diagnose", diagnosed)
    assert main(["pack", str(campaign), "--out", str(target)]) == 0
    assert main(["diagnose", str(target), "--out", str(tmp_path / "out")]) == 2
    assert seen == [["run0", "run1"]]


@pytest.mark.parametrize(
    ("name", "old", "new", "told"),
    [
        ("campaign.toml", "accept = []", "bogus = 1", "one.zip/campaign.toml: unknown key 'bogus'"),
        ("effects.toml", 'address = "o.k3"', 'address = "o.k4"', "one.zip/effects.toml: effect cubic_spring: no comp"),
        ("campaign.toml", 'connector = "o.u"', 'connector = "o.w"', "one.zip/campaign.toml: channel 'u': no connector"),
    ],
)
def test_messages_name_files_as_in_the_archive(campaign, tmp_path, capsys, name, old, new, told):
    """And not where they are unpacked for the moment; those of catalogues, too, that do not fit the model."""
    assert main(["pack", str(campaign), "--out", str(tmp_path / "whole.zip")]) == 0
    with zipfile.ZipFile(tmp_path / "whole.zip") as source, zipfile.ZipFile(tmp_path / "one.zip", "w") as target:
        for entry in source.namelist():
            text = source.read(entry)
            if entry == name:
                assert text.count(old.encode()) == 1
                text = text.replace(old.encode(), new.encode())
            target.writestr(entry, text)
    capsys.readouterr()
    assert main(["check", str(tmp_path / "one.zip"), "--out", str(tmp_path / "out")]) == 2
    assert f"cosim-gap: {tmp_path}/{told}" in capsys.readouterr().err
