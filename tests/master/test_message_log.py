"""What FMUs say, in a file: time, component, status and category of each message, from other processes too."""

from __future__ import annotations

import json
import os
import shlex

import pytest
from deepsea_cosim import simulate
from deepsea_cosim.master.cli import main
from deepsea_cosim.master.simulation.run import Options, run

from benchmarks import native

from ..packages import component, package, system
from .talking import STEP, talking

pytestmark = pytest.mark.skipif(native.compiler is None, reason="there is no C compiler here")

HALF_WAY = (0.5, "b", "warning", "logStatusWarning", "half way")


@pytest.fixture(scope="module")
def packages(tmp_path_factory):
    """Of two talking FMUs, by FMI version."""
    folder = tmp_path_factory.mktemp("talking")
    made = {}
    for version in (1, 2, 3):
        fmu = talking(folder / str(version), version)
        root = system("root", component("a", "resources/T.fmu"), component("b", "resources/T.fmu"))
        made[version] = package(folder / f"p{version}.ssp", root, {"resources/T.fmu": fmu})
    return made


def rows(path):
    """The messages of a log."""
    head, *lines = path.read_text().splitlines()
    assert head.split("\t") == ["time", "component", "status", "category", "message"]
    cells = [line.split("\t") for line in lines]
    return [(float(time) if time else None, *rest) for time, *rest in cells]


@pytest.mark.parametrize("isolate", [False, True])
@pytest.mark.parametrize("version", [1, 2, 3])
def test_every_message_has_its_time_component_status_and_category(packages, tmp_path, version, isolate):
    result = run(packages[version], tmp_path / "out", Options(log="fmu.log", isolate=isolate))
    found = rows(tmp_path / "out" / "fmu.log")
    steps = [row for row in found if row[3] == "logEvents"]
    assert [row[1] for row in steps] == ["a", "b"] * 10 or isolate
    assert sorted(row[:2] for row in steps) == [(pytest.approx(k / 10), c) for k in range(10) for c in "ab"]
    for time, _, status, _, text in steps:
        assert float(text.removeprefix("step at ")) == pytest.approx(time)
        assert status == "OK"
    assert HALF_WAY in [(round(row[0], 9), *row[1:]) for row in found if row[2] == "warning"]
    assert sum(row[2] == "warning" for row in found) == 2
    assert [row[4] for row in found if row[3] == "logAll"] == ["two\\nlines and more"] * 20
    assert [w for w in result.summary["warnings"] if "half way" in w] == ["a: half way", "b: half way"]


def test_without_a_log_warnings_are_told_as_before(packages, tmp_path):
    told = []
    result = run(packages[2], tmp_path / "out", log=lambda *message: told.append(message))
    assert told == [("a", "warning", "half way"), ("b", "warning", "half way")]
    assert [w for w in result.summary["warnings"] if "half way" in w] == ["a: half way", "b: half way"]
    assert {p.name for p in (tmp_path / "out").iterdir()} == {"results.csv", "summary.json", "manifest.json"}


@pytest.mark.parametrize(("version", "isolate"), [(1, False), (2, False), (3, False), (2, True)])
def test_the_level_says_what_is_written_and_debug_is_switched_on(packages, tmp_path, version, isolate):
    told = {}
    for level in ("error", "warning", "info", "debug"):
        options = Options(log="fmu.log", log_level=level, isolate=isolate)
        result = run(packages[version], tmp_path / level, options)
        assert sum("half way" in w for w in result.summary["warnings"]) == 2
        told[level] = rows(tmp_path / level / "fmu.log")
    assert told["error"] == []
    assert {row[3] for row in told["warning"]} == {"logStatusWarning"}
    assert not any(row[4].startswith("on:") for row in told["info"])
    switched = [(row[1], row[4]) for row in told["debug"] if row[4].startswith("on:")]
    all_of_them = "on:" if version == 1 else "on: logAll logEvents logStatusWarning"
    assert sorted(switched) == [("a", all_of_them), ("b", all_of_them)]
    assert len(told["debug"]) == len(told["info"]) + 2


@pytest.mark.parametrize("version", [1, 2, 3])
def test_a_category_is_switched_on_and_warnings_stay(packages, tmp_path, version):
    result = simulate(packages[version], tmp_path / "out", log="fmu.log", log_categories=["logEvents"])
    found = rows(tmp_path / "out" / "fmu.log")
    assert {row[3] for row in found} == {"logEvents", "logStatusWarning"}
    assert len(found) == 22
    assert sum("half way" in w for w in result.summary["warnings"]) == 2
    if version > 1:  # what the FMU was told is a note of logAll, which is written where that is wanted too
        simulate(packages[version], tmp_path / "all", log="a.log", log_categories=["logEvents", "logAll"])
        assert "on: logAll logEvents logStatusWarning" in [row[4] for row in rows(tmp_path / "all" / "a.log")]


def test_the_last_words_before_a_crash_are_there(tmp_path):
    fmu = talking(tmp_path / "f", 2, STEP + "    if (t > 0.25) *(volatile int *)8 = 1;\n")
    path = package(tmp_path / "p.ssp", system("root", component("a", "resources/T.fmu")), {"resources/T.fmu": fmu})
    code = main([str(path), "--out", str(tmp_path / "out"), "--log", "fmu.log", "--isolate", "--no-plot", "--quiet"])
    assert code == 1
    time, *_, text = [row for row in rows(tmp_path / "out" / "fmu.log") if row[3] == "logEvents"][-1]
    assert time == pytest.approx(0.3)
    assert text == "step at 0.3"


def test_the_command_that_repeats_the_run_has_it(packages, tmp_path, capsys):
    out = tmp_path / "out"
    given = "--log", "said/fmu.log", "--log-level", "debug", "--log-category", "logEvents"
    assert main([str(packages[2]), "--out", str(out), "--no-plot", *given]) == 0
    assert "fmu.log" in capsys.readouterr().out
    words = shlex.split(json.loads((out / "manifest.json").read_text())["command"])
    assert all(word in words for word in given)
    assert rows(out / "said" / "fmu.log")
    assert main([str(packages[2]), "--out", str(out), "--no-plot", "--quiet"]) == 0
    assert not (out / "said" / "fmu.log").exists(), "it would pass for this run's"


@pytest.mark.parametrize(
    ("given", "named"),
    [
        (("--log-level", "debug"), "--log"),
        (("--log-category", "logAll"), "--log"),
        (("--log", "fmu"), ".log"),
        (("--log", "fmu.log", "--log-category", "logEvent"), "logEvents"),
    ],
)
def test_a_log_that_cannot_be_is_refused_before_anything_is_touched(packages, tmp_path, capsys, given, named):
    for more in ((), ("--check",)):
        assert main([str(packages[3]), "--out", str(tmp_path / "out"), *given, *more]) == 2
        told = capsys.readouterr().err
        assert len(told.splitlines()) == 1
        assert named in told
    assert not (tmp_path / "out").exists()


def test_a_full_disk_does_not_end_the_run_and_is_told(packages, tmp_path, monkeypatch):
    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "write", full)
    result = run(packages[2], tmp_path / "out", Options(log="fmu.log"))
    assert result.summary["status"] == "ok"
    assert sum("No space left" in w for w in result.summary["warnings"]) == 1
