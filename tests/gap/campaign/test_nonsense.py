"""What no campaign and no catalogue can mean is one line, however it is written; inputs are never replaced."""

import os
import stat
import zipfile

import numpy as np
import pytest
from deepsea_cosim.core.errors import CosimError
from deepsea_cosim.core.files import replacing
from deepsea_cosim.gap.campaign import read_catalogue
from deepsea_cosim.gap.campaign.read import read
from deepsea_cosim.gap.cli import main

from tests.gap.campaign.test_campaign import CAMPAIGN, table

HUGE = f"0x{'f' * 6000}"

CATALOGUE = """
[[effect]]
id = "friction"
text = "the seal rubs"
group = "friction"
[[effect.parameter]]
address = "o.F"
neutral = 0.0
bounds = [0.0, 3000.0]
prior = 300.0
"""


@pytest.fixture
def campaign(tmp_path):
    def write(old="", new="", run=None):
        (tmp_path / "s.ssp").write_bytes(b"x")
        (tmp_path / "run1.csv").write_text(run or table())
        assert old in CAMPAIGN
        (tmp_path / "c.toml").write_text(CAMPAIGN.replace(old, new, 1))
        return tmp_path / "c.toml"

    return write


@pytest.mark.parametrize(("old", "new", "message"), [
    ('name = "pool"', f"name = {HUGE}", "'name' = a number of thousands of digits has the wrong type"),
    ('name = "pool"', 'name = "po\\u001bol"', r"'name' = 'po\\x1bol' has to be a name in one line"),
    ('name = "pool"', 'name = " "', "has to be a name in one line"),
    ('unit = "mm"', 'unit = "mm"\nclock_jitter = 1e6', r"'x': clock_jitter = 1e\+06 s is 1e\+07 sample in"),
    ('unit = "mm"', 'unit = "mm"\nmodel_form_scatter = 1e6', r"model_form_scatter = 1e\+06 mm would hide it"),
    ('unit = "mm"', 'unit = "mm"\nscale = 1e308', r"scale = 1e\+308 is no quantity of a machine"),
    ('file = "run1.csv"', f'file = "run1.csv"\nname = {HUGE}', "'name' = a number of thousands of digits"),
    ("tolerance = 0.02", f"tolerance = {HUGE}", "'tolerance' is not finite|digits"),
])  # fmt: skip
def test_campaigns(campaign, old, new, message):
    with pytest.raises(CosimError, match=message) as refused:
        read(campaign(old, new))
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(("change", "message"), [
    ("target = 1e300", "'target' = 1e.300 is no quantity of a machine"),
    ("within = 1e300", "'within' = 1e.300 is no quantity of a machine"),
    ("std = 1e300", "'std' = 1e.300 s, but the run ends at 10 s"),
    ("until = 1e9", r"'until' = 1e\+09 s, but the run ends at 10 s"),
])  # fmt: skip
def test_events(tmp_path, change, message):
    event = {"connector": '"o.x"', "target": 1.0, "within": 0.1, "after": 1.0, "std": 0.1, "time": 2.0}
    key, _, value = change.partition(" = ")
    lines = [f"{k} = {v}" for k, v in {**event, key: value}.items()]
    (tmp_path / "s.ssp").write_bytes(b"x")
    text = 'system = "s.ssp"\n[[run]]\nstop_time = 10.0\n[[run.event]]\n' + "\n".join(lines)
    (tmp_path / "c.toml").write_text(text)
    with pytest.raises(CosimError, match=message):
        read(tmp_path / "c.toml")


