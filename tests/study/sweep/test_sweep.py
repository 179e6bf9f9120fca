"""Sweeps of native FMUs with known answers: numbers, failures, crashes, kills, and tables that come out the same."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import time
import warnings
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from deepsea_cosim.core.errors import CosimError, OutputError, SimulationError, UnknownNameError, UsageError
from deepsea_cosim.master.parallel import pool
from deepsea_cosim.master.parallel.pool import Pool
from deepsea_cosim.master.simulation.session import Session
from deepsea_cosim.study.cli import main
from deepsea_cosim.study.sweep import plots, result
from deepsea_cosim.study.sweep.axes import Axis, parse_axis
from deepsea_cosim.study.sweep.cases import grid
from deepsea_cosim.study.sweep.metrics import parse_metric
from deepsea_cosim.study.sweep.run import Settings, Task, check, default_metrics, measure, sweep
from deepsea_cosim.study.sweep.store import CASES_FILE, Store

from benchmarks import native

from ...commands import code
from ...master.parts import linear
from ...packages import component, connector, link, package, system

GAIN = "b.D[1,1]"
END = Settings((parse_metric("end=final(b.y1)"), parse_metric("at(b.y1, 0.25)")))


def run(package, folder, *axes, settings=END, **options):
    cases = grid([parse_axis(a) for a in axes])
    return sweep(package, cases, settings, folder, processes=options.pop("processes", 1), **options)


def test_numbers_of_every_case(doubled, tmp_path):
    told = []
    found = run(doubled, tmp_path, f"{GAIN}=1,2,5", progress=lambda *n: told.append(n))
    assert [e["values"]["end"] for e in found] == pytest.approx([1.0, 2.0, 5.0])
    assert [e["values"]["at(b.y1, 0.25)"] for e in found] == pytest.approx([0.25, 0.5, 1.25])
    assert told == [(0, 0), (1, 0), (2, 0), (3, 0)]


def test_finished_cases_are_not_run_again_and_others_are_added(doubled, tmp_path):
    first = run(doubled, tmp_path, f"{GAIN}=1,2")
    told = []
    more = run(doubled, tmp_path, f"{GAIN}=2,1,3", progress=lambda *n: told.append(n))
    assert told == [(2, 0), (3, 0)]
    assert [more[1], more[0]] == first


def test_other_settings_are_other_cases(doubled, tmp_path):
    run(doubled, tmp_path, f"{GAIN}=1")
    told = []
    run(doubled, tmp_path, f"{GAIN}=1", settings=Settings(END.metrics, step=0.02), progress=lambda *n: told.append(n))
    assert told == [(0, 0), (1, 0)]


def test_a_failing_case_is_listed_and_the_others_are_there(doubled, tmp_path):
    found = run(doubled, tmp_path, "b.trouble=0,1,2")
    assert found[0]["values"]["end"] == pytest.approx(2.0)
    assert "doStep at t = 0.5" in found[1]["failed"]
    assert "failed" in found[2]
    told = []
    run(doubled, tmp_path, "b.trouble=0,1,2", progress=lambda *n: told.append(n))
    assert told == [(3, 2)]
    run(doubled, tmp_path, "b.trouble=0,1,2", progress=lambda *n: told.append(n), again=True)
    assert told[1:] == [(1, 0), (2, 1), (3, 2)]


def test_a_crash_takes_its_own_case_only(doubled, tmp_path):
    found = run(doubled, tmp_path, "b.trouble=0,3", f"{GAIN}=1,2,3,4")
    assert [e["values"]["end"] for e in found[:4]] == pytest.approx([1.0, 2.0, 3.0, 4.0])
    assert all("crashed" in e["failed"] for e in found[4:])


@pytest.mark.skipif(sys.platform == "win32", reason="there are no interval timers")
def test_a_case_that_hangs_takes_its_own_time_only(doubled, tmp_path):
    """An FMU that never comes back from its step; the process ends, the others' cases go on."""
    begin = time.perf_counter()
    found = run(doubled, tmp_path, "b.trouble=4,0", f"{GAIN}=1,2", limit=3.0)
    assert [e["failed"] for e in found[:2]] == ["it takes longer than 3 s"] * 2
    assert [e["values"]["end"] for e in found[2:]] == pytest.approx([1.0, 2.0])
    assert time.perf_counter() - begin < 60.0


@pytest.fixture
def opened(doubled):
    with Session(doubled) as session:
        yield session


