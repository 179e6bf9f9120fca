"""A run takes the place of an earlier one when it has something to show: before that the old one is whole, after that
the new one, however the process ends."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import pytest
from deepsea_cosim.core.errors import CosimError
from deepsea_cosim.core.files import held
from deepsea_cosim.master.cli import main
from deepsea_cosim.master.page.record import read_record
from deepsea_cosim.master.results.blocks import whole
from deepsea_cosim.master.simulation import run_folder
from deepsea_cosim.master.simulation.run import Options, run
from deepsea_cosim.master.simulation.run_folder import FAILED, STAGE, last_time, settle

from ..packages import package, system
from .parts import constant, two

REFUSES_START, HANGS_AT_START = 26, 24


@pytest.fixture
def good(fmus, tmp_path):
    return package(tmp_path / "p.ssp", system("root", constant("a", 2.0)), {"resources/L.fmu": fmus[2]}, stop=1.0)


def contents(folder: Path) -> dict[str, bytes]:
    return {str(p.relative_to(folder)): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}


def killed(running, out):
    """Kill a run; its process is gone once nobody holds the folder."""
    running.send_signal(signal.SIGKILL)
    running.wait()
    until = time.monotonic() + 60
    while time.monotonic() < until:
        try:
            with held(out, "the run"):
                return
        except CosimError:
            time.sleep(0.02)


def test_a_start_that_fails_keeps_the_earlier_result(good, fmus, tmp_path):
    out = tmp_path / "out"
    run(good, out, Options(log="fmu.log"))
    (out / "mine.txt").write_text("kept")
    before = contents(out)
    bad = two(tmp_path / "bad.ssp", fmus[2], REFUSES_START)
    with pytest.raises(CosimError, match=r"the earlier result in .* is kept, .* of this run is in failed_start"):
        run(bad, out, Options(log="fmu.log"))
    after = contents(out)
    failed = {name for name in after if name.startswith(FAILED)}
    assert failed == {f"{FAILED}/{name}" for name in ("summary.json", "manifest.json", "fmu.log")}
    assert {name: after[name] for name in set(after) - failed} == before
    assert json.loads(after[f"{FAILED}/summary.json"])["status"] == "failed"
    assert main([str(bad), "--out", str(out), "--no-plot", "--html"]) == 1
    assert not (out / "results.html").exists()  # it would show the earlier result
    run(good, out)
    assert set(contents(out)) == {"mine.txt", "summary.json", "manifest.json", "results.csv"}


def test_a_start_that_fails_in_an_empty_folder_leaves_its_summary(fmus, tmp_path):
    bad = two(tmp_path / "bad.ssp", fmus[2], REFUSES_START)
    with pytest.raises(CosimError) as error:
        run(bad, tmp_path / "out")
    assert "earlier" not in str(error.value)
    assert json.loads((tmp_path / "out" / "summary.json").read_text())["status"] == "failed"


@pytest.mark.parametrize("file", ["results.csv", "results.parquet", "deep/r.h5"])
@pytest.mark.parametrize("done", range(9))
def test_a_run_that_is_killed_as_it_takes_its_place_is_helped(good, tmp_path, monkeypatch, done, file):
    """After so many of the moves and removals, the next one that looks finds the new run, whole."""
    pytest.importorskip("pyarrow" if "parquet" in file else "h5py")
    out, left = tmp_path / "out", [done]
    run(good, out, Options(results="results.parquet" if done % 2 else file))
    (out / "overview.png").write_text("old")
    before = contents(out)

    class Killed(BaseException):
        pass

    def dies(method):
        def instead(*arguments, **more):
            if left[0] == 0:
                raise Killed
            left[0] -= 1
            return method(*arguments, **more)

        return instead

    monkeypatch.setattr(run_folder, "_forget", dies(run_folder._forget))
    replace = Path.replace
    monkeypatch.setattr(Path, "replace", lambda self, to: (dies(replace) if STAGE in str(self) else replace)(self, to))
    monkeypatch.setattr(run_folder.shutil, "rmtree", lambda *_, **__: None)  # a killed process cleans nothing up
    with suppress(Killed):
        run(good, out, Options(results=file, changes=(("a.x0[1]", "3"),)))
    monkeypatch.undo()
    record = read_record(out)
    after = {name: content for name, content in contents(out).items() if not name.startswith(STAGE)}
    if after != before:
        assert json.loads(after["manifest.json"])["options"]["changes"] == [["a.x0[1]", "3"]]
        assert record.summary.get("changes", {"a.x0[1]": "3"}) == {"a.x0[1]": "3"}
        assert float(whole(record.file)["a.y1"][-1]) == 3.0
        assert "overview.png" not in after
    run(good, out, Options(results=file))
    assert not (out / STAGE).exists()


def test_a_run_killed_in_its_set_up_is_told_by_the_next(good, fmus, tmp_path, capsys):
    out = tmp_path / "out"
    assert main([str(good), "--out", str(out), "--no-plot", "--quiet"]) == 0
    before = contents(out)
    hangs = two(tmp_path / "hangs.ssp", fmus[2], HANGS_AT_START)
    running = subprocess.Popen([sys.executable, "-m", "deepsea_cosim.master.cli", str(hangs), "--out", str(out)])
    until = time.monotonic() + 60
    while not (out / STAGE / "manifest.json").exists() and time.monotonic() < until:
        time.sleep(0.02)
    killed(running, out)
    assert {name: c for name, c in contents(out).items() if not name.startswith(STAGE)} == before
    capsys.readouterr()
    assert main([str(good), "--out", str(out), "--no-plot", "--quiet"]) == 0
    assert "a run was killed before it had anything to show; what was there before is kept" in capsys.readouterr().err


def test_a_run_killed_in_its_steps_leaves_its_record_up_to_a_time_that_is_told(fmus, tmp_path, capsys):
    fmu = {"resources/L.fmu": fmus[2]}
    path = package(tmp_path / "p.ssp", system("root", constant("a", 2.0)), fmu, stop=1e7, step=1e-2)
    out = tmp_path / "out"
    command = [sys.executable, "-m", "deepsea_cosim.master.cli", str(path), "--out", str(out), "--no-plot", "--quiet"]
    running = subprocess.Popen([*command, "--record-every", "100"])
    until = time.monotonic() + 60
    while not ((out / "results.csv").exists() and (last_time(out / "results.csv") or 0.0) > 0.0):
        assert time.monotonic() < until
        time.sleep(0.02)
    killed(running, out)
    time_kept = last_time(out / "results.csv")
    assert main([str(path), "--out", str(out), "--no-plot", "--quiet", "--stop-time", "1"]) == 0
    told = f"the run before was killed; its record, recorded up to t = {time_kept:g} s, stays"
    assert told in capsys.readouterr().err
    assert os.listdir(out).count("summary.json") == 1


def test_an_isolated_fmu_that_hangs_as_it_is_loaded_is_interrupted(fmus, tmp_path):
    out = tmp_path / "out"
    command = [sys.executable, "-m", "deepsea_cosim.master.cli", str(two(tmp_path / "p.ssp", fmus[2], HANGS_AT_START))]
    more = ["--out", str(out), "--no-plot", "--quiet", "--isolate"]
    running = subprocess.Popen([*command, *more], stderr=subprocess.PIPE, text=True)
    while not (out / "manifest.json").exists():
        time.sleep(0.02)
    running.terminate()
    _, said = running.communicate(timeout=60)
    assert running.returncode == 128 + signal.SIGTERM
    assert said.startswith("cosim-master: interrupted while component '")
    assert " was being loaded" in said
    assert len(said.splitlines()) == 1


def test_a_command_leaves_no_temporary_files(good, tmp_path):
    temporary = tmp_path / "temp"
    temporary.mkdir()
    command = [sys.executable, "-m", "deepsea_cosim.master.cli", str(good), "--out", str(tmp_path / "out"), "--no-plot"]
    subprocess.run([*command, "--quiet"], check=True, env={**os.environ, "TMPDIR": str(temporary)})
    assert not list(temporary.iterdir())


OTHERS = ("results.csv", "summary.json", "overview.png", "results.html", "state.zip")


@pytest.mark.parametrize("name", OTHERS)
def test_files_that_no_run_has_left_are_not_replaced(good, tmp_path, capsys, name):
    out = tmp_path / "out"
    out.mkdir()
    (out / name).write_text("a thesis")
    (out / "notes.txt").write_text("kept")
    assert main([str(good), "--out", str(out), "--no-plot", "--quiet"]) == 2
    assert f"holds '{name}', which a run has not left there; --out names another folder" in capsys.readouterr().err
    assert (out / name).read_text() == "a thesis"
    (out / name).unlink()
    assert main([str(good), "--out", str(out), "--no-plot", "--quiet"]) == 0
    assert (out / "notes.txt").read_text() == "kept"
    assert main([str(good), "--out", str(out), "--no-plot", "--quiet"]) == 0, "a run's own are"


def test_what_somebody_keeps_where_a_run_stages_its_files(good, tmp_path, capsys):
    out, outside = tmp_path / "out", tmp_path / "outside"
    line = [str(good), "--out", str(out), "--no-plot", "--quiet"]
    assert main(line) == 0
    outside.mkdir()
    (out / ".new").symlink_to(outside)
    assert main(line) == 2
    assert ".new: is a link or a file" in capsys.readouterr().err
    assert not list(outside.iterdir())
    (out / ".new").unlink()
    (out / ".new").mkdir()
    (out / ".new" / "thesis.txt").write_text("precious")
    assert main(line) == 2
    assert ".new: holds files of somebody else" in capsys.readouterr().err
    assert (out / ".new" / "thesis.txt").read_text() == "precious"


def test_a_stranger_cannot_say_what_is_removed(good, tmp_path):
    out = tmp_path / "out"
    assert main([str(good), "--out", str(out), "--no-plot", "--quiet"]) == 0
    (out / "a.py").write_text("precious")
    (out / ".new").mkdir()
    (out / ".new" / "switch.json").write_text('{"move": [], "remove": ["a.py"]}')
    settle(out)
    assert (out / "a.py").read_text() == "precious"


@pytest.mark.parametrize("name", [".new/x.csv", "failed_start/x.csv", "a\nb.csv", f"{'n' * 250}.csv"])
def test_names_that_a_record_cannot_have_are_refused_and_the_earlier_one_stays(good, tmp_path, capsys, name):
    out = tmp_path / "out"
    assert main([str(good), "--out", str(out), "--no-plot", "--quiet"]) == 0
    before = (out / "results.csv").read_bytes()
    assert main([str(good), "--out", str(out), "--no-plot", "--results", name]) == 2
    assert capsys.readouterr().err.count("\n") == 1
    assert (out / "results.csv").read_bytes() == before


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="there are no pipes here")
def test_a_pipe_in_the_place_of_a_record_is_not_waited_for(good, tmp_path, capsys):
    out = tmp_path / "out"
    assert main([str(good), "--out", str(out), "--no-plot", "--quiet"]) == 0
    (out / "results.csv").unlink()
    os.mkfifo(out / "results.csv")
    assert main(["open", str(out)]) == 2
    assert "results.csv: is a pipe; only regular files are read" in capsys.readouterr().err
