"""The whole diagnosis on a toy: measurements from scipy, the model an FMU of plain pythonfmu with its own catalogue."""

import json
import re
import signal
import sys
from contextlib import redirect_stdout
from io import StringIO

import numpy as np
import pytest
from deepsea_cosim.core import ending
from deepsea_cosim.core.errors import SimulationError
from deepsea_cosim.gap.campaign.read import read
from deepsea_cosim.gap.cli import main
from deepsea_cosim.gap.diagnose import diagnose, import_ahead
from deepsea_cosim.gap.problem.stop import StopToken
from deepsea_cosim.gap.result.document import document
from deepsea_cosim.gap.result.parameter_set import parameter_set
from deepsea_cosim.gap.terminal import _StopCondition
from deepsea_cosim.master.simulation.session import Session

from .. import packages
from ..packages import component, connector, link, system
from .oscillator import campaign, measure


@pytest.fixture(scope="module")
def rubbing(toys, tmp_path_factory):
    """Two runs of a machine with Coulomb friction of 0.4 N, diagnosed by the command."""
    folder = tmp_path_factory.mktemp("rubbing")
    runs = [measure(seed, lambda t, x, v: -0.4 * np.tanh(v / 0.01)) for seed in (1, 2)]
    path = campaign(folder, toys, runs)
    with redirect_stdout(StringIO()) as told:
        assert main(["diagnose", str(path), "--out", str(folder / "out"), "--json"]) == 0
    content = json.loads(told.getvalue())
    assert content["diagnosis"] == json.loads((folder / "out" / "diagnosis.json").read_text())
    assert content["files"] == ["diagnosis.json", "calibrated.ssv", "report.html"]
    return folder / "out"


def of_kind(data, kind):
    """The parts of a budget of that kind."""
    return [p for p in data["budget"]["parts"] if p["kind"] == kind]


def named(data):
    """Effects that are probable."""
    return [id for id, e in data["effects"].items() if e["inclusion_probability"] >= 0.5]


def sums(parts):
    return sum(p["share"] for p in parts)


def test_finds_the_effect_and_its_size(rubbing):
    data = json.loads((rubbing / "diagnosis.json").read_text())
    assert data["verdict"] == "explained"
    assert named(data) == ["friction"]
    assert data["effects"]["friction"]["inclusion_probability"] > 0.8
    others = [e["inclusion_probability"] for id, e in data["effects"].items() if id != "friction"]
    assert max(others) < 0.3
    hypotheses = data["hypotheses"]
    assert hypotheses[0]["effects"] == ["friction"]
    without = [h["probability"] for h in hypotheses if "friction" not in h["effects"]]
    assert hypotheses[0]["probability"] > 20.0 * max(without)
    part = of_kind(data, "effect")[0]
    assert (part["group"], part["effects"]) == ("force", ["friction"])
    assert part["share"] > 0.95
    assert part["ci95"][0] <= part["share"] <= part["ci95"][1]
    friction = part["parameters"]["o.F_c"]
    assert friction["value"] == pytest.approx(0.4, rel=0.05)
    assert friction["ci95"][0] < friction["value"] < friction["ci95"][1]
    assert friction["unit"] == "1"
    assert not friction["at_bound"]


def test_the_report_has_the_signals_of_the_runs(rubbing):
    text = (rubbing / "report.html").read_text(encoding="utf-8")
    embedded = json.loads(re.search(r'id="signals-data">(.*?)</script>', text)[1])
    known = json.loads((rubbing / "diagnosis.json").read_text())["budget"]["per_run"]
    assert [run["name"] for run in embedded["runs"]] == list(known)
    for run in embedded["runs"]:
        (trace,) = run["traces"]
        assert (trace["connector"], trace["unit"]) == ("o.x", "mm")
        expected = [known[run["name"]][k] for k in ("delivered", "calibrated", "explained")]
        assert [float(x) for x in trace["off"]] == pytest.approx(expected, rel=0.05)  # fitted there, held out here


def test_says_how_far_the_gap_shrinks(rubbing):
    data = json.loads((rubbing / "diagnosis.json").read_text())
    gap, reduction = data["budget"], data["reduction"]
    assert gap["delivered"] > gap["calibrated"] > gap["explained"]
    assert gap["noise"] == 1.0 <= gap["explained"] < 1.15
    assert reduction["value"] > 0.8
    assert reduction["ci95"][0] < reduction["value"] < reduction["ci95"][1]
    for run in gap["per_run"].values():  # each run by the other alone: not far above what it is with both
        assert run["explained"] - 0.05 < run["foretold_by_others"] < 1.3
    x = gap["per_channel"]["o.x"]
    assert x["unit"] == "m"
    assert 2e-4 <= x["noise"] < 5e-4  # with 3 % of a sample interval of timing in it
    assert x["explained"] == pytest.approx(2e-4, rel=0.15)