@pytest.mark.parametrize(("old", "new", "message"), [
    ("prior = 300.0", "prior = 1e308", "'prior' = 1e.308 does not go with the bounds"),
    ("prior = 300.0", "prior = 1e-320", "does not go with the bounds"),
    ("[0.0, 3000.0]", "[0.0, 1e300]", "are no range that can be searched"),
    ('id = "friction"', f"id = {HUGE}", "'id' = a number of thousands of digits"),
    ('id = "friction"', 'id = "fric\\ntion"', r"'id' = 'fric\\ntion' has to be a name in one line"),
    ('id = "friction"', 'id = ""', "has to be a name in one line"),
    ("\n[[effect]]", "schema = true\n[[effect]]", "schema = True is not known"),
    ("prior = 300.0", 'prior = 300.0\n[estimation]\nparameters = { "o.tol" = [1e-4] }', "has to be a number"),
])  # fmt: skip
def test_catalogues(old, new, message):
    read_catalogue.parse(CATALOGUE)
    with pytest.raises(CosimError, match=message):
        read_catalogue.parse(CATALOGUE.replace(old, new, 1))


def test_a_catalogue_that_is_too_large_or_encrypted(tmp_path, monkeypatch):
    (tmp_path / "e.toml").write_text(CATALOGUE)
    monkeypatch.setenv("DEEPSEA_COSIM_MAX_TOML_MB", "1e-5")
    with pytest.raises(CosimError, match="DEEPSEA_COSIM_MAX_TOML_MB="):
        read_catalogue.load(tmp_path / "e.toml")
    with zipfile.ZipFile(tmp_path / "p.ssp", "w") as archive:
        archive.writestr("SystemStructure.ssd", "")
        archive.writestr(read_catalogue.PACKED, CATALOGUE)
    with pytest.raises(CosimError, match="DEEPSEA_COSIM_MAX_TOML_MB="):
        read_catalogue.load_from_package(tmp_path / "p.ssp")
    monkeypatch.delenv("DEEPSEA_COSIM_MAX_TOML_MB")
    content = bytearray((tmp_path / "p.ssp").read_bytes())
    for mark, place in ((b"PK\x03\x04", 6), (b"PK\x01\x02", 8)):
        content[content.rindex(mark) + place] |= 1  # encrypted
    (tmp_path / "q.ssp").write_bytes(content)
    with pytest.raises(CosimError, match="encrypted"):
        read_catalogue.load_from_package(tmp_path / "q.ssp")


def test_only_regular_files_are_replaced(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(CosimError, match="is a pipe"), replacing(tmp_path / "pipe"):
        raise AssertionError
    assert stat.S_ISFIFO((tmp_path / "pipe").stat().st_mode)


def test_what_is_packed_is_not_replaced(campaign, tmp_path, capsys):
    path = campaign()
    for name in ("c.toml", "run1.csv", "s.ssp"):
        before = (tmp_path / name).read_bytes()
        assert main(["pack", str(path), "--out", str(tmp_path / name), "--force"]) == 2
        assert "which is packed; --out names another file" in capsys.readouterr().err
        assert (tmp_path / name).read_bytes() == before


def test_an_archive_names_no_file_outside_of_it(campaign, tmp_path, capsys):
    path = campaign()
    (tmp_path / "secret.csv").write_text("a secret\nin two lines\n")
    for name in (str(tmp_path / "secret.csv"), "../../../secret.csv"):
        with zipfile.ZipFile(tmp_path / "c.zip", "w") as archive:
            archive.writestr("campaign.toml", path.read_text().replace("run1.csv", name))
            archive.write(tmp_path / "s.ssp", "s.ssp")
        assert main(["check", str(tmp_path / "c.zip"), "--out", str(tmp_path / "out")]) == 2
        said = capsys.readouterr().err
        assert f"c.zip: names the file '{name}', which is not in it" in said
        assert "secret\n" not in said


def test_twenty_thousand_channels_are_refused_in_a_moment(campaign, tmp_path):
    path = campaign()
    more = "".join(f'[[channel]]\ncolumn = "c{k}"\nconnector = "o.c{k}"\nunit = "m"\n' for k in range(20_000))
    path.write_text(path.read_text() + more + '[[channel]]\ncolumn = "c7"\nconnector = "o.other"\nunit = "m"\n')
    with pytest.raises(CosimError, match="channels 'c7' and 'c7' share a column or connector"):
        read(path)


def test_a_wide_table_is_read(campaign):
    columns = {f"c{k}": np.zeros(50) for k in range(40_000)}
    assert len(read(campaign(run=table(**columns))).runs) == 1