def test_bad_names_are_refused_before_anything_runs(opened):
    with pytest.raises(UnknownNameError, match="did you mean"):
        check(opened, {"b.trouple": 1}, END)
    with pytest.raises(UnknownNameError, match="no connector"):
        check(opened, {GAIN: 1.0}, Settings((parse_metric("final(b.y9)"),)))


def test_names_that_set_the_same_are_refused(opened):
    check(opened, {GAIN: 1.0, "a.trouble": 0.0}, END)
    with pytest.raises(UsageError, match=r"'trouble' and 'b\.trouble' both set 'b\.trouble'"):
        check(opened, {"trouble": 1.0, "b.trouble": 0.0}, END)


def test_a_sweep_ends_when_the_master_ends(doubled, tmp_path):
    """The last step is shorter where the step does not divide the time; y = t is exact at every communication point."""
    until = Settings((parse_metric("final(a.y1)"), parse_metric("at(a.y1, 0.25)")), step=0.03, stop=0.25)
    [entry] = run(doubled, tmp_path, f"{GAIN}=1", settings=until)
    assert list(entry["values"].values()) == pytest.approx([0.25, 0.25], rel=1e-12)
    for step, stop in ((0.0, 1.0), (-1.0, 1.0), (2.0, 1.0), (0.1, 0.0), (0.1, float("inf"))):
        with pytest.raises(UsageError), Session(doubled) as session:
            check(session, {}, Settings(END.metrics, step=step, stop=stop))


@pytest.fixture(scope="module")
def swinging(tmp_path_factory):
    """A mass on a spring of 10 rad/s."""
    if native.compiler is None:
        pytest.skip("there is no C compiler here")
    folder = tmp_path_factory.mktemp("swinging")
    fmus = {"resources/mass.fmu": native.linear(folder, 2, "mass", through=False, units={"u1": "N", "y1": "m/s"}),
            "resources/spring.fmu": native.linear(folder, 2, "spring", through=False,
                                                  units={"u1": "m/s", "y1": "N"})}  # fmt: skip
    parts = (linear("spring", "resources/spring.fmu", A=[[0]], B=[[-100.0]], C=[[1]], x0=[-100.0]),
             linear("mass", "resources/mass.fmu", A=[[0]], B=[[1]], C=[[1]], x0=[0]))  # fmt: skip
    root = system("root", *parts, links=(link("spring.y1", "mass.u1"), link("mass.y1", "spring.u1")))
    return package(folder / "s.ssp", root, fmus, stop=2.0, step=1e-3)


def test_runs_that_are_not_to_be_trusted_are_told(swinging, tmp_path, capsys):
    line = ["sweep", str(swinging), "--vary", "mass.x0[1]=0,1", "--metric", "top=max(mass.y1)", "--metric",
            "integral(mass.y1)", "--out", str(tmp_path), "--method", "jacobi"]  # fmt: skip
    assert main(line) == 0
    assert "2 cases, 0 failed, 0 with warnings" in capsys.readouterr().out
    assert json.loads((tmp_path / "summary.json").read_text())["units"] == {"top": "m/s", "integral(mass.y1)": "m/s.s"}
    assert sorted(p.name for p in tmp_path.glob("*.png")) == ["integral_mass.y1.png", "top.png"]
    assert main([*line[:4], "--metric", "min(mass.y1)", *line[8:], "--step", "0.15"]) == 0
    assert "2 cases, 0 failed, 2 with warnings" in capsys.readouterr().out
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert summary["step_s"] == 0.15
    assert all("too long to follow" in entry["what"] for entry in summary["warnings"])
    assert [p.name for p in tmp_path.glob("*.png")] == ["min_mass.y1.png"]  # those of other metrics are gone


def test_without_metrics_the_connected_outputs_are_measured(opened):
    assert [m.label for m in default_metrics(opened)] == ["final(a.y1)", "min(a.y1)", "max(a.y1)"]


def test_without_metrics_what_the_system_gives_is_measured_and_texts_are_not(tmp_path):
    native.compiler or pytest.skip("there is no C compiler here")
    one = component("a", "resources/L.fmu", connector("y1", "output"), connector("string_out", "output", "String"))
    made = (connector("out", "output"), connector("said", "output", "String"))
    root = system("root", one, made=made, links=(link("a.y1", "out"), link("a.string_out", "said")))
    path = package(tmp_path / "p.ssp", root, {"resources/L.fmu": native.linear(tmp_path, 2)}, stop=1.0, step=0.1)
    with Session(path) as session:
        assert [m.label for m in default_metrics(session)] == ["final(a.y1)", "min(a.y1)", "max(a.y1)"]


