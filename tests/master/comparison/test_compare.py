"""Runs compared: where they differ first and most, against closed forms; exit codes; what only one of them has."""

from __future__ import annotations

import numpy as np
import pytest
from deepsea_cosim.core.errors import UsageError
from deepsea_cosim.master.cli import main
from deepsea_cosim.master.comparison.common_times import common_times
from deepsea_cosim.master.comparison.compare import compare, in_units_of, read_runs
from deepsea_cosim.master.comparison.difference import difference, difference_of_texts, range_of
from deepsea_cosim.master.page.record import read_record

from ...commands import code
from ..page.made import content, record, result_folder, times, values

T = np.linspace(0.0, 10.0, 1001)


def compared(a, b, tolerance=1e-6):
    """Differences by name, and the comparison."""
    runs = read_runs({"A": read_record(a), "B": read_record(b)})
    in_units_of(*runs)
    made = compare(*runs, tolerance)
    return {d.name: d for d in made.differences}, made


def test_first_and_most():
    """x = t and x = t + (t - 4)^2 / 100 from t = 4 on: by 0.36 at the end, by 1 % of the range from t = 7.22 on."""
    other = T + np.where(T > 4.0, (T - 4.0) ** 2 / 100.0, 0.0)
    span = 10.36
    d = difference("x", "m", T, T, other, 0.01)
    assert d.most.time == 10.0
    assert (d.most.a, d.most.b) == (10.0, pytest.approx(span))
    assert d.difference == pytest.approx(0.36)
    assert d.relative == pytest.approx(0.36 / span)
    exact = 4.0 + np.sqrt(100.0 * 0.01 * span)
    assert exact < d.first.time <= exact + 0.01
    assert d.first.b - d.first.a == pytest.approx((d.first.time - 4.0) ** 2 / 100.0)
    assert difference("x", "m", T, T, other, 0.05).first is None


def test_ranges():
    assert range_of(np.array([1.0, 3.0]), np.array([2.0, 5.0])) == 4.0
    assert range_of(np.zeros(3), np.zeros(3)) == 0.0
    assert range_of(np.array([1.0]), np.array([2.0])) == 1.0
    assert range_of(np.array([1e8]), np.array([1e8 + 1e-7])) == pytest.approx(100.0)  # rounding of a constant
    assert range_of(np.array([np.nan, np.inf, 2.0, 3.0])) == 1.0


def test_what_is_no_number():
    nan, inf = np.nan, np.inf
    a, b = np.array([1.0, nan, inf, -inf, 5.0]), np.array([1.0, nan, inf, -inf, 5.0])
    t = np.arange(5.0)
    assert not difference("x", "", t, a, b, 0.0).differs
    for k, value in ((0, nan), (1, 1.0), (2, 3.0), (3, inf)):
        changed = b.copy()
        changed[k] = value
        d = difference("x", "", t, a, changed, 0.1)
        assert d.first.time == d.most.time == k
        assert d.relative == inf


def test_texts():
    d = difference_of_texts("s", np.arange(4.0), ["a", "b", "c", "d"], ["a", "b", "x", "y"])
    assert (d.first.time, d.first.a, d.first.b, d.relative) == (2.0, "c", "x", 0.5)
    assert not difference_of_texts("s", np.arange(2.0), ["a", "b"], ["a", "b"]).differs


def test_times_that_are_multiples_are_compared_without_resampling(tmp_path):
    """A run and every tenth row of it, its times counted in another way."""
    a = record(tmp_path / "a.csv", {"x": np.sin(T), "on": (T > 3.0, "boolean", None)}, T)
    t = np.arange(101) * 0.1
    b = record(tmp_path / "b.csv", {"x": np.sin(T[::10]), "on": (T[::10] > 3.0, "boolean", None)}, t)
    found, made = compared(a, b, 0.0)
    assert made.common.shared
    assert not made.common.same
    assert len(made.common.times) == 101
    assert not found["x"].differs
    assert not found["on"].differs