def test_the_parts_add_up_everywhere(rubbing):
    gap = json.loads((rubbing / "diagnosis.json").read_text())["budget"]
    assert sums(gap["parts"]) == pytest.approx(1.0)
    for parts in (*gap["per_channel"].values(), *gap["per_run"].values()):
        assert sums(parts["parts"]) == pytest.approx(1.0)
    for part in gap["parts"]:
        assert 0.0 <= part["ci95"][0] <= part["share"] <= part["ci95"][1] <= 1.0
        if part["kind"] == "effect":
            assert sum(part["within_group"].values()) == pytest.approx(1.0)


def test_keeps_the_contract(rubbing):
    data = json.loads((rubbing / "diagnosis.json").read_text())
    assert data["schema"] == 2
    assert data["finished"]
    listed = data["evidence"]["hypotheses"]
    assert sum(h["probability"] for h in listed) == pytest.approx(1.0)
    assert [] in [h["effects"] for h in listed], "the refit of the base parameters alone"
    assert set(data["effects"]) == {"friction", "cubic_spring", "force_gain", "sensor_delay"}
    assert sum(w["share"] for w in data["where"]) == pytest.approx(1.0)
    assert data["numerics"]["step_error"] < 0.5
    assert {o["as"] for o in data["observations"]} == {"samples"}
    assert data["next_experiment"]["change"]
    assert data["timing"]["simulations"] > 10
    assert data["settings"]["posterior"]["named"] == 0.5


def test_the_headline_names_the_effect_its_share_and_a_unit(rubbing):
    headline = json.loads((rubbing / "diagnosis.json").read_text())["headline"]
    assert "friction" in headline
    assert "mm" in headline
    assert re.search(r"\d+ %", headline)
    assert "spring" not in headline


def test_calibrated_parameters_run_in_the_model(rubbing):
    text = (rubbing / "calibrated.ssv").read_text()
    assert 'name="o.F_c"' in text
    from lxml import etree

    tree = etree.fromstring(text.encode())
    values = {p.get("name"): float(p[0].get("value")) for p in tree.iter("{*}Parameter")}
    with Session(rubbing.parent / "toy.ssp") as session:
        assert session.values(values)["o.F_c"] == values["o.F_c"]
        assert values["o.k"] == pytest.approx(78.0, rel=0.02)


def test_no_gap_beyond_a_refit(toys, tmp_path):
    path = campaign(tmp_path, toys, [measure(3, lambda t, x, v: 0.0), measure(4, lambda t, x, v: 0.0)])
    data = document(diagnose(read(path), processes=1))
    assert data["verdict"] == "no_significant_gap"
    assert named(data) == []
    base = data["calibration"]["moved"]
    assert base["o.k"]["value"] == pytest.approx(78.0, rel=0.01)
    assert base["o.m"]["value"] == pytest.approx(2.05, rel=0.01)
    assert data["budget"]["calibrated"] < 1.1 < data["budget"]["delivered"]


def test_an_effect_that_the_catalogue_lacks(toys, tmp_path):
    def knocks(t, x, v):
        return -2.0 if 0.01 < x < 0.02 else 0.0

    runs = [measure(seed, knocks) for seed in (5, 6)]
    data = document(diagnose(read(campaign(tmp_path, toys, runs)), processes=1))
    assert data["verdict"] == "unexplained"
    assert named(data) == []
    (rest,) = of_kind(data, "unexplained")
    assert rest["share"] == max(p["share"] for p in data["budget"]["parts"])
    varies = data["evidence"]["structure"]["varies_with"]["o.x"]
    assert varies in rest["character"]
    assert varies in ("o.x", "rate of o.x")
    assert rest["character"] in data["headline"]


def stopped(toys, folder, stage):
    """A machine with friction, its diagnosis asked to stop when that stage begins."""
    path = campaign(folder, toys, [measure(1, lambda t, x, v: -0.4 * np.tanh(v / 0.01))])
    said = []
    data = document(diagnose(read(path), on_stage=said.append, processes=1, stop=StopToken(lambda: stage in said)))
    assert not data["finished"]
    assert data["unfinished_stage"] == stage
    assert stage in data["headline"]
    assert data["cautions"]
    assert data["headline"].endswith(" ".join(data["cautions"]))
    assert stage in data["cautions"][0]
    assert not any(stage in text for text in data["warnings"])
    assert sums(data["budget"]["parts"]) == pytest.approx(1.0)
    return data