def test_one_sweep_at_a_time_writes_to_a_folder(tmp_path):
    with Store(tmp_path), pytest.raises(OutputError, match="another sweep"), Store(tmp_path):
        pass


@pytest.mark.parametrize("rest", [b'{"case": "x", "val', b"\x00\xff", b'["no mapping"]\n'])
def test_a_line_that_was_cut_is_dropped_and_written_over(tmp_path, rest):
    with Store(tmp_path) as store:
        store.put("a", {"values": {"m": 0.1}})
    whole = (tmp_path / CASES_FILE).read_bytes()
    (tmp_path / CASES_FILE).write_bytes(whole + rest)
    with Store(tmp_path) as store:
        assert store.get("a") == {"values": {"m": 0.1}}
        store.put("b", {"failed": "x"})
    assert (tmp_path / CASES_FILE).read_bytes() == whole + b'{"case": "b", "failed": "x"}\n'


@pytest.mark.parametrize("strange", [
    '{"case": "x"}', '{"case": "x", "values": 3}', "[]", "none", '{"case": 5}', '{"case": "x", "values": {"m": [1]}}',
    '{"case": "x", "values": {"m": 1e400}}', '{"case": "x", "values": {"m": 1}, "warnings": [1]}',
])  # fmt: skip
def test_a_strange_line_is_passed_over(tmp_path, strange):
    good = [json.dumps({"case": name, "values": {"m": 0.1}}) for name in "ab"]
    (tmp_path / CASES_FILE).write_text("\n".join([good[0], strange, good[1], ""]))
    with Store(tmp_path) as store:
        assert store.get("a") == store.get("b") == {"values": {"m": 0.1}}
        assert store.get("x") is None


def command(package, folder, *more):
    return ["sweep", str(package), "--vary", f"{GAIN}=1:30:1", "--vary", "b.trouble=0,1", "--metric", "final(b.y1)",
            "--step", "2e-4", "--out", str(folder), "--processes", "2", "--no-plots", *more]  # fmt: skip


def test_a_killed_sweep_goes_on_and_its_table_is_the_same_bitwise(doubled, tmp_path):
    pytest.importorskip("pyarrow")
    killed, whole = tmp_path / "killed", tmp_path / "whole"
    line = [sys.executable, "-m", "deepsea_cosim.study.cli", *command(doubled, killed)]
    process = subprocess.Popen(line, stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL, start_new_session=True)
    deadline = time.monotonic() + 60
    while time.monotonic() < deadline and process.poll() is None:
        if (killed / CASES_FILE).exists() and (killed / CASES_FILE).read_bytes().count(b"\n") >= 5:
            break
        time.sleep(0.01)
    os.killpg(process.pid, signal.SIGKILL)
    process.wait()
    done = (killed / CASES_FILE).read_bytes().count(b"\n")
    assert 5 <= done < 60
    assert not (killed / "sweep.parquet").exists()
    assert main([*command(doubled, killed), "--quiet"]) == 0
    assert main([*command(doubled, whole), "--quiet"]) == 0
    assert (killed / "sweep.parquet").read_bytes() == (whole / "sweep.parquet").read_bytes()


def test_the_command_tells_what_came_out(doubled, tmp_path, capsys):
    varied = ["--vary", f"{GAIN}=1,2,3", "--vary", "b.trouble=0,1"]
    assert main(["sweep", str(doubled), *varied, "--out", str(tmp_path)]) == 0
    told = capsys.readouterr().out
    assert "6 cases, 3 failed" in told
    assert "final(a.y1)" in told
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert len(summary["failed"]) == 3
    assert (tmp_path / "final_a.y1.png").stat().st_size > 5000


