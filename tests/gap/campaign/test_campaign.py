"""Reading campaigns, and making synthetic ones that read back."""

import tomllib
from pathlib import Path

import numpy as np
import pytest
from deepsea_cosim.core.errors import CosimError
from deepsea_cosim.gap.campaign.campaign import Run
from deepsea_cosim.gap.campaign.duplicates import copies, distinguish
from deepsea_cosim.gap.campaign.read import CampaignError, read
from deepsea_cosim.gap.cli import main
from deepsea_cosim.gap.synthetic import make

CAMPAIGN = """
name = "pool"
system = "s.ssp"
[[channel]]
column = "x"
connector = "arm.x_h"
unit = "mm"
noise_std = 0.05
[[channel]]
column = "P"
connector = "hydraulics.P1"
unit = "bar"
[[run]]
file = "run1.csv"
parameters = { "depth" = 11000.0 }
[[base]]
parameter = "hydraulics.oil.nu0"
tolerance = 0.02
"""


def table(n=50, **changes):
    t = np.arange(n) * 0.1
    columns = {"time": t, "x": 10 * t, "P": 100 + t, **changes}
    lines = [",".join(columns)]
    lines += [",".join(str(v) for v in row) for row in zip(*columns.values(), strict=True)]
    return "\n".join(lines) + "\n"


@pytest.fixture
def campaign(tmp_path):
    (tmp_path / "s.ssp").write_bytes(b"x")

    def make(text=CAMPAIGN, run=None):
        (tmp_path / "campaign.toml").write_text(text)
        (tmp_path / "run1.csv").write_text(table() if run is None else run)
        return tmp_path / "campaign.toml"

    return make


def test_values_are_converted(campaign):
    c = read(campaign())
    t, x = c.runs[0].series["arm.x_h"]
    assert x == pytest.approx(10e-3 * t)
    assert c.runs[0].series["hydraulics.P1"][1][0] == pytest.approx(1e7)
    assert c.channels[0].noise_std == pytest.approx(5e-5)
    assert c.base == {"hydraulics.oil.nu0": 0.02}
    assert c.runs[0].parameters == {"depth": 11000.0}
    assert not c.warnings


def test_missing_samples_and_gaps(campaign):
    lines = table().splitlines()
    lines[5] = "0.4,,nan"
    del lines[20:45]
    c = read(campaign(run="\n".join(lines).replace("nan", "") + "\n" + "\n".join(f"{6 + k},1,2" for k in range(9))))
    assert len(c.runs[0].series["arm.x_h"][0]) == len(c.runs[0].series["hydraulics.P1"][0])
    assert any("nothing was measured for" in w for w in c.warnings)


def test_copies_are_noticed(campaign, tmp_path):
    (tmp_path / "run2.csv").write_text(table())
    assert any("one is a copy" in w for w in read(campaign(CAMPAIGN + '[[run]]\nfile = "run2.csv"\n')).warnings)


def test_a_copy_is_told_of_the_first_run_that_it_is_like():
    one, two, three, other = [1.0, 2.0], [3.0, 4.0], [3.0, 5.0], [0.0, 0.0]
    readings = {
        "a": {"x": one, "y": two}, "b": {"x": one, "y": three}, "c": {"y": three}, "d": {"x": one, "y": two},
        "e": {"x": one, "u": other}, "f": {"u": other}, "g": {"y": two},
    }  # fmt: skip
    runs = [
        Run(name, {}, None, {c: (np.arange(2.0), np.array(v)) for c, v in series.items()}, 1.0)
        for name, series in readings.items()
    ]
    found = {again.name: first.name for first, again in copies(runs, {"x", "y"})}
    assert found == {"c": "b", "d": "a", "e": "a", "g": "a"}


def test_many_runs_are_compared_in_a_moment():
    runs = [Run(f"r{k}", {}, None, {"x": (np.arange(2.0), np.array([0.0, k]))}, 1.0) for k in range(30_000)]
    assert not list(copies(runs, {"x"}))
    distinguish(runs, [{}] * len(runs), Path("campaign.toml"))


@pytest.mark.parametrize(("key", "message"), [("max_runs", "3 runs; 2 are taken"), ("max_megabytes", "MB; 1e-05 are")])
def test_more_than_is_taken_is_refused_before_it_is_read(campaign, tmp_path, key, message):
    (tmp_path / "run2.csv").write_text("no numbers")
    runs = '[[run]]\nfile = "run2.csv"\n' * 2
    limit = {"max_runs": 2, "max_megabytes": 1e-5}[key]
    with pytest.raises(CampaignError, match=message):
        read(campaign(f"{key} = {limit}\n{CAMPAIGN}{runs}"))


