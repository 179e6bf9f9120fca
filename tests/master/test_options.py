"""Options of a run, from Python and from the shell, and what they leave in the result folder."""

from __future__ import annotations

import json
import subprocess
import sys
import time
from contextlib import nullcontext, suppress
from pathlib import Path

import numpy as np
import pytest
from deepsea_cosim import simulate
from deepsea_cosim.core.errors import OutputError, UsageError
from deepsea_cosim.core.files import held
from deepsea_cosim.master.cli import main
from deepsea_cosim.master.simulation import run_folder
from deepsea_cosim.master.simulation.plot import Plotter
from deepsea_cosim.master.simulation.run import Options, run
from deepsea_cosim.master.simulation.run_folder import held_again

from benchmarks import native

from ..packages import connector, package, system
from .parts import constant, with_fmu

pytestmark = pytest.mark.skipif(native.compiler is None, reason="there is no C compiler here")



def test_the_end_is_kept_whatever_every_is(fmus, tmp_path):
    root = system("root", constant("a", 2.0))
    path = package(tmp_path / "p.ssp", root, with_fmu(fmus), stop=1.0, step=0.01)
    for every, last_before in ((1, 0.99), (7, 0.98), (50, 0.5), (1000, 0.0)):
        times = run(path, tmp_path / "out", Options(record_every=every)).frame()["time"].tolist()
        assert times[-2:] == pytest.approx([last_before, 1.0])
        assert times == sorted(set(times))


def test_a_pattern_means_the_elements_of_an_array_too(fmus, tmp_path):
    array = connector("array_out", "output", None)
    path = package(tmp_path / "p.ssp", system("root", constant("a", 2.0, array)), with_fmu(fmus, 3))
    frame = run(path, tmp_path / "out", Options(record=("*.array_out",))).frame()
    assert list(frame) == ["time", *(f"a.array_out[{k}]" for k in (1, 2, 3))]


def test_what_an_earlier_run_left_is_gone(fmus, tmp_path):
    pytest.importorskip("pyarrow")
    path = package(tmp_path / "p.ssp", system("root", constant("a", 2.0)), with_fmu(fmus))
    run(path, tmp_path / "out", Options(results="r.parquet"))
    (tmp_path / "out" / "mine.csv").write_text("kept")
    run(path, tmp_path / "out")
    names = {p.name for p in (tmp_path / "out").iterdir()}
    assert names == {"results.csv", "summary.json", "manifest.json", "mine.csv"}


def test_the_command_of_the_manifest_repeats_all_options(fmus, tmp_path):
    path = package(tmp_path / "p.ssp", system("root", constant("a", 2.0)), with_fmu(fmus))
    options = Options(check_step=True, plot=("a.*",), record_every=3, substeps=(("a", 2),))
    run(path, tmp_path / "out", options)
    command = json.loads((tmp_path / "out" / "manifest.json").read_text())["command"]
    for part in ("--check-step", "--plot 'a.*'", "--record-every 3", "--substeps a=2"):
        assert part in command


def test_what_an_earlier_run_left_below_the_folder_is_gone(fmus, tmp_path):
    path = package(tmp_path / "p.ssp", system("root", constant("a", 2.0)), with_fmu(fmus))
    out = tmp_path / "out"
    run(path, out, Options(results="deep/r.csv"))
    assert (out / "deep" / "r.csv").exists()
    run(path, out)
    assert not (out / "deep" / "r.csv").exists()


def test_a_manifest_that_names_a_file_elsewhere_removes_nothing(fmus, tmp_path):
    path = package(tmp_path / "p.ssp", system("root", constant("a", 2.0)), with_fmu(fmus))
    out = tmp_path / "out"
    out.mkdir()
    (tmp_path / "mine.csv").write_text("kept")
    (out / "link").symlink_to(tmp_path)
    for name in ("../mine.csv", "link/mine.csv", str(tmp_path / "mine.csv")):
        (out / "manifest.json").write_text(json.dumps({"options": {"results": name}}))
        run(path, out)
        assert (tmp_path / "mine.csv").read_text() == "kept"


def test_one_run_at_a_time_writes_to_a_folder(fmus, tmp_path):
    path = package(tmp_path / "p.ssp", system("root", constant("a", 2.0)), with_fmu(fmus))
    run(path, tmp_path / "out")
    before = (tmp_path / "out" / "results.csv").read_bytes()
    with held(tmp_path / "out", "somebody"), pytest.raises(OutputError, match="another run is writing there"):
        run(path, tmp_path / "out")
    assert (tmp_path / "out" / "results.csv").read_bytes() == before
    run(path, tmp_path / "out")


def test_the_folder_is_held_until_all_is_written(fmus, tmp_path):
    """The run with half the step writes into the summary, long after the record is whole."""
    path = package(tmp_path / "p.ssp", system("root", constant("a", 2.0)), with_fmu(fmus))
    totals, free = set(), []

    def progress(done, total):
        totals.add(total)
        with suppress(OutputError), held(tmp_path / "out", "somebody"):
            free.append(total)

    run(path, tmp_path / "out", Options(check_step=True), progress=progress)
    assert len(totals) == 2
    assert not free
    with held(tmp_path / "out", "somebody"):
        pass