@pytest.mark.parametrize(
    "arguments",
    [["--vary", "b.D[1,1]=1:2"], [], ["--vary", "q=1"], ["--vary", "b.u1=1", "--metric", "final(z)"],
     ["--vary", "b.D[1,1]=1", "--set", "b.D[1,1]=2"], ["--vary", "b.D[1,1]=1", "--metric", "case=final(b.y1)"],
     ["--vary", "b.D[1,1]=1", "--processes", "0"], ["--vary", "b.D[1,1]=1", "--method", "magic"],
     ["--vary", "b.D[1,1]=x"], ["--vary", "b.D[1,1]=1", "--set", "b.trouble"],
     ["--vary", "b.D[1,1]=1", "--dask", "tcp://127.0.0.1:1"], ["--vary", "b.D[1,1]=1,1.0"],
     ["--vary", "b.D[1,1]=1,2,x"], ["--vary", "b.D[1,1]=1:2", "--sample", "sobol:\u00b2"],
     ["--vary", "b.D[1,1]=1:2", "--sample", f"sobol:{10**12}"],
     ["--vary", "b.D[1,1]=nan"], ["--vary", "b.D[1,1]=x:1"], ["--vary", "b.D[1,1]=true"],
     ["--vary", "a.integer_in=1.5"],
     ["--vary", "b.D[1,1]=1:2", "--sample", "lhs:3", "--seed", "-1"], ["--vary", "b.D[1,1]=1", "--case-time", "0"],
     ["--vary", "b.D[1,1]=1", "--case-time", "9", "--dask", "tcp://127.0.0.1:1"]],
)  # fmt: skip
def test_bad_arguments_are_one_line(doubled, tmp_path, capsys, arguments, monkeypatch):
    monkeypatch.setattr(pool, "CONNECT_TIMEOUT", "1s")
    assert code(main, ["sweep", str(doubled), *arguments, "--out", str(tmp_path / "out")]) == 2
    told = capsys.readouterr().err.strip().splitlines()
    assert len(told) == 1
    assert told[0].startswith(("cosim-study: ", "cosim-study sweep: "))


@pytest.mark.parametrize(("number", "told"), [(2, "none of the 2 cases has b.D[1,1] = "), (4, "")])
def test_values_of_a_list_that_a_sample_leaves_out_are_told(doubled, tmp_path, capsys, number, told):
    """Four values need four of a Sobol sequence, which are one in each quarter."""
    arguments = [f"--vary={GAIN}=1,2,3,4", "--sample", f"sobol:{number}", "--no-plots", "--out", str(tmp_path / "o")]
    assert code(main, ["sweep", str(doubled), *arguments]) == 0
    assert told in (said := capsys.readouterr().err)
    assert ("none of" in said) == bool(told)