AFTER_EFFECTS = ["comparing sets of effects", "fitting the best to the end", "judging the hypotheses"]


@pytest.mark.parametrize("stage", AFTER_EFFECTS)
def test_what_has_been_found_is_judged_when_time_is_up(toys, tmp_path, stage):
    data = stopped(toys, tmp_path, stage)
    assert data["hypotheses"][0]["effects"] == ["friction"]
    assert next(iter(data["effects"])) == "friction"
    assert data["hypotheses"][0]["parameters"]["o.F_c"]["value"] == pytest.approx(0.4, rel=0.1)
    assert data["budget"]["parts"][0]["share"] > 0.9


BEFORE_EFFECTS = ["finite differences", "refitting the base parameters", "a first look at sets of effects"]


@pytest.mark.parametrize("stage", BEFORE_EFFECTS)
def test_nothing_is_named_that_was_not_looked_for(toys, tmp_path, stage):
    data = stopped(toys, tmp_path, stage)
    assert named(data) == []
    assert data["verdict"] == "unexplained"
    assert [h["effects"] for h in data["hypotheses"]] == [[]]
    assert data["budget"]["delivered"] > 2.0


def test_stopped_before_anything_was_simulated_there_is_nothing_to_say(toys, tmp_path):
    path = campaign(tmp_path, toys, [measure(1, lambda t, x, v: 0.0)])
    with pytest.raises(SimulationError, match="stopped before"):
        diagnose(read(path), processes=1, stop=StopToken(lambda: True))


def test_a_dask_cluster_finds_the_same(toys, tmp_path):
    distributed = pytest.importorskip("distributed")
    path = campaign(tmp_path, toys, [measure(1, lambda t, x, v: -0.4 * np.tanh(v / 0.01))])
    cluster = distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None, silence_logs=50
    )
    with cluster:
        line = ["diagnose", str(path), "--quiet", "--no-report", "--out"]
        assert main([*line, str(tmp_path / "there"), "--dask", cluster.scheduler_address]) == 0
    assert main([*line, str(tmp_path / "here")]) == 0
    there, here = (json.loads((tmp_path / name / "diagnosis.json").read_text()) for name in ("there", "here"))
    for key in ("verdict", "headline", "budget", "effects", "hypotheses"):
        assert there[key] == here[key]
    assert there["hypotheses"][0]["effects"] == ["friction"]


def test_the_first_interrupt_asks_for_a_result_and_the_second_ends(capsys, monkeypatch):
    with _StopCondition(None) as stop_condition:
        assert not stop_condition.ended()
        signal.raise_signal(signal.SIGINT)
        assert stop_condition.ended()
        assert "judging what has been found" in capsys.readouterr().err
        signal.raise_signal(signal.SIGINT)  # at once: the same request, by a terminal and by who passes it on
        monkeypatch.setattr(ending, "TWICE", -1.0)
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
    with _StopCondition(1e-9) as stop_condition:
        assert stop_condition.ended()


def test_held_out_runs_are_not_fitted(toys, tmp_path):
    runs = [measure(seed, lambda t, x, v: -300.0 * x**3) for seed in (7, 8)]
    path = campaign(tmp_path, toys, runs)
    text = path.read_text().replace('file = "run1.csv"', 'file = "run1.csv"\nuse = "holdout"')
    path.write_text(text)
    d = diagnose(read(path), processes=1)
    data = document(d)
    assert len(d.state.problem.runs) == 1
    assert data["budget"]["held_out"] == "runs that the campaign holds out"
    assert list(data["budget"]["per_run"]) == ["run1"]
    assert data["hypotheses"][0]["effects"] == named(data) == ["cubic_spring"]
    assert data["budget"]["explained"] < 1.3