def test_a_file_that_is_not_there_is_told_before_others_are_read(campaign, tmp_path):
    (tmp_path / "run2.csv").write_text("no numbers")
    with pytest.raises(CampaignError, match=r"none.csv: cannot be read"):
        read(campaign(CAMPAIGN + '[[run]]\nfile = "run2.csv"\n[[run]]\nfile = "none.csv"\n'))


@pytest.mark.parametrize(
    ("change", "run", "message"),
    [
        (('unit = "mm"', 'unit = "mmm"'), None, "unknown unit 'mmm'; did you mean 'mm'"),
        (('column = "x"', 'column = "y"'), None, "no column 'y'"),
        (("", ""), table(time=np.r_[np.arange(49) * 0.1, 1.0]), "line 51: time does not increase"),
        (("", ""), table(1), "1 samples; at least 20"),
        (("", ""), table(x=np.ones(50), P=np.ones(50)), "every channel is constant"),
        (("", ""), "\n\n".join(table(time=np.r_[np.arange(49) * 0.1, 1.0]).split("\n")), "line 101: time does not"),
        (("", ""), table().replace("x,P", "x,P,Q"), "line 2: 3 cells where the head has 4"),
        (("", ""), table().replace("0.5,5.0", "0.5,five"), "'five' is not a number"),
        (("", ""), table().replace("time", "zeit"), "first column is 'zeit'"),
        (("", ""), "", "is empty"),
        (('system = "s.ssp"', 'system = "t.ssp"'), None, "no such file"),
        (('name = "pool"', 'nmae = "pool"'), None, "unknown key 'nmae'; did you mean 'name'"),
        (('name = "pool"', 'seed = 3\ntruth.a = 1.0'), None, "template; cosim-gap simulate makes a campaign of it"),
        (("noise_std = 0.05", "noise_std = -1"), None, "positive"),
        (('file = "run1.csv"', 'file = "none.csv"'), None, "cannot be read"),
        (("tolerance = 0.02", "tolerance = 2"), None, "between 0 and 1"),
        (("name", "name ="), None, "not valid TOML"),
        (("", ""), table().replace("time,x,P", "time,x,x"), "has two columns 'x'"),
        (('file = "run1.csv"', 'file = "run1.csv"\nstop_time = 3.0'), None, "'stop_time' is for runs without a file"),
        (('[[base]]', '[[base]]\nparameter = "hydraulics.oil.nu0"\ntolerance = 0.1\n[[base]]'), None, "there twice"),
    ],
)
def test_one_line_for_what_is_wrong(campaign, change, run, message):
    with pytest.raises(CosimError, match=message) as error:
        read(campaign(CAMPAIGN.replace(*change, 1) if change[0] else CAMPAIGN, run))
    assert "\n" not in str(error.value)


TEMPLATE = """
name = "example"
system = "deepsea_11km.ssp"
seed = 5
[[channel]]
column = "x"
connector = "arm.x_h"
unit = "mm"
noise_std = 0.05
[[channel]]
column = "P1"
connector = "hydraulics.P1"
unit = "MPa"
noise_std = 0.02
[[run]]
file = "deep.csv"
stop_time = 4.0
parameters = { "arm.load_weight" = 900.0 }
[[run]]
file = "half.csv"
stop_time = 3.0
rate = 50
parameters = { "depth" = 5000.0 }
use = "holdout"
[truth]
"hydraulics.effect.cylinder_coulomb_friction.F_c" = 500.0
"sensor.arm.x_h.bias" = 0.001
"""


def test_synthetic_campaign_reads_back(built, tmp_path, capsys):
    template = tmp_path / "template.toml"
    template.write_text(TEMPLATE.replace("deepsea_11km.ssp", str(built / "deepsea_11km.ssp")))
    assert main(["simulate", str(template), "--out", str(tmp_path / "out")]) == 0
    c = read(tmp_path / "out" / "campaign.toml")
    assert [run.name for run in c.runs] == ["deep", "half"]
    assert [run.use for run in c.runs] == [None, "holdout"]
    t, x = c.runs[0].series["arm.x_h"]
    assert len(t) == 401
    assert x[:100].mean() == pytest.approx(1e-3, abs=2e-5)  # at rest: the bias
    assert x[:100].std() == pytest.approx(5e-5, rel=0.3)
    text = (tmp_path / "out" / "campaign.toml").read_text()
    assert "effect" not in text
    assert "bias" not in text
    answer = tomllib.loads((tmp_path / "out" / "answer.toml").read_text())
    assert answer["truth"]["hydraulics.effect.cylinder_coulomb_friction.F_c"] == 500.0