def test_texts_are_as_they_are_written_and_numbers_as_the_parameter_is(doubled, tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet")
    varied = ["--vary", "a.string_in=007,1e3,C:/x.csv", "--set", "b.string_in=a,b:c", "--metric", "end=final(b.y1)"]
    alike = ["sweep", str(doubled), "--quiet", "--no-plots", "--processes", "1"]
    assert main([*alike, *varied, "--out", str(tmp_path / "texts")]) == 0
    table = parquet.read_table(tmp_path / "texts" / "sweep.parquet")
    assert table["a.string_in"].to_pylist() == ["007", "1e3", "C:/x.csv"]
    line = [*alike, "--metric", "end=final(b.y1)", "--out", str(tmp_path / "numbers")]
    assert main([*line, "--vary", f"{GAIN}=1,2"]) == 0
    assert main([*line, "--vary", f"{GAIN}=1:3:1", "--step", "0.01"]) == 0  # the package's step: the same cases
    assert (tmp_path / "numbers" / CASES_FILE).read_bytes().count(b"\n") == 3


def test_items_of_an_enumeration_keep_their_names(doubled, tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet")
    line = ["sweep", str(doubled), "--vary", "a.item_in=blue,red", "--metric", "item=final(a.item_out)", "--quiet"]
    assert main([*line, "--out", str(tmp_path), "--no-plots", "--processes", "1"]) == 0
    table = parquet.read_table(tmp_path / "sweep.parquet")
    assert (table["a.item_in"].to_pylist(), table["item"].to_pylist()) == (["blue", "red"], [3.0, 1.0])


def test_a_sweep_of_which_every_case_failed_has_not_succeeded(doubled, tmp_path, capsys):
    line = ["sweep", str(doubled), "--metric", "final(b.y1)", "--out", str(tmp_path), "--quiet", "--no-plots"]
    assert main([*line, "--vary", "b.trouble=1"]) == 1
    assert "every case failed, the first: component 'b'" in capsys.readouterr().err
    assert json.loads((tmp_path / "summary.json").read_text())["failed"]
    assert main([*line, "--vary", "b.trouble=0,1", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["summary"] == json.loads((tmp_path / "summary.json").read_text())
    assert [row["b.trouble"] for row in told["table"]] == [0, 1]
    assert [bool(row["failed"]) for row in told["table"]] == [False, True]


def test_a_folder_that_is_a_file_is_one_line(doubled, tmp_path, capsys):
    (tmp_path / "file").write_text("mine")
    line = ["sweep", str(doubled), "--metric", "final(b.y1)", "--vary", f"{GAIN}=1", "--out", str(tmp_path / "file")]
    assert main(line) == 2
    assert "cannot be written" in capsys.readouterr().err
    assert (tmp_path / "file").read_text() == "mine"


def test_what_no_case_can_help_ends_the_sweep(doubled, tmp_path):
    """A package that a worker does not see: nothing is kept as failed."""
    gone = tmp_path / "gone.ssp"
    shutil.copy(doubled, gone)
    with Pool(gone, processes=1) as pool:
        gone.unlink()
        with pytest.raises(CosimError, match="no such file"):
            list(pool.each_surviving(measure, [Task(END, {GAIN: 1.0})]))


def test_a_longer_time_tries_again_what_took_too_long(doubled, tmp_path):
    """And a crash is told as a crash, however long the process took to start."""
    line = ["sweep", str(doubled), "--vary", "b.trouble=0,3,4", "--metric", "end=final(b.y1)", "--quiet", "--no-plots",
            "--processes", "1", "--out", str(tmp_path)]  # fmt: skip
    for limit in ("2.5", "3.5"):
        assert main([*line, "--case-time", limit]) == 0
        why = [entry["why"] for entry in json.loads((tmp_path / "summary.json").read_text())["failed"]]
        assert why[0] == "component 'b' crashed (SIGSEGV) in doStep at t = 0.5 s"
        assert why[1] == f"it takes longer than {limit} s"


def test_values_out_of_order_are_drawn_in_order(tmp_path):
    axes = [Axis("p", (3.0, 1.0, 2.0)), Axis("q", tuple(float(k) for k in (9, 1, 8, 2, 7, 3, 6, 4, 5)))]
    table = [{"p": p, "q": q, "$z^": p + q} for p in axes[0].values for q in axes[1].values]
    sorted_axes, rows = plots._sorted(axes, table)
    assert sorted_axes[1].values == tuple(float(k) for k in range(1, 10))
    assert [row["$z^"] for row in rows] == [p + q for p in (1, 2, 3) for q in range(1, 10)]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        plots.picture(tmp_path / "map.png", axes, False, table, "$z^")  # and a label is no formula
    assert (tmp_path / "map.png").stat().st_size > 5000


def test_what_cannot_be_drawn_is_told_and_the_rest_is_there(doubled, tmp_path, monkeypatch, capsys):
    def broken(*_):
        raise ValueError("no such colour")

    monkeypatch.setattr(plots, "picture", broken)
    line = ["sweep", str(doubled), "--vary", f"{GAIN}=1,2", "--metric", "end=final(b.y1)", "--out", str(tmp_path)]
    assert main(line) == 0
    assert "no picture of end: no such colour" in capsys.readouterr().out
    assert json.loads((tmp_path / "summary.json").read_text())["cases"] == 2


def test_help_is_quick_and_heavy_things_stay_out():
    code = "import sys; from deepsea_cosim.study.cli import parser; parser().format_help(); " \
           "print(sorted({'numpy', 'scipy', 'matplotlib', 'pandas', 'fmpy'} & set(sys.modules)))"  # fmt: skip
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True).stdout.strip() == "[]"


def test_the_summary_is_json_whatever_the_numbers(doubled, tmp_path, monkeypatch):
    monkeypatch.setattr(result, "_indices", lambda *_: ({"end": {"first order": {GAIN: np.float64("nan")}}}, {}))
    line = ["sweep", str(doubled), "--vary", f"{GAIN}=0:1", "--sample", "lhs:2", "--metric", "end=final(b.y1)",
            "--out", str(tmp_path), "--no-plots", "--quiet", "--processes", "1"]  # fmt: skip
    assert main(line) == 0
    told = json.loads((tmp_path / "summary.json").read_text(), parse_constant=pytest.fail)
    assert told["sensitivities"]["end"]["first order"] == {GAIN: None}


DRIVEN = "time,in\n0,0\n0.5,1\n0.5,3\n1,3\n"


def test_elements_of_arrays_are_no_metrics_of_their_own(tmp_path):
    """A whole array is no number, and neither is one of its values, which its connector's name stands for."""
    ports = (connector(f"array_{way}", f"{way}put", "Float64", sizes=(3,)) for way in ("in", "out"))
    ramp = linear("r", A=[[0, 1], [0, 0]], C=[[1, 0]], x0=[0, 1])
    links = (link("a.array_out", "r.u1", startIndices="2"), link("r.y1", "a.array_in", endIndices="1"))
    root = system("root", component("a", "resources/L.fmu", *ports), ramp, links=links)
    path = package(tmp_path / "p.ssp", root, {"resources/L.fmu": native.linear(tmp_path, 3)}, version="2.0", stop=1.0)
    with Session(path) as session:
        assert {m.connector for m in default_metrics(session)} == {"r.y1"}


def test_a_table_that_changes_is_read_again(tmp_path):
    root = system("root", linear("a", D=[[1]]), made=(connector("in", "input"),), links=(link("in", "a.u1"),))
    path = package(tmp_path / "p.ssp", root, {"resources/L.fmu": native.linear(tmp_path, 2)}, stop=1.0, step=0.1)
    table, found = tmp_path / "s.csv", []
    settings = Settings((parse_metric("y=final(a.y1)"),), stimuli=table)
    for k, value in enumerate((1, 2)):
        table.write_text(f"time,in\n0,{value}\n")
        os.utime(table, ns=(k, k))
        found.append(measure(str(path), Task(settings, {}))["values"]["y"])
    assert found == [1.0, 2.0]


def test_another_package_in_its_place_ends_the_sweep(doubled, tmp_path):
    """Its numbers would stand under the name of the first one."""
    own = tmp_path / "p.ssp"
    shutil.copyfile(doubled, own)
    other = own.read_bytes()

    def replace(done, _failed):
        if done == 1:
            (tmp_path / "new.ssp").write_bytes(other + b"\0")
            (tmp_path / "new.ssp").replace(own)

    with pytest.raises(SimulationError, match=r"p.ssp: is another file now than at the start"):
        run(own, tmp_path / "out", f"{GAIN}=1,2,5", progress=replace)
    assert len((tmp_path / "out" / CASES_FILE).read_text().splitlines()) == 1
    own.write_bytes(other)  # only its time is another one
    assert len(run(own, tmp_path / "out", f"{GAIN}=1,2,5")) == 3


def test_another_table_in_its_place_ends_the_sweep(tmp_path):
    root = system("root", linear("a", D=[[1]]), made=(connector("in", "input"),), links=(link("in", "a.u1"),))
    path = package(tmp_path / "p.ssp", root, {"resources/L.fmu": native.linear(tmp_path, 2)}, stop=1.0, step=0.1)
    table = tmp_path / "s.csv"
    table.write_text("time,in\n0,1\n")
    settings = Settings((parse_metric("y=final(a.y1)"),), stimuli=table)

    def change(_done, _failed):
        table.write_text("time,in\n0,2\n")
        os.utime(table, ns=(5, 5))

    with pytest.raises(SimulationError, match=r"s.csv: is another file now"):
        run(path, tmp_path / "out", "a.D[1,1]=1,2", settings=settings, progress=change)
    assert not (tmp_path / "out" / CASES_FILE).read_text()


@pytest.mark.skipif(not Path("/dev/zero").exists(), reason="there is no /dev/zero here")
def test_cases_of_a_device_are_not_read(tmp_path):
    (tmp_path / CASES_FILE).symlink_to("/dev/zero")
    with pytest.raises(OutputError, match=r"cases.jsonl: is a device; only regular files are read"), Store(tmp_path):
        pass


@pytest.mark.parametrize("method", ["gauss-seidel", "nepce"])
def test_a_table_drives_the_system_in_all_cases(tmp_path, method):
    """y' = g u, u a line from 0 to 1 in half a second and 3 from then on: y(1) = g (0.25 + 1.5); with values held at
    each step's start of 0.1 s the line counts 0.2."""
    part = linear("a", A=[[0]], B=[[1]], C=[[1]])
    root = system("root", part, made=(connector("in", "input"),), links=(link("in", "a.u1"),))
    fmu = {"resources/L.fmu": native.linear(tmp_path, 2)}
    path = package(tmp_path / "p.ssp", root, fmu, stop=1.0, step=0.1)
    (tmp_path / "s.csv").write_text(DRIVEN)
    line = ["sweep", str(path), "--vary", "a.B[1,1]=1,2", "--metric", "y=final(a.y1)", "--out", str(tmp_path / "o"),
            "--quiet", "--no-plots", "--method", method, "--processes", "1"]  # fmt: skip
    assert main([*line, "--stimuli", str(tmp_path / "s.csv")]) == 0
    said = json.loads((tmp_path / "o" / "summary.json").read_text())
    assert said["stimuli"] == str((tmp_path / "s.csv").resolve())
    once = 1.75 if method == "nepce" else 1.7
    [table] = (tmp_path / "o").glob("sweep.*")
    made = pd.read_parquet(table) if table.suffix == ".parquet" else pd.read_csv(table)
    assert made["y"].tolist() == pytest.approx([once, 2 * once])
    (tmp_path / "s.csv").write_text("time,in\n0,1\n")  # another table makes other cases
    assert main([*line, "--stimuli", str(tmp_path / "s.csv")]) == 0
    made = pd.read_parquet(table) if table.suffix == ".parquet" else pd.read_csv(table)
    assert made["y"].tolist() == pytest.approx([1.0, 2.0])


def test_what_a_table_drives_cannot_be_varied(tmp_path, capsys):
    root = system("root", linear("a", D=[[1]]), made=(connector("in", "input"),), links=(link("in", "a.u1"),))
    path = package(tmp_path / "p.ssp", root, {"resources/L.fmu": native.linear(tmp_path, 2)}, stop=1.0, step=0.1)
    (tmp_path / "s.csv").write_text(DRIVEN)
    line = ["sweep", str(path), "--metric", "final(a.y1)", "--out", str(tmp_path / "o"), "--vary", "in=1,2", "--quiet"]
    assert code(main, [*line, "--stimuli", str(tmp_path / "s.csv")]) == 2
    assert "'in' is driven by" in capsys.readouterr().err
    assert code(main, [*line, "--stimuli", str(tmp_path / "no.csv")]) == 2
    assert "no.csv: cannot be read" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("vary", "others", "message"),
    [
        ("b.u1=1,2", (), "'b.u1' is connected to 'a.y1', which counts"),
        (f"{GAIN}=1,2", ("--set", "b.x0[1]=1", "--set", "b.x0[1]=2"), "it is set already"),
        (f"{GAIN}=1,2", ("--metric", "at(b.y1, 70)"), "70 s is not in the run"),
        (f"{GAIN}=1,2", ("--metric", "reaches(b.y1, 1, -0.1)"), "within = -0.1 is negative"),
        ("case=1,2", (), "the table has a column of that name"),
        (f"{GAIN}=1,2", ("--metric", "final(a.string_out)"), "'a.string_out' is not a single number"),
    ],
)
def test_what_cannot_be_meant_is_one_line(doubled, tmp_path, capsys, vary, others, message):
    arguments = ["--vary", vary, *others, "--out", str(tmp_path / "o"), "--quiet"]
    assert code(main, ["sweep", str(doubled), *arguments]) == 2
    assert message in capsys.readouterr().err


def test_a_list_of_cases_that_is_a_folder_is_one_line(tmp_path):
    (tmp_path / CASES_FILE).mkdir()
    with pytest.raises(OutputError), Store(tmp_path):
        pass


def test_a_case_that_kills_the_workers_of_a_dask_cluster_has_failed(doubled, tmp_path):
    distributed = pytest.importorskip("distributed")
    import dask
    from deepsea_cosim.master.parallel.dask_executor import DaskExecutor

    with dask.config.set({"distributed.scheduler.allowed-failures": 1}):
        cluster = distributed.LocalCluster(
            n_workers=1, threads_per_worker=1, processes=True, dashboard_address=None, silence_logs=50
        )
    with cluster, distributed.Client(cluster) as client:
        found = run(doubled, tmp_path, "b.trouble=0,3", executor=DaskExecutor(client))
    assert found[0]["values"]["end"] == pytest.approx(2.0)
    assert "died" in found[1]["failed"]


def test_the_command_sends_its_cases_to_the_cluster_at_an_address(doubled, tmp_path):
    distributed = pytest.importorskip("distributed")
    line = [*command(doubled, tmp_path / "there"), "--quiet"]
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None, silence_logs=50
    ) as cluster:
        assert main([*line, "--dask", cluster.scheduler_address]) == 0
    assert main([*command(doubled, tmp_path / "here"), "--quiet"]) == 0
    tables = [next((tmp_path / place).glob("sweep.*")).read_bytes() for place in ("there", "here")]
    assert tables[0] == tables[1]


def test_a_worker_with_other_code_is_refused(doubled, tmp_path, monkeypatch, capsys):
    distributed = pytest.importorskip("distributed")
    from deepsea_cosim.master.parallel import dask_executor

    monkeypatch.setattr(dask_executor, "code_digest", lambda: "of another version")
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, processes=True, dashboard_address=None, silence_logs=50
    ) as cluster:
        line = [*command(doubled, tmp_path), "--quiet", "--dask", cluster.scheduler_address]
        assert main(line) == 2
    assert "has another version of deepsea-cosim than this machine" in capsys.readouterr().err