def test_resampled_on_straight_lines(tmp_path):
    """t^2 by rows 1 s apart against rows 0.3 s apart: a chord over h is off by h^2 / 4 at its middle at most."""
    coarse, fine = np.arange(11.0), np.arange(0.0, 10.05, 0.3)
    a = record(tmp_path / "a.csv", {"x": coarse**2}, coarse)
    b = record(tmp_path / "b.csv", {"x": fine**2}, fine)
    found, made = compared(a, b)
    assert not made.common.shared
    assert made.common.times[0] == 0.0
    assert found["x"].difference == pytest.approx(0.1 * 0.2)  # 1 s lies 0.1 s behind a row and 0.2 s before the next
    assert found["x"].relative == pytest.approx(0.02 / 81.0)
    assert not compared(a, b, 2.5e-4)[1].differs


def test_what_is_held_is_not_resampled_on_lines(tmp_path):
    a = result_folder(tmp_path / "a", {"n": ([0, 0, 4, 4], "integer", None)}, [0.0, 1.0, 2.0, 3.0])
    b = result_folder(tmp_path / "b", {"n": ([0, 0, 0, 4, 4], "integer", None)}, [0.0, 0.75, 1.5, 2.0, 3.0])
    assert not compared(a, b, 0.0)[1].differs


def test_a_hole_beside_a_row_that_both_have():
    x = np.array([0.0, np.nan, 2.0])
    common = common_times(np.array([0.0, 1.0, 2.0]), np.array([0.0, 2.0]))
    assert common.numbers(common.a, x, False).tolist() == [0.0, 2.0]


def test_only_the_time_that_both_have(tmp_path):
    a = record(tmp_path / "a.csv", {"x": T}, T)
    b = record(tmp_path / "b.csv", {"x": T[:501]}, T[:501])
    _, made = compared(a, b, 0.0)
    assert made.common.times[[0, -1]].tolist() == [0.0, 5.0]
    assert not made.differs
    c = record(tmp_path / "c.csv", {"x": T}, T + 20.0)
    with pytest.raises(UsageError, match="no time in common"):
        compared(a, c)


def test_units_are_converted_where_both_tell_them(tmp_path):
    a = result_folder(tmp_path / "a", {"x": (T, "float", "m"), "p": (T, "float", "bar"), "q": (T, "float", "m")}, T)
    columns = {"x": (1000.0 * T, "float", "mm"), "p": (1e5 * T, "float", "Pa"), "q": (T, "float", "s")}
    b = result_folder(tmp_path / "b", columns, T)
    found, _ = compared(a, b)
    assert not found["x"].differs
    assert not found["p"].differs
    assert found["q"].differs
    assert found["q"].remark


def parameters(**given):
    return {name: {"value": value, "unit": "kg", "from": "FMU"} for name, value in given.items()}