def test_a_synthetic_campaign_replaces_no_measurements(built, tmp_path):
    text = CAMPAIGN.replace("s.ssp", str(built / "deepsea_11km.ssp"))
    template = tmp_path / "campaign.toml"
    template.write_text(text)
    with pytest.raises(CampaignError, match=r"campaign.toml: is there already and would be replaced"):
        make(template, tmp_path)
    (tmp_path / "real").mkdir()
    (tmp_path / "real" / "run1.csv").write_text("time,x\n0,1\n")
    with pytest.raises(CampaignError, match=r"run1.csv: is there already"):
        make(template, tmp_path / "real")
    assert (tmp_path / "real" / "run1.csv").read_text() == "time,x\n0,1\n"
    driving = '[[channel]]\ncolumn = "r"\nconnector = "hydraulics.x_ref"\nunit = "m"\nrole = "input"\n'
    template.write_text(text + driving)
    with pytest.raises(CampaignError, match=r"'r': a template has no channels that drive"):
        make(template, tmp_path / "new")


def test_synthetic_readings_are_in_the_channels_unit_whatever_the_fmus_is(built, tmp_path):
    """The valve's current is in mA in the FMU: at most its rated 10 mA."""
    text = TEMPLATE.replace("deepsea_11km.ssp", str(built / "deepsea_11km.ssp"))
    text = text.replace("hydraulics.P1", "hydraulics.u").replace('"MPa"', '"mA"')
    (tmp_path / "template.toml").write_text(text)
    assert main(["simulate", str(tmp_path / "template.toml"), "--out", str(tmp_path / "out")]) == 0
    u = np.genfromtxt(tmp_path / "out" / "deep.csv", delimiter=",", names=True)["P1"]
    assert 9.0 < np.abs(u).max() < 10.5


EVENT = """
[[run.event]]
connector = "arm.x_h"
target = 0.2
within = 0.001
after = 1.0
std = 0.02
"""
MOMENTS = 'name = "moments"\nsystem = "s.ssp"\n[[run]]\nname = "one"\nstop_time = 10\n'
EVENTS = f"{MOMENTS}{EVENT}at_least = 3.0\n{EVENT}at_most = 5.0\n"


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("at_most = 5.0", "at_most = 1.0", "two events contradict each other"),
        ("at_most = 5.0", "time = 5.0\nuntil = 4.0", "is later than 'until'"),
        ("after = 1.0", "after = 20.0", "but the run ends at 10 s"),
        ("at_most = 5.0", "at_most = 5.0", None),
    ],
)
def test_events_that_cannot_be(tmp_path, old, new, message):
    (tmp_path / "s.ssp").write_bytes(b"")
    (tmp_path / "c.toml").write_text(EVENTS.replace(old, new))
    if message is None:
        assert len(read(tmp_path / "c.toml").runs[0].events) == 2
        return
    with pytest.raises(CampaignError, match=message):
        read(tmp_path / "c.toml")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("half.csv", "deep.csv", "written for something else already"),
        ("half.csv", "campaign.toml", "written for something else already"),
        ("half.csv", "../half.csv", "without folders"),
        ("seed = 5", "seed = -7", "has to be 0 or more"),
        ("seed = 5", "effects = 5", "wrong type"),
        ("rate = 50", "rate = 1e12", "samples are more than"),
        ("rate = 50", "rate = 2", "a diagnosis needs 20"),
        ("= 0.001", '= "x"', "has to be a number"),
        ("F_c\" = 500.0", "F_c\" = nan", "is not finite"),
        ("F_c\" = 500.0", "F_x\" = 5.0", "F_x"),
        ('unit = "mm"', 'unit = "bar"', "it is in bar, but 'arm.x_h' is in m"),
        ('use = "holdout"', 'use = "test"', "is neither fit nor holdout"),
        ("seed = 5", 'seed = 5\nbase = [{ parameter = "k", tolerance = 7 }]', "has to lie between 0 and 1"),
    ],
)
def test_a_bad_template_is_one_line(built, tmp_path, capsys, old, new, message):
    template = tmp_path / "template.toml"
    assert old in TEMPLATE
    text = TEMPLATE.replace("deepsea_11km.ssp", str(built / "deepsea_11km.ssp")).replace(old, new)
    template.write_text(text.replace("stop_time = 4.0", "stop_time = 0.5"))
    assert main(["simulate", str(template), "--out", str(tmp_path / "out")]) == 2
    told = capsys.readouterr().err
    assert message in told
    assert told.count("\n") == 1
    assert not (tmp_path / "out").exists()  # all is looked at before anything is simulated


def test_command_line(built, tmp_path, capsys):
    assert main(["effects", str(built / "deepsea_11km.ssp")]) == 0
    shown = capsys.readouterr().out
    assert "orifice_flow_number" in shown
    assert "hydraulics.valve.lam_crit" in shown
    for arguments in (["effects", str(tmp_path / "no.ssp")], ["simulate", "no.toml", "--out", str(tmp_path / "o")]):
        assert main(arguments) == 2
        assert capsys.readouterr().err.count("\n") == 1