def test_a_disk_that_is_full_at_the_end_is_one_line(tmp_path):
    store = Store(tmp_path)
    store.__enter__()
    store._file.close()
    store._file = Path("/dev/full").open("ab")  # noqa: SIM115
    with pytest.raises(OutputError, match="No space left"):
        store.put("x", {"failed": "no"})
    with pytest.raises(OutputError, match=r"cases\.jsonl: cannot be written \(No space left"):
        store.__exit__(None, None, None)


def test_nothing_to_measure_is_one_line(tmp_path, capsys):
    native.compiler or pytest.skip("there is no C compiler here")
    path = package(tmp_path / "p.ssp", system("root", linear("a", C=[[1]])),
                   {"resources/L.fmu": native.linear(tmp_path, 2)}, stop=1.0, step=0.1)  # fmt: skip
    assert main(["sweep", str(path), "--vary", "a.x0[1]=1,2", "--out", str(tmp_path / "o")]) == 2
    assert "no connected output is a number; say with --metric" in capsys.readouterr().err


def test_pictures_and_units_of_names_that_look_alike(doubled, tmp_path):
    """Labels that would be one file are two, an axis with one value is none, and Parquet knows the units."""
    parquet = pytest.importorskip("pyarrow.parquet")
    metrics = ["--metric", "a+b=final(b.y1)", "--metric", "a/b=max(b.y1)", "--metric", "t=reaches(b.y1, 0.5, 0.1)"]
    varied = ["--vary", f"{GAIN}=2", "--vary", "a.x0[2]=1:9:1"]
    assert main(["sweep", str(doubled), *varied, *metrics, "--out", str(tmp_path), "--quiet"]) == 0
    assert {p.name for p in tmp_path.glob("*.png")} == {"a_b.png", "a_b_2.png", "t.png"}
    field = parquet.read_schema(tmp_path / "sweep.parquet").field("t")
    assert field.metadata[b"unit"] == b"s"


