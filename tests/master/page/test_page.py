"""The page of a run: the numbers of the file, whatever is in it, and strangers' names as text."""

from __future__ import annotations

import json
import math
import os
import tomllib
import zipfile
from pathlib import Path

import numpy as np
import pytest
from deepsea_cosim.core.display_units import display_units
from deepsea_cosim.core.errors import OutputError, UsageError
from deepsea_cosim.master.cli import main
from deepsea_cosim.master.page import write
from deepsea_cosim.master.page.write import SCRIPTS, write_page
from deepsea_cosim.master.results import open_writer
from deepsea_cosim.master.results.columns import TIME, Column

from ...commands import code
from ...toys import package
from .made import Scripts, content, record, result_folder, times, values

N = 50
X = np.sin(np.arange(N))
KINDS = {
    "a.x": (X * 0.2, "float", "m"),
    "a.p": (1.2e8 + X, "float", "Pa"),
    "a.hole": (np.where(np.arange(N) == 7, np.nan, X), "float", None),
    "a.far": (np.where(np.arange(N) == 7, np.inf, X), "float", None),
    "a.never": (np.full(N, np.nan), "float", None),
    "a.still": (np.full(N, 3.5), "float", None),
    "a.on": (np.arange(N) % 2 == 0, "boolean", None),
    "a.n": (np.arange(N) // 3, "integer", None),
    "b.state": (["open" if k % 2 else "<b>'shut'</b>" for k in range(N)], "text", None),
    "b.y[1]": (X, "float", None),
    "b.y[2]": (2.0 * X, "float", None),
}


@pytest.mark.parametrize("file", ["results.csv", "results.parquet", "results.h5"])
def test_the_numbers_of_the_file(tmp_path, file):
    pytest.importorskip({".parquet": "pyarrow", ".h5": "h5py"}.get(Path(file).suffix, "csv"))
    told = content(write_page(result_folder(tmp_path / "run", KINDS, file=file)))
    assert [s["name"] for s in told["signals"]] == list(KINDS)
    assert np.array_equal(times(told["runs"][0]), np.arange(N) / 10.0)
    for name in ("a.x", "a.hole", "a.far", "a.never", "a.still", "a.on", "a.n", "b.y[1]", "b.y[2]"):
        wanted = np.asarray(KINDS[name][0], float)
        np.testing.assert_allclose(values(told, name), wanted, rtol=1e-7, atol=0.0, equal_nan=True, err_msg=name)
    np.testing.assert_allclose(values(told, "a.p"), 1.2e8 + X, rtol=0.0, atol=1e-6)  # not what float32 makes of 1.2e8
    items = told["runs"][0]["items"]["b.state"]
    assert [items[int(k)] for k in values(told, "b.state")] == list(KINDS["b.state"][0])
    kinds = {s["name"]: s["kind"] for s in told["signals"]}
    assert [kinds[n] for n in ("a.x", "a.on", "a.n", "b.state")] == ["float", "boolean", "integer", "text"]


def test_units_as_they_are_asked_for(tmp_path):
    folder = result_folder(tmp_path / "run", KINDS)
    shown = {}
    for units in ("metric", "us"):
        told = content(write_page(folder, display_units(units)))
        signal = told["signals"][0]
        shown[units] = (signal["shown"], signal["factor"] * 0.2)
        assert np.allclose(values(told, "a.x"), 0.2 * X)
    assert shown["metric"] == ("mm", pytest.approx(200.0))
    assert shown["us"] == ("in", pytest.approx(200.0 / 25.4))


def test_long_runs_are_grouped_and_the_page_says_so(tmp_path, monkeypatch):
    monkeypatch.setattr("deepsea_cosim.master.page.series.VALUES", 2000)
    x = np.sin(np.arange(20_000) / 100.0)
    told = content(write_page(result_folder(tmp_path / "run", {"a.x": x})))
    run = told["runs"][0]
    assert (run["rows"], run["group"]) == (20_000, 64)
    assert len(times(run)) <= 1003
    np.testing.assert_allclose([values(told, "a.x").min(), values(told, "a.x").max()], [x.min(), x.max()], rtol=1e-7)


def test_one_row_and_nothing_connected(tmp_path):
    told = content(write_page(result_folder(tmp_path / "run", {"a.x": [1.5]})))
    assert values(told, "a.x").tolist() == [1.5]
    assert told["connections"] == []
    assert told["chosen"] == ["a.x"]


def test_a_run_of_no_rows_is_a_page(tmp_path):
    told = content(write_page(result_folder(tmp_path / "run", {"a.x": []})))
    assert told["runs"][0]["rows"] == 0


def test_what_drives_something_is_shown_first(tmp_path):
    signals = {f"a.y{k}": np.arange(5.0) + k for k in range(9)} | {"b.u": np.arange(5.0)}
    told = content(write_page(result_folder(tmp_path / "run", signals, connections=[["a.y3", "b.u"]])))
    assert told["chosen"] == ["a.y3"]
    assert [s["driven"] for s in told["signals"]] == [False] * 9 + [True]
    assert {s["component"] for s in told["signals"]} == {"a", "b"}


EVIL = "</script><script>alert('x')</script><!-- \"&quot; \u2028 <img src=x onerror=alert(1)>"


def test_names_end_no_script(tmp_path):
    folder = result_folder(
        tmp_path / "run", {f"a.{EVIL}": (X, "float", EVIL), "b.t": ([EVIL] * N, "text", None)}, package=f"{EVIL}.ssp",
        warnings=[EVIL], order=["a", EVIL], connections=[[f"a.{EVIL}", f"b.{EVIL}"]], error=EVIL, status=EVIL,
        parameters={EVIL: {"value": EVIL, "unit": EVIL, "from": EVIL, "where": EVIL}},
        answers={"sentences": [EVIL]},
    )  # fmt: skip
    page = write_page(folder)
    told = content(page)
    assert told["signals"][0]["name"] == f"a.{EVIL}"
    assert told["warnings"] == told["sentences"] == [EVIL]
    assert told["runs"][0]["items"]["b.t"] == [EVIL]
    assert "<img" not in page.read_text(encoding="utf-8")
    assert Scripts(page.read_text(encoding="utf-8")).tags.count("script") == 3


def test_parameters_of_the_user_come_first(tmp_path):
    given = {
        "a.m": {"value": 2.0, "unit": "kg", "from": "FMU", "where": None},
        "a.p": {"value": 2e7, "unit": "Pa", "from": "package", "where": "p.ssv, line 4"},
        "a.k": {"value": [1.0, 2.0], "unit": None, "from": "command line", "where": "--set"},
        "a.deep": {"value": 11000.0, "unit": "m", "from": "FMU", "where": None},
    }
    told = content(write_page(result_folder(tmp_path / "run", {"a.x": X}, parameters=given)))["parameters"]
    assert [p["name"] for p in told] == ["a.k", "a.p", "a.m", "a.deep"]
    assert [p["changed"] for p in told] == [True, False, False, False]
    assert [(p["value"], p["unit"]) for p in told] == [("1 2", ""), ("20", "MPa"), ("2", "kg"), ("11000", "m")]
    assert told[1]["own"] == "20000000 Pa"


def test_the_master_writes_it(toys, tmp_path):
    fmus = {"s": toys / "Spring.fmu", "m": toys / "Mass.fmu"}
    path = package(tmp_path / "p.ssp", fmus, ["s.F -> m.F", "m.v -> s.v"], stop=0.5, step=0.1)
    out = tmp_path / "out"
    assert main([str(path), "--out", str(out), "--no-plot", "--quiet", "--html", "--set", "m.m=3"]) == 0
    told = content(out / "results.html")
    table = np.genfromtxt(out / "results.csv", delimiter=",", names=True, deletechars="")
    for name in table.dtype.names[1:]:
        np.testing.assert_allclose(values(told, name), table[name], rtol=1e-7)
    assert sorted(told["connections"]) == [["m.v", "s.v"], ["s.F", "m.F"]]
    assert told["components"] == json.loads((out / "summary.json").read_text())["order"]
    assert told["trust"].startswith("Trust:")
    assert told["parameters"][0]["name"] == "m.m"
    assert main([str(path), "--out", str(out), "--no-plot", "--quiet"]) == 0
    assert not (out / "results.html").exists()  # it would pass for this run's


def test_a_run_that_had_to_stop_has_a_page(toys, tmp_path, capsys):
    path = package(tmp_path / "p.ssp", {"b": toys / "Bomb.fmu"}, parameters={"b.t_bomb": 0.55}, stop=1.0, step=0.1)
    assert code(main, [str(path), "--out", str(tmp_path / "out"), "--no-plot", "--quiet", "--html"]) == 1
    told = content(tmp_path / "out" / "results.html")
    assert told["error"]
    assert 0.3 < times(told["runs"][0])[-1] < 0.7


def test_html_needs_a_file(toys, tmp_path, capsys):
    path = package(tmp_path / "p.ssp", {"m": toys / "Mass.fmu"}, stop=0.5, step=0.1)
    assert code(main, [str(path), "--out", str(tmp_path / "out"), "--html", "--results", ""]) == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_open_makes_a_page_once_and_again_when_it_is_old(tmp_path, capsys):
    folder = result_folder(tmp_path / "run", {"a.x": (X, "float", "m")})
    page = folder / "results.html"
    opened = ["open", str(folder), "--no-browser"]
    assert code(main, opened) == 0
    assert capsys.readouterr().out == f"{page}\n"
    page.write_text("mine")
    assert code(main, opened) == 0
    assert page.read_text() == "mine"
    assert code(main, [*opened, "--units", "us"]) == 0
    assert content(page)["signals"][0]["shown"] == "in"
    result_folder(tmp_path / "run", {"a.x": (X[:9], "float", "m")})
    os.utime(page, (0, 0))
    assert code(main, opened) == 0
    assert content(page)["runs"][0]["rows"] == 9


def test_open_shows_it_in_the_browser(tmp_path, monkeypatch, capsys):
    seen = []
    monkeypatch.setattr("webbrowser.open", lambda url: bool(seen.append(url)) or len(seen) == 1)
    folder = result_folder(tmp_path / "run", {"a.x": X})
    assert code(main, ["open", str(folder)]) == 0
    assert seen == [(folder / "results.html").as_uri()]
    assert code(main, ["open", str(folder)]) == 1
    assert "open the file in a browser" in capsys.readouterr().err


def test_parts_that_a_killed_run_has_left(tmp_path):
    pytest.importorskip("pyarrow")
    writer = open_writer(tmp_path / "r.parquet", [TIME, Column("a.x"), Column("a.s", "text")])
    writer.write([np.arange(3.0), np.arange(3.0), ["u", "v", "u"]])
    writer.write([np.arange(3.0, 5.0), np.arange(2.0), ["v", "v"]])
    assert (tmp_path / "r.parquet").is_dir()
    told = content(write_page(tmp_path / "r.parquet"))
    assert values(told, "a.x").tolist() == [0.0, 1.0, 2.0, 0.0, 1.0]
    assert values(told, "a.s").tolist() == [0.0, 1.0, 0.0, 1.0, 1.0]


def test_a_file_on_its_own(tmp_path):
    path = record(tmp_path / "lone.csv", {"a.x": X, "b.s": (["007", *["on"] * (N - 1)], "text", None)})
    page = write_page(path)
    assert page == tmp_path / "lone.csv.html"
    told = content(page)
    assert [s["component"] for s in told["signals"]] == ["a", "b"]
    assert told["runs"][0]["items"]["b.s"] == ["007", "on"]


def test_a_package_called_open(toys, tmp_path, monkeypatch):
    """It is named with its folder, for the word alone is the command, whatever lies about."""
    monkeypatch.chdir(tmp_path)
    made = package(tmp_path / "p.ssp", {"m": toys / "Mass.fmu"}, stop=0.5, step=0.1)
    with zipfile.ZipFile(made) as archive:
        archive.extractall(tmp_path / "open")
    assert code(main, ["./open", "--out", "out", "--quiet", "--no-plot"]) == 0
    assert code(main, ["open", "out", "--no-browser"]) == 0
    assert (tmp_path / "out" / "results.html").is_file()


def files_of(tmp_path):
    """What is no result, by what is wrong with it."""
    empty = tmp_path / "empty"
    empty.mkdir()
    broken = result_folder(tmp_path / "broken", {"a.x": X})
    (broken / "summary.json").write_text("{")
    listed = result_folder(tmp_path / "listed", {"a.x": X})
    (listed / "summary.json").write_text("[]")
    kept = result_folder(tmp_path / "kept", {"a.x": X})
    (kept / "results.csv").unlink()
    bad = {
        "nothing.csv": "", "words.csv": "this is\nno result\n", "binary.csv": b"\xff\xfe\x00time",
        "cut.csv": "time,a\n0,1\n1\n2,3\n",
        "late.csv": "time,a\n1,1\n0,1\n", "alone.csv": "time\n1\n2\n",
        "when.csv": "time,a\nnoon,1\n", "note.txt": "time,a\n",
        "bad.parquet": "x", "bad.h5": "x",
    }  # fmt: skip
    (tmp_path / "folder.csv").mkdir()
    for name, text in bad.items():
        (tmp_path / name).write_bytes(text if isinstance(text, bytes) else text.encode())
    return [empty, broken, listed, kept, *(tmp_path / name for name in ("nosuch", "folder.csv", *bad))]


def test_what_is_no_result_is_one_line(tmp_path, capsys):
    for path in files_of(tmp_path):
        for command in (["open", str(path), "--no-browser"], ["compare", str(path), str(path), "--no-html"]):
            assert code(main, command) == 2, path
            told = capsys.readouterr()
            assert told.err.count("\n") == 1, told.err
            assert path.name in told.err or path.parent.name in told.err


def test_a_summary_of_anything_is_no_traceback(tmp_path):
    """Folders are others' too: whatever stands in summary.json, there is a page."""
    odd = [None, 1, "x", [], [1], {}, {"a": 1}, {"a": {"value": math.inf}}]
    for key in [
        "parameters",
        "units",
        "types",
        "connections",
        "order",
        "answers",
        "warnings",
        "coupling",
        "step_s",
        "package",
    ]:
        for value in odd:
            folder = result_folder(tmp_path / "run", {"a.x": X}, **{key: value})
            content(write_page(folder))


def test_a_last_row_that_is_cut_off(tmp_path):
    path = tmp_path / "r.csv"
    path.write_text("time,a,b\n0,1,2\n1,1,2\n2,1")
    assert times(content(write_page(path))["runs"][0]).tolist() == [0.0, 1.0]


def test_a_page_that_cannot_be_written(tmp_path):
    folder = result_folder(tmp_path / "run", {"a.x": X})
    with pytest.raises(OutputError, match="cannot be written"):
        write_page(folder, target=tmp_path / "no" / "such" / "page.html")
    with pytest.raises(UsageError):
        write_page(tmp_path / "elsewhere")


def test_all_that_the_page_is_made_of_is_in_the_distribution():
    templates = Path(write.__file__).parent / "templates"
    settings = tomllib.loads((Path(__file__).parents[3] / "pyproject.toml").read_text())["tool"]["setuptools"]
    packed = {path for pattern in settings["package-data"]["*"] for path in templates.parent.glob(pattern)}
    assert {templates / name for name in (*SCRIPTS, "page.html", "page.css")} == set(templates.iterdir()) <= packed