def test_the_command(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result_folder(tmp_path / "a", {"x": (T, "float", "m"), "mine": T}, T, parameters=parameters(m=1.0, k=2.0))
    result_folder(tmp_path / "b", {"x": (T + 1e-8, "float", "m"), "theirs": T}, T, parameters=parameters(m=3.0, k=2.0))
    assert code(main, ["compare", "a", "b"]) == 0
    told = capsys.readouterr().out
    assert "parameter m: 1 kg -> 3 kg" in told
    assert "parameter k" not in told
    assert "only a has 1 signal: mine" in told
    assert "only b has 1 signal: theirs" in told
    assert (tmp_path / "compare.html").exists()
    assert code(main, ["compare", "a", "b", "--tolerance", "1e-10", "--no-html"]) == 1
    assert "different: 1 of 1 signal" in capsys.readouterr().out
    for wrong in (["a"], ["a", "nosuch"], ["a", "b", "--tolerance", "-1"], ["a", "b", "--units", "furlong"]):
        assert code(main, ["compare", *wrong]) == 2
        assert capsys.readouterr().err.count("\n") == 1
    record(tmp_path / "other.csv", {"z": T}, T)
    assert code(main, ["compare", "a", "other.csv"]) == 2
    assert "no signal in common" in capsys.readouterr().err


def test_the_page_has_all_runs(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result_folder(tmp_path / "a", {"x": (T, "float", "m"), "s": (["u"] * 1001, "text", None)}, T)
    result_folder(tmp_path / "b", {"x": (2000.0 * T[::2], "float", "mm"), "y": T[::2]}, T[::2])
    result_folder(tmp_path / "c", {"x": (T, "float", "m"), "s": (["v", *["u"] * 1000], "text", None)}, T)
    assert code(main, ["compare", "a", "b", "c", "--out", "abc.html"]) == 1
    told = content(tmp_path / "abc.html")
    assert [run["name"] for run in told["runs"]] == ["a", "b", "c"]
    places = {s["name"]: s["places"] for s in told["signals"]}
    assert places == {"x": [0, 0, 0], "s": [1, None, 1], "y": [None, 1, None]}
    np.testing.assert_allclose(values(told, "x", 1), 2.0 * T[::2], rtol=1e-7)  # in the first run's unit
    assert len(times(told["runs"][1])) == 501
    items = told["runs"][2]["items"]["s"]
    assert [items[int(k)] for k in values(told, "s", 2)[:2]] == ["v", "u"]
    assert [items[int(k)] for k in values(told, "s", 0)[:2]] == ["u", "u"]
    assert told["chosen"][0] == "x"
    rows = {(r["name"], r["run"]): r for r in told["comparison"]["rows"]}
    assert rows["x", "b"]["difference"] == pytest.approx(10.0)
    assert rows["x", "b"]["at"] == 10.0
    assert not rows["x", "c"]["differs"]


def test_a_page_of_runs_in_a_browser(tmp_path, monkeypatch):
    import shutil

    sync_api = pytest.importorskip("playwright.sync_api", reason="no playwright")
    chromium = shutil.which("chromium") or shutil.which("google-chrome") or pytest.skip("no chromium")
    monkeypatch.chdir(tmp_path)
    result_folder(tmp_path / "a", {"x": (T, "float", "m")}, T, parameters=parameters(m=1.0))
    t = T[::3]
    result_folder(tmp_path / "b", {"x": (2.0 * t, "float", "m"), "y": t}, t, parameters=parameters(m=2.0))
    assert code(main, ["compare", "a", "b"]) == 1
    with sync_api.sync_playwright() as p:
        browser = p.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": 1366, "height": 768})
        messages = []
        page.on("pageerror", lambda e: messages.append(str(e)))
        page.goto((tmp_path / "compare.html").as_uri())
        page.evaluate("page.set_time('at', 6)")
        page.wait_for_timeout(60)
        assert page.locator(".legend td.at").all_inner_texts() == ["6000", "12000"]
        page.evaluate("page.choose('y', true)")
        assert page.locator("#panels canvas").count() == 2
        assert page.locator("#parameters td").all_inner_texts()[:3] == ["m", "1 kg", "2 kg"]
        assert not messages
        browser.close()


def test_signals_farther_apart_than_a_number_can_be():
    a = np.array([1e308, -1e308])
    d = difference("x", "m", np.arange(2.0), a, -a, 1e-6)
    assert d.relative == np.inf
    assert d.first.time == 0.0


def test_a_page_takes_no_other_files_place(tmp_path, capsys):
    a, b = (result_folder(tmp_path / name, {"x": (T, "float", "m")}, T) for name in "ab")
    before = (a / "summary.json").read_bytes()
    assert code(main, ["compare", str(a), str(b), "--out", str(a / "summary.json")]) == 2
    assert "a page is a file.html" in capsys.readouterr().err
    assert (a / "summary.json").read_bytes() == before


def test_a_summary_that_is_none(tmp_path, capsys):
    a, b = (result_folder(tmp_path / name, {"x": (T, "float", "m")}, T) for name in "ab")
    (a / "summary.json").write_text("[" * 100_000)
    assert code(main, ["compare", str(a), str(b), "--no-html"]) == 2
    assert "summary.json: cannot be read" in capsys.readouterr().err


def test_a_column_that_is_there_twice(tmp_path, capsys):
    (tmp_path / "a.csv").write_text("time,x,x\n0,1,2\n1,3,4\n")
    assert code(main, ["compare", str(tmp_path / "a.csv"), str(tmp_path / "a.csv"), "--no-html"]) == 2
    assert "has two columns 'x'" in capsys.readouterr().err
