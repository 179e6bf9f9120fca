"""FMUs that fail, crash or hang, and masters that are killed: what was simulated is kept, and the message says why."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from deepsea_cosim.core.errors import CosimError, UsageError
from deepsea_cosim.master.results.frame import frame
from deepsea_cosim.master.simulation.run import Options, run

from benchmarks import native

from ..packages import link, package, system
from .parts import linear, rewritten, two

pytestmark = pytest.mark.skipif(native.compiler is None, reason="there is no C compiler here")

FAULTS = {"error": 1, "nan": 2, "crash": 3, "hang": 4, "fatal": 5, "discard": 7, "warning": 13}


def left(folder, file="results.csv"):
    """The record that a run left."""
    return frame(folder / file)


@pytest.mark.parametrize("version", [1, 2, 3])
def test_isolated_runs_are_the_same(fmus, tmp_path, version):
    path = two(tmp_path / "p.ssp", fmus[version])
    for method in ("gauss-seidel", "jacobi"):
        run(path, tmp_path / "here", Options(method=method))
        run(path, tmp_path / "apart", Options(method=method, isolate=True))
        assert (tmp_path / "here" / "results.csv").read_bytes() == (tmp_path / "apart" / "results.csv").read_bytes()


@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize("method", ["gauss-seidel", "jacobi", "nepce"])
def test_what_answers_at_once_is_found_out_of_isolated_fmus_too(tmp_path, version, method):
    """A loop of FMUs that do not say what they depend on: y_a = -3 y_b, y_b = y_a + t."""
    silent = {"resources/L.fmu": native.linear(tmp_path, version, through=None)}
    clock = linear("clock", A=[[0, 1], [0, 0]], B=[[0], [0]], C=[[1, 0]], x0=[0, 1])
    root = system("root", clock, linear("a", D=[[-3.0]]), linear("b", D=[[1.0, 1.0]]), links=(
        link("b.y1", "a.u1"), link("a.y1", "b.u1"), link("clock.y1", "b.u2"), link("a.y1", "clock.u1")))  # fmt: skip
    path = package(tmp_path / "p.ssp", root, silent)
    here, apart = (run(path, tmp_path / "out", Options(method=method, isolate=i)).frame() for i in (False, True))
    assert apart["a.y1"].tolist() == pytest.approx((-0.75 * apart["time"]).tolist(), abs=1e-12)
    assert here.equals(apart)


@pytest.mark.parametrize("isolate", [False, True])
@pytest.mark.parametrize("fault", ["error", "nan", "fatal", "discard"])
def test_a_failing_fmu_is_named_with_its_time(fmus, tmp_path, fault, isolate):
    path = two(tmp_path / "p.ssp", fmus[2], FAULTS[fault], 0.5)
    with pytest.raises(CosimError) as error:
        run(path, tmp_path / "out", Options(isolate=isolate))
    told = str(error.value)
    assert "b.y1 = nan" in told if fault == "nan" else "component 'b', doStep at t = 0.5" in told
    assert told.count(" at t = ") == 1
    record = left(tmp_path / "out")
    assert 0.49 <= record["time"].iloc[-1] <= 0.51
    assert record["a.y1"].to_numpy() == pytest.approx(record["time"].to_numpy())
    assert json.loads((tmp_path / "out" / "summary.json").read_text())["status"] == "failed"


@pytest.mark.parametrize("isolate", [False, True])
@pytest.mark.parametrize("version", [1, 2, 3])
def test_a_warning_without_a_word_is_told_once(fmus, tmp_path, version, isolate):
    path = two(tmp_path / "p.ssp", fmus[version], FAULTS["warning"], 0.5)
    result = run(path, tmp_path / "out", Options(isolate=isolate))
    assert result.frame()["b.y1"].iloc[-1] == pytest.approx(2.0, abs=0.03)
    told = [text for text in result.summary["warnings"] if "warning" in text]
    assert told == ["b: doStep at t = 0.5 s ended with a warning and no word of why"]


def test_a_crash_is_reported_and_the_rest_kept(fmus, tmp_path):
    path = two(tmp_path / "p.ssp", fmus[3], FAULTS["crash"], 0.5)
    with pytest.raises(CosimError, match=r"component 'b' crashed \(SIGSEGV\) in doStep at t = 0.5 s"):
        run(path, tmp_path / "out", Options(isolate=True))
    assert left(tmp_path / "out")["time"].iloc[-1] == pytest.approx(0.5)


def test_a_hang_is_ended(fmus, tmp_path):
    path = two(tmp_path / "p.ssp", fmus[1], FAULTS["hang"], 0.5)
    begin = time.monotonic()
    with pytest.raises(CosimError, match=r"component 'b' did not come back from doStep within 0.5 s at t = 0.5 s$"):
        run(path, tmp_path / "out", Options(isolate=True, step_timeout=0.5))
    assert time.monotonic() - begin < 30.0
    assert left(tmp_path / "out")["time"].iloc[-1] == pytest.approx(0.5)


@pytest.mark.parametrize("file", ["results.csv", "results.parquet"])
def test_a_hang_in_the_masters_own_process_ends_soon_after_it_is_asked_to(fmus, tmp_path, file):
    path = two(tmp_path / "p.ssp", fmus[2], FAULTS["hang"], 0.5)
    command = [sys.executable, "-m", "deepsea_cosim.master.cli", str(path), "--out", str(tmp_path / "out"), "--no-plot"]
    scratch = {**os.environ, "TMPDIR": str(tmp_path / "scratch")}
    (tmp_path / "scratch").mkdir()
    running = subprocess.Popen([*command, "--results", file], stderr=subprocess.PIPE, text=True, env=scratch)
    assert _wait((tmp_path / "out" / "manifest.json").exists)
    time.sleep(3.0)
    running.terminate()
    begin = time.monotonic()
    told = running.communicate(timeout=60.0)[1]
    assert time.monotonic() - begin < 30.0
    assert running.returncode == 143
    assert "component 'b' does not come back from doStep at t = 0.5 s; --isolate" in told
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert (summary["status"], summary["stop_time_s"]) == ("interrupted", pytest.approx(0.5))
    record = left(tmp_path / "out", file)
    assert record["time"].iloc[-1] == pytest.approx(0.5, abs=0.011)
    assert record["a.y1"].to_numpy() == pytest.approx(record["time"].to_numpy())
    assert list((tmp_path / "scratch").iterdir()) == []


def test_a_timeout_needs_a_process_of_its_own(fmus, tmp_path):
    with pytest.raises(UsageError, match="--step-timeout needs --isolate"):
        run(two(tmp_path / "p.ssp", fmus[2]), tmp_path / "out", Options(step_timeout=1.0))


@pytest.mark.parametrize("step", [0.5, 0.01])
def test_a_run_in_real_time_takes_as_long_as_what_it_simulates(fmus, tmp_path, step):
    path = two(tmp_path / "p.ssp", fmus[2], step=step)
    summary = run(path, tmp_path / "out", Options(realtime=True)).summary
    assert (summary["status"], summary["steps"]) == ("ok", round(1.0 / step))
    assert summary["real_time_factor"] == pytest.approx(1.0, abs=0.2)


def test_waiting_for_the_clock_is_interrupted_and_what_there_is_is_written(fmus, tmp_path):
    path = two(tmp_path / "p.ssp", fmus[2], stop=1000.0, step=100.0)
    master = _start(path, tmp_path / "out", "--realtime")
    file = tmp_path / "out" / "results.csv"
    assert _wait(lambda: file.is_file() and len(left(tmp_path / "out")) == 1)
    master.send_signal(signal.SIGINT)
    assert master.wait(5.0) == 130
    assert json.loads((tmp_path / "out" / "summary.json").read_text())["status"] == "interrupted"


def test_workers_end_with_a_killed_master(fmus, tmp_path):
    path = two(tmp_path / "p.ssp", fmus[2], stop=1e6, step=1e-3)
    master = _start(path, tmp_path / "out", "--isolate")
    workers = _wait(lambda: _children(master.pid))
    master.kill()
    master.wait()
    assert _wait(lambda: not any(_alive(pid) for pid in workers))


@pytest.mark.parametrize("file", ["results.csv", "results.parquet", "results.h5"])
def test_what_was_simulated_survives_a_killed_master(fmus, tmp_path, file):
    for needed in ("pyarrow", "h5py"):
        pytest.importorskip(needed)
    path = two(tmp_path / "p.ssp", fmus[2], stop=1e7, step=1e-3)
    master = _start(path, tmp_path / "out", "--results", file, "--record-every", "50")

    def progress():
        try:
            return len(left(tmp_path / "out", file)) > 2000
        except Exception:  # not there yet
            return False

    assert _wait(progress)
    master.send_signal(signal.SIGKILL)
    master.wait()
    record = left(tmp_path / "out", file)
    t = record["time"].to_numpy()
    assert len(t) > 2000
    assert np.diff(t) == pytest.approx(0.05, rel=1e-6)
    assert record["a.y1"].to_numpy() == pytest.approx(t, rel=1e-6, abs=1e-9)


def _start(path, out, *options):
    command = [sys.executable, "-m", "deepsea_cosim.master.cli", str(path), "--out", str(out), "--no-plot", "--quiet"]
    return subprocess.Popen([*command, *options], env=os.environ)


def _wait(condition, longest=60.0):
    end = time.monotonic() + longest
    while time.monotonic() < end:
        if found := condition():
            return found
        time.sleep(0.1)
    return None


def _children(pid):
    """Processes of workers below a process, which has a guardian between it and what it runs."""
    found = subprocess.run(["pgrep", "-P", str(pid)], capture_output=True, text=True, check=False).stdout.split()
    workers = []
    for child in map(int, found):
        command = Path(f"/proc/{child}/cmdline").read_bytes() if Path(f"/proc/{child}").exists() else b""
        workers += [child] if b"isolation.worker" in command else _children(child)
    return workers


def _alive(pid):
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return True


def _commanded(path, folder, *more):
    """(exit code, what is said on stderr, summary) of the command on a package."""
    command = [sys.executable, "-m", "deepsea_cosim.master.cli", str(path), "--out", str(folder), "--no-plot"]
    ended = subprocess.run([*command, "--quiet", *more], capture_output=True, text=True, timeout=120.0)
    return ended.returncode, ended.stderr, json.loads((folder / "summary.json").read_text())


@pytest.mark.parametrize("version", [1, 2, 3])
@pytest.mark.parametrize(("trouble", "did"), [(6, "ended the whole process"), (3, "crashed (SIGSEGV)")])
def test_an_fmu_that_ends_the_masters_process_leaves_what_was_simulated(fmus, tmp_path, version, trouble, did):
    """exit(0) would look as if all had been well."""
    code, said, summary = _commanded(two(tmp_path / "p.ssp", fmus[version], trouble, 0.5), tmp_path / "out")
    assert code == 1
    assert said.startswith(f"cosim-master: component 'b' {did} in doStep at t = 0.5 s; --isolate")
    assert len(said.splitlines()) == 1
    assert (summary["status"], summary["stop_time_s"]) == ("failed", pytest.approx(0.5))
    record = left(tmp_path / "out")
    assert record["time"].iloc[-1] == pytest.approx(0.49)
    assert record["a.y1"].to_numpy() == pytest.approx(record["time"].to_numpy())


@pytest.mark.parametrize(("trouble", "call"), [(17, "terminate"), (19, "freeInstance")])
def test_a_crash_as_an_fmu_is_ended_is_told(fmus, tmp_path, trouble, call):
    path = two(tmp_path / "p.ssp", fmus[2], trouble, 0.5)
    code, said, summary = _commanded(path, tmp_path / "out")
    assert (code, summary["status"]) == (1, "ok")
    assert said == (
        f"cosim-master: component 'b' crashed (SIGSEGV) in being ended ({call}); what was simulated is written\n"
    )
    code, said, summary = _commanded(path, tmp_path / "apart", "--isolate")
    assert (code, said, summary["status"]) == (0, "", "ok")
    assert summary["warnings"] == ["component 'b' crashed (SIGSEGV) in being ended"]
    assert (tmp_path / "out" / "results.csv").read_bytes() == (tmp_path / "apart" / "results.csv").read_bytes()


def test_a_hang_as_an_fmu_is_ended_is_told(fmus, tmp_path):
    result = run(two(tmp_path / "p.ssp", fmus[3], 18, 0.5), tmp_path / "out", Options(isolate=True))
    assert result.summary["warnings"] == ["component 'b' did not come back from being ended within 5 s"]
    assert json.loads((tmp_path / "out" / "summary.json").read_text()) == result.summary


@pytest.mark.parametrize("isolate", [False, True])
def test_what_an_fmu_says_as_it_is_ended_is_told(tmp_path, isolate):
    end = "int fmi2Terminate(Model *m) {"
    path = two(tmp_path / "p.ssp", rewritten(tmp_path, 2, (end, f"{end} return 3;")))
    told = run(path, tmp_path / "out", Options(isolate=isolate)).summary["warnings"]
    assert [text.partition(":")[0] for text in told] == ["component 'a', terminate", "component 'b', terminate"]