def test_a_dask_cluster_whose_worker_is_killed_gives_the_same(doubled, tmp_path):
    distributed = pytest.importorskip("distributed")
    from deepsea_cosim.master.parallel.dask_executor import DaskExecutor

    expected = run(doubled, tmp_path / "here", f"{GAIN}=1:40:1", settings=Settings(END.metrics, step=1e-4))
    cluster = distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None, silence_logs=50
    )
    killed = []

    def progress(done, failed):
        if done == 5 and not killed:
            killed.append(next(iter(cluster.workers.values())).pid)
            os.kill(killed[0], signal.SIGKILL)

    with cluster, distributed.Client(cluster) as client:
        found = run(doubled, tmp_path / "there", f"{GAIN}=1:40:1", settings=Settings(END.metrics, step=1e-4),
                    executor=DaskExecutor(client), progress=progress)  # fmt: skip
    assert killed
    assert found == expected
    assert np.all([e["values"]["end"] == pytest.approx(k + 1.0) for k, e in enumerate(found)])


def test_a_folder_with_results_of_others_is_left_alone(doubled, tmp_path, capsys):
    out = tmp_path / "out"
    line = ["sweep", str(doubled), "--vary", f"{GAIN}=1,2", "--metric", "final(b.y1)", "--out", str(out), "--no-plots",
            "--processes", "1", "--quiet"]  # fmt: skip
    out.mkdir()
    for name in ("summary.json", "sweep.csv", "cases.jsonl"):
        (out / name).write_text("a thesis")
        assert main(line) == 2
        assert f"holds '{name}', which a sweep has not left there" in capsys.readouterr().err
        assert (out / name).read_text() == "a thesis"
        (out / name).unlink()
    assert main(line) == 0
    (out / "summary.json").unlink()
    assert main(line) == 0, "a sweep that was killed before its summary goes on"
    (out / "cases.jsonl").write_text("[" * 100_000 + "\n" + (out / "cases.jsonl").read_text())
    assert main(line) == 0