BAD = {
    "metres for millimetres": (
        lambda text: text.replace('unit = "mm"', 'unit = "m"'), "is it in mm, or is the input 'u' in kN?"),
    "another quantity": (lambda text: text.replace('unit = "mm"', 'unit = "furlong"'), "unknown unit"),
    "an input that is an output": (lambda text: text.replace('"o.u"', '"o.v"'), "cannot be an input"),
    "an input without its role": (
        lambda text: text.replace('role = "input"', ""), "'o.u' is an input that nothing in the model drives"),
    "no such connector": (lambda text: text.replace('"o.x"', '"o.y"'), "no connector 'o.y'"),
    "no such column": (lambda text: text.replace('column = "x"', 'column = "z"'), "no column 'z'"),
    "all held out": (lambda text: text.replace(".csv\"", '.csv"\nuse = "holdout"'), "nothing to fit"),
    "a base that an effect changes": (
        lambda text: text + '[[base]]\nparameter = "o.gain"\ntolerance = 0.1\n', "what effect force_gain changes"),
    "centimetres for millimetres": (
        lambda text: text.replace('"mm"', '"cm"').replace("0.2", "0.02"), "is it in mm, or"),
    "a noise beyond all readings": (lambda text: text.replace("0.2", "5e4"), "in which unit is it?"),
    "a noise of nothing": (lambda text: text.replace("0.2", "1e-300"), "finer than any sensor"),
    "a name that is no name": (lambda text: text.replace('"toy"', "[5]"), "wrong type"),
    "the column of the time": (lambda text: text.replace('column = "x"', 'column = "time"'), "cannot be the column"),
    "newtons for kilonewtons": (lambda text: text.replace('"N"', '"kN"'), "is it in m, or is the input 'u' in N?"),
    "a number of 400 digits": (lambda text: text.replace("0.2", "9" * 400), "is not finite"),
    "no file": (lambda text: text.replace("run0.csv", "a\\u0000"), "is not the name of a file"),
    "a name of 300 letters": (lambda text: text.replace("run0.csv", "a" * 300), "name too long"),
    "a package's name of 300 letters": (lambda text: text.replace("toy.ssp", "a" * 300), "name too long"),
    "a moment in ms": (
        lambda text: text.replace('"run0.csv"', '"run0.csv"\n[[run.event]]\nconnector = "o.x"\ntarget = 0.01\n'
                                  'within = 0.001\nafter = 0.0\nstd = 0.1\ntime = 7625'), "is it in seconds?"),
    "no such base": (lambda text: text + '[[base]]\nparameter = "o.q"\ntolerance = 0.1\n', "no component has a param"),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_input_is_one_line(case, toys, tmp_path, capsys):
    change, expected = BAD[case]
    path = campaign(tmp_path, toys, [measure(1, lambda t, x, v: 0.0)])
    path.write_text(change(path.read_text()))
    assert main(["diagnose", str(path), "--out", str(tmp_path / "out"), "--quiet"]) == 2
    error = capsys.readouterr().err
    assert expected in error
    assert error.count("\n") == 1


def spoilt(row, column, value):
    def spoil(table):
        table[row, column] = value
        return table

    return spoil


BAD_RUNS = {
    "a mark for a missing value": (spoilt(slice(100, 103), 2, -9.999), "3 readings are -9999 mm, the first at 2 s"),
    "a mark in an input": (spoilt(slice(100, 400, 50), 1, -9999.0), "-9999 N at 2 s is impossible beside"),
    "time in ms": (lambda table: table * [1e3, 1.0, 1.0], "is time in seconds?"),
    "time in minutes": (lambda table: table / [60.0, 1.0, 1.0], "is time in minutes?"),
    "time of a driven run in minutes": (lambda table: table / [60.0, 1.0, 1.0], "movement; is time in minutes?"),
    "an input in kN": (lambda table: table * [1.0, 1e-3, 1.0], "is it in um, or is the input 'u' in kN?"),
    "an input in kN, and another channel": (lambda table: table * [1.0, 1e-3, 1.0], "is the input 'u' in kN?"),
    "time since last month": (lambda table: table + np.array([1e6, 0.0, 0.0]), "start = 1e+06"),
    "a number that is none": (spoilt(3, 2, 1e300), "is no quantity of a machine"),
}


@pytest.mark.parametrize("case", BAD_RUNS)
def test_bad_runs_are_one_line(case, toys, tmp_path, capsys):
    spoil, expected = BAD_RUNS[case]
    path = campaign(tmp_path, toys, [spoil(measure(1, lambda t, x, v: 0.0))])
    if "another channel" in case:
        table = np.loadtxt(tmp_path / "run0.csv", delimiter=",", skiprows=1)
        v = np.gradient(table[:, 2], table[:, 0])
        np.savetxt(tmp_path / "run0.csv", np.column_stack([table, v]), delimiter=",", header="time,u,x,v", comments="")
        path.write_text(path.read_text().replace("[[run]]", '[[channel]]\ncolumn = "v"\nconnector = "o.v"\n'
                                                 'unit = "mm/s"\n[[run]]'))  # fmt: skip
    if case == "time in minutes":  # with a measured input any length can be meant
        path.write_text(path.read_text().replace('role = "input"', 'role = "output"').replace('"o.u"', '"o.v"')
                        .replace('"N"', '"m/s"'))  # fmt: skip
    assert main(["diagnose", str(path), "--out", str(tmp_path / "out"), "--quiet"]) == 2
    error = capsys.readouterr().err
    assert expected in error
    assert error.count("\n") == 1


BAD_CATALOGUES = {
    "a verdict's name": ('id = "friction"', 'id = "none"', "the name of a verdict"),
    "an unknown key": ("prior = 0.3", "prioor = 0.3", "unknown key 'prioor'; did you mean 'prior'"),
    "an address twice": ('address = "o.k3"', 'address = "o.F_c"', "friction and effect cubic_spring both have 'o.F_c'"),
    "another quantity": ('address = "o.F_c"', 'address = "o.F_c"\nalso = ["o.m"]', "'also' is for what takes the same"),
    "another schema": ("[[base]]", "schema = 7\n[[base]]", "schema = 7 is not known"),
    "no such experiment": ('parameter = "o.m"\nvalues', 'parameter = "o.z"\nvalues', "experiment o.z: no component"),
    "a region of nothing": ('signal = "o.v"', 'signal = "o.w"', "region 'moving out': no connector 'o.w'"),
}


@pytest.mark.parametrize("case", BAD_CATALOGUES)
def test_a_bad_catalogue_is_told_before_anything_is_simulated(case, toys, tmp_path, capsys):
    old, new, expected = BAD_CATALOGUES[case]
    path = campaign(tmp_path, toys, [measure(1, lambda t, x, v: 0.0)])
    text = (tmp_path / "effects.toml").read_text()
    assert old in text
    (tmp_path / "effects.toml").write_text(text.replace(old, new, 1))
    assert main(["diagnose", str(path), "--out", str(tmp_path / "out"), "--quiet"]) == 2
    error = capsys.readouterr().err
    assert expected in error
    assert error.count("\n") == 1


def test_an_input_that_nothing_follows_is_refused(toys, tmp_path, capsys):
    path = campaign(tmp_path, toys, [measure(1, lambda t, x, v: 0.0)], more='parameters = { "o.gain" = 0.0 }\n')
    (tmp_path / "effects.toml").write_text((tmp_path / "effects.toml").read_text().replace("[0.5, 1.5]", "[0, 1.5]"))
    assert main(["diagnose", str(path), "--out", str(tmp_path / "out"), "--quiet"]) == 2
    assert "the input 'o.u' changes nothing in the model" in capsys.readouterr().err


def test_runs_of_one_name_are_told_by_their_folder(toys, tmp_path):
    path = campaign(tmp_path, toys, [measure(seed, lambda t, x, v: 0.0) for seed in (1, 2)])
    for k, day in enumerate(("monday", "tuesday")):
        (tmp_path / day).mkdir()
        (tmp_path / f"run{k}.csv").rename(tmp_path / day / "run.csv")
        path.write_text(path.read_text().replace(f"run{k}.csv", f"{day}/run.csv"))
    assert [run.name for run in read(path).runs] == ["monday/run", "tuesday/run"]


def test_connectors_of_the_whole_system_are_channels_too(toys, tmp_path):
    path = campaign(tmp_path, toys, [measure(1, lambda t, x, v: -0.4 * np.tanh(v / 0.01))])
    inside = component("o", "resources/Oscillator.fmu", connector("u", "input"), connector("x", "output"))
    root = system("root", inside, made=(connector("force", "input"), connector("place", "output")),
                  links=(link("force", "o.u"), link("o.x", "place")))  # fmt: skip
    fmus = {"resources/Oscillator.fmu": toys / "Oscillator.fmu"}
    packages.package(tmp_path / "toy.ssp", root, fmus, stop=12.0, step=1e-3)
    path.write_text(path.read_text().replace('"o.u"', '"force"').replace('"o.x"', '"place"'))
    data = document(diagnose(read(path), processes=1))
    assert data["hypotheses"][0]["effects"] == ["friction"]
    assert data["budget"]["explained"] < 1.3
    assert list(data["budget"]["per_channel"]) == ["place"]


def test_moments_are_measurements_too(toys, tmp_path):
    """The model settles to 25 mm after a step as the closed form says, so nothing is missing."""
    path = campaign(tmp_path, toys, [])
    text = path.read_text().split("[[channel]]")[0]
    for d in (2.0, 3.0, 4.0):
        text += f'[[run]]\nname = "d {d}"\nstop_time = 8\nparameters = {{ "o.d" = {d}, "o.u" = 2.0 }}\n'
        text += '[[run.event]]\nconnector = "o.x"\ntarget = 0.025\nwithin = 0.001\nafter = 0\nstd = 0.01\n'
        text += f"time = {_settles(d):.4f}\n"
    path.write_text(text)
    data = document(diagnose(read(path), processes=1))
    assert len(data["events"]) == 3
    for e in data["events"]:
        assert e["explained"] == pytest.approx(e["measured"], abs=0.05)
    assert data["verdict"] != "unexplained"
    assert [c["changed"] for c in data["contrasts"]] == ["o.d"] * 3
    first = data["contrasts"][0]
    assert first["runs"] == ["d 2.0", "d 3.0"]
    assert first["measured"] == pytest.approx(_settles(2.0) - _settles(3.0), abs=1e-3)
    assert first["std"] == pytest.approx(0.01 * np.sqrt(2.0))


def test_limits_that_are_kept_say_that_nothing_is_missing(toys, tmp_path):
    """Not one residual: no division by what is not there."""
    path = campaign(tmp_path, toys, [])
    text = path.read_text().split("[[channel]]")[0]
    text += '[[run]]\nname = "step"\nstop_time = 8\nparameters = { "o.u" = 2.0 }\n'
    text += '[[run.event]]\nconnector = "o.x"\ntarget = 0.025\nwithin = 0.001\nafter = 0\nstd = 0.01\nat_most = 7.9\n'
    path.write_text(text)
    assert document(diagnose(read(path), processes=1))["verdict"] == "no_significant_gap"


def test_the_calibrated_parameters_stand_there_once(toys, tmp_path):
    """The run states k by its bare name, and the refit of o.k is that of the same parameter."""
    path = campaign(tmp_path, toys, [measure(3, lambda t, x, v: 0.0)])
    path.write_text(path.read_text().replace('"run0.csv"', '"run0.csv"\nparameters = { k = 75.0 }'))
    d = diagnose(read(path), processes=1)
    assert "o.k" in d.state.reported.hypothesis.fit.point
    assert parameter_set(d).count('name="o.k"') == 1
    k = float(re.search(r'name="o.k"><ssv:Real value="([^"]+)"', parameter_set(d))[1])
    assert k == pytest.approx(78.0, rel=0.01)


def test_the_calibrated_parameters_are_those_of_the_machine_alone(toys, tmp_path):
    """Not the runs' conditions: they are to serve elsewhere; a refit of what differs from run to run cannot be said."""
    path = campaign(tmp_path, toys, [measure(3, lambda t, x, v: 0.0), measure(4, lambda t, x, v: 0.0)])
    text = path.read_text().replace('"run0.csv"', '"run0.csv"\nparameters = { "o.k" = 75.0, "o.m" = 2.0 }')
    path.write_text(text.replace('"run1.csv"', '"run1.csv"\nparameters = { "o.k" = 76.0, "o.m" = 2.0 }'))
    said = []
    stop = StopToken(lambda: "comparing sets of effects" in said)
    d = diagnose(read(path), on_stage=said.append, stop=stop, processes=1)
    assert "o.k" in d.state.reported.hypothesis.fit.point
    names = set(re.findall(r'Parameter name="([^"]+)"', parameter_set(d)))
    assert names <= set(d.state.reported.hypothesis.fit.point) - {"o.k"}
    assert sum("calibrated.ssv" in w for w in document(d)["warnings"]) == 1


def _settles(d, m=2.0, k=80.0, force=2.0):
    """When a step response (closed form) comes to stay within 1 mm of force / k."""
    t = np.linspace(0.0, 8.0, 80001)
    s = d / (2 * m)
    w = np.sqrt(k / m - s * s)
    x = force / k * (1 - np.exp(-s * t) * (np.cos(w * t) + s / w * np.sin(w * t)))
    return t[np.flatnonzero(np.abs(x - force / k) > 1e-3)[-1]]


def test_modules_are_imported_ahead_and_a_missing_one_is_left_to_who_needs_it(monkeypatch):
    monkeypatch.delitem(sys.modules, "json.tool", raising=False)
    import_ahead(("there_is_no_such_module", "json.tool")).join()
    assert "json.tool" in sys.modules