def test_plot_and_page_are_not_put_beside_the_files_of_another_run(fmus, tmp_path, monkeypatch, capsys):
    """They are written after the run, when its folder may be another one's."""
    path = str(package(tmp_path / "p.ssp", system("root", constant("a", 2.0)), with_fmu(fmus)))
    out = tmp_path / "out"
    free = []

    def draws(_self, target, *_rest):
        with suppress(OutputError), held(out, "somebody"):
            free.append(target)

    monkeypatch.setattr(Plotter, "draw", draws)
    assert main([path, "--out", str(out), "--html"]) == 0
    assert not free
    assert capsys.readouterr().err == ""
    first = json.loads((out / "summary.json").read_text())
    with held_again(out, first):
        pass
    run(Path(path), out)
    with pytest.raises(OutputError, match="another run has written there meanwhile"), held_again(out, first):
        pass
    monkeypatch.setattr(run_folder, "held_again", lambda *_: held_again(out, first))
    assert main([path, "--out", str(out), "--html"]) == 0
    told = capsys.readouterr().err.splitlines()
    assert [line.partition(": another run")[0].rpartition(": ")[0] for line in told] == [
        "cosim-master: overview.png was not drawn", "cosim-master: results.html was not written"
    ]  # fmt: skip


@pytest.mark.parametrize(
    "wrong",
    [{"step": "soon"}, {"step": [1]}, {"record_every": 1.5}, {"substeps": ["a"]}, {"substeps": {"a": 2.5}},
     {"step": True}, {"changes": ["a"]}, {"step": 10**400}, {"record_every": float("inf")}, {"method": True},
     {"method": 5}, {"variant": 5}, {"steps": 5}, {"changes": 5}, {"changes": [(1, 2)]}, {"substeps": 5},
     {"substeps": {"a": float("inf")}}, {"record": 5}, {"record": [5]}, {"plot": [None]}, {"parameters": 5},
     {"stimuli": 5}, {"isolate": "no"}, {"isolate": np.array([1, 2])}, {"results": "a\0.csv"}, {"step_timeout": -1},
     {"step": np.True_}],
)  # fmt: skip
def test_options_from_python_are_refused_in_one_line(fmus, tmp_path, wrong):
    path = package(tmp_path / "p.ssp", system("root", constant("a", 2.0)), with_fmu(fmus))
    with pytest.raises(UsageError):
        simulate(path, tmp_path / "out", **wrong)


def test_options_from_python_may_be_written_as_in_the_shell(fmus, tmp_path):
    path = package(tmp_path / "p.ssp", system("root", constant("a", 2.0)), with_fmu(fmus))
    given = {
        "step": "0.25", "substeps": "a=2", "check_step": np.False_, "realtime": np.int64(0), "record_every": "1",
        "results": Path("r.csv"), "changes": "a.x0[1]=3",
    }  # fmt: skip
    result = simulate(path, tmp_path / "out", **given)
    assert result.summary["step_s"] == 0.25
    assert result.frame()["a.y1"].tolist() == [3.0] * 5


@pytest.mark.skipif(sys.platform == "win32", reason="there is no SIGTERM")
def test_a_request_to_end_is_kept_like_ctrl_c(fmus, tmp_path):
    path = package(tmp_path / "p.ssp", system("root", constant("a", 2.0)), with_fmu(fmus), stop=1e6, step=1e-3)
    command = [sys.executable, "-m", "deepsea_cosim.master.cli", str(path), "--out", str(tmp_path / "out"), "--no-plot"]
    running = subprocess.Popen([*command, "--record-every", "1000"], stderr=subprocess.PIPE, text=True)
    results = tmp_path / "out" / "results.csv"
    while running.poll() is None and not (results.exists() and results.stat().st_size > 1000):
        time.sleep(0.05)
    running.terminate()
    assert "asked to end (SIGTERM) at t = " in running.communicate()[1]
    assert running.returncode == 143
    assert json.loads((tmp_path / "out" / "summary.json").read_text())["status"] == "interrupted"


@pytest.mark.parametrize(
    "manifest",
    ['{"options": {"results": ".."}}', '{"options": {"results": "mine"}}', '{"options": {"results": "notes.txt"}}',
     '{"options": {"results": 3}}', "[" * 9999],
)  # fmt: skip
def test_a_strange_manifest_makes_nobody_remove_anything(fmus, tmp_path, manifest):
    path = package(tmp_path / "p.ssp", system("root", constant("a", 2.0)), with_fmu(fmus))
    out = tmp_path / "base" / "out"
    (out / "mine").mkdir(parents=True)
    for kept in (tmp_path / "base" / "precious.txt", out / "notes.txt", out / "mine" / "data.csv"):
        kept.write_text("kept")
    (out / "manifest.json").write_text(manifest)
    with pytest.raises(OutputError, match=r"holds 'manifest.json'") if manifest[0] == "[" else nullcontext():
        run(path, out)
    assert all(kept.exists() for kept in (tmp_path / "base" / "precious.txt", out / "notes.txt", out / "mine/data.csv"))


@pytest.mark.parametrize("wrong", [None, 5, b"p.ssp", "a\0.ssp"])
def test_what_is_no_path_is_one_line(tmp_path, wrong):
    with pytest.raises(UsageError, match="is no path"):
        simulate(wrong, tmp_path / "out")


def test_systems_that_cannot_isolate_say_so(monkeypatch):
    from deepsea_cosim.master.isolation import isolated
    from deepsea_cosim.master.simulation.plan import check_options

    check_options(Options(isolate=True))
    monkeypatch.delattr(isolated.select, "poll")
    with pytest.raises(UsageError, match="--isolate cannot be had on this system"):
        check_options(Options(isolate=True))
