"""Envelopes of a machine whose answer is a formula: y = D t, wanted to be at most 1 at t = 1, so D t_end <= 1."""

from __future__ import annotations

import json
import zipfile

import pytest
from deepsea_cosim.core.errors import UsageError
from deepsea_cosim.master.parallel.pool import Pool
from deepsea_cosim.study.cli import main
from deepsea_cosim.study.envelope import search
from deepsea_cosim.study.envelope.options import designs, read

from ...commands import code

TEXT = """
stop_time = 1.0
[axis]
parameter = "b.D[1,1]"
unit = "1"
low = 0
high = 10
within = 0.01
[[require]]
metric = "end=final(b.y1)"
at_most = {limit}
[[group]]
name = "ramp"
map = true
[[group.choice]]
name = "slope 1"
parameters = {{ "a.x0[2]" = 1.0 }}
[[group.choice]]
name = "slope 0.5"
parameters = {{ "a.x0[2]" = 0.5 }}
cost = 3
[[group.choice]]
name = "slope 0.25"
parameters = {{ "a.x0[2]" = 0.25 }}
cost = 5
[[group]]
name = "gain"
[[group.choice]]
name = "as it is"
parameters = {{ "a.C[1,1]" = 1.0 }}
[[group.choice]]
name = "half"
parameters = {{ "a.C[1,1]" = 0.5 }}
cost = 3
[[group.choice]]
name = "quarter"
parameters = {{ "a.C[1,1]" = 0.25 }}
cost = 4
"""


@pytest.fixture
def options(tmp_path):
    path = tmp_path / "options.toml"
    path.write_text(TEXT.format(limit=2.0))
    return path


def run(doubled, options, folder, *more):
    arguments = ["--options", str(options), "--out", str(folder), "--quiet", "--processes", "1", *more]
    assert main(["envelope", str(doubled), *arguments]) == 0
    return json.loads((folder / "envelope.json").read_text())


def test_the_edge_is_where_the_formula_says(doubled, options, tmp_path, capsys):
    found = run(doubled, options, tmp_path / "out", "--at", "1.5", "--json")
    told = json.loads(capsys.readouterr().out)
    assert told["envelope"] == found
    assert told["files"] == ["envelope.csv", "envelope.json", "envelope.png"]
    reach = {r["ramp"]: (r["value"], r["whole"]) for r in found["reach"]}
    assert reach["slope 1"][0] == pytest.approx(2.0, abs=0.011)
    assert reach["slope 0.5"][0] == pytest.approx(4.0, abs=0.011)
    assert reach["slope 0.25"][0] == pytest.approx(8.0, abs=0.011)
    assert reach["slope 1"][0] <= 2.0
    assert found["cheapest"] == [{"cost": 0, "changes": []}]
    assert (tmp_path / "out" / "envelope.png").stat().st_size > 5000


def test_the_cheapest_change_is_found_and_its_equals_too(doubled, options, tmp_path):
    assert run(doubled, options, tmp_path / "a", "--at", "3.5", "--no-plots")["cheapest"] == [
        {"cost": 3, "changes": ["gain: half"]}, {"cost": 3, "changes": ["ramp: slope 0.5"]}
    ]  # fmt: skip
    far = run(doubled, options, tmp_path / "b", "--at", "7.5", "--no-plots")["cheapest"]
    assert far == [{"cost": 4, "changes": ["gain: quarter"]}]


def test_what_is_found_before_an_interrupt_is_kept(doubled, options, tmp_path, monkeypatch, capsys):
    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(search, "cheapest", interrupted)
    arguments = ["--options", str(options), "--out", str(tmp_path / "out"), "--quiet", "--processes", "1"]
    assert main(["envelope", str(doubled), *arguments]) == 130
    assert "interrupted; 3 of 3 designs are in" in capsys.readouterr().err
    found = json.loads((tmp_path / "out" / "envelope.json").read_text())
    assert [round(r["value"], 1) for r in found["reach"]] == [2.0, 4.0, 8.0]
    assert found["cheapest"] is None


def test_runs_are_by_the_method_that_the_package_states(doubled, options, tmp_path, monkeypatch):
    stating = tmp_path / "stating.ssp"
    with zipfile.ZipFile(doubled) as old, zipfile.ZipFile(stating, "w") as new:
        for name in old.namelist():
            content = old.read(name)
            new.writestr(name, content.replace(b'stepSize="0.01"/>', b'stepSize="0.01" method="jacobi"/>'))
    each, asked = Pool.each_surviving, []

    def told(pool, work, tasks):
        asked.extend(getattr(t, "method", None) or t.settings.method for t in tasks)
        return each(pool, work, tasks)

    monkeypatch.setattr(Pool, "each_surviving", told)
    for package, method in ((doubled, "gauss-seidel"), (stating, "jacobi")):
        asked.clear()
        assert run(package, options, tmp_path / method, "--at", "1.5", "--no-plots")["method"] == method
        assert len(asked) > 3
        assert set(asked) == {method}
    assert search.settings(read(options), "jacobi").method == "jacobi"


def test_what_never_or_always_holds(doubled, options, tmp_path, capsys):
    options.write_text(TEXT.format(limit=-1.0))
    found = run(doubled, options, tmp_path / "never", "--no-plots")
    assert all(r["value"] is None for r in found["reach"])
    assert found["cheapest"] == []
    options.write_text(TEXT.format(limit=1e6))
    assert all(r["whole"] for r in run(doubled, options, tmp_path / "always", "--no-plots")["reach"])
    arguments = ["--options", str(options), "--out", str(tmp_path / "c"), "--no-plots", "--processes", "1"]
    assert main(["envelope", str(doubled), *arguments]) == 0
    told = capsys.readouterr().out
    assert "10 and more" in told
    assert "without a change" in told


def test_what_never_comes_in_any_design_is_told_before_the_search(doubled, options, tmp_path, capsys):
    """The slowest design gets to 0.25: one that arrives is enough, none is a mistake."""
    line = ["--options", str(options), "--out", str(tmp_path / "out"), "--no-plots", "--processes", "1"]
    for target, end in ((0.75, 0), (200.0, 2)):
        options.write_text(TEXT.format(limit=2.0).replace("end=final(b.y1)", f"end=reaches(a.y1, {target}, 0.01)"))
        assert main(["envelope", str(doubled), *line]) == end
        told = capsys.readouterr()
        assert ("not even 0 (end: never)" in told.out) == (end == 0)
    assert "reaches(a.y1, 200, 0.01) has no number in any design at 0" in told.err


def test_what_is_shipped_reads_and_its_first_design_is_the_machine(built):
    from deepsea_cosim.master.simulation.session import Session

    shipped = read()
    first = designs(shipped.groups)[0]
    assert first.cost == 0
    assert first.changes == ()
    with Session(built / "deepsea_11km.ssp") as session:
        values = session.values()
    assert {name: values[name] for name in first.parameters} == pytest.approx(first.parameters)


@pytest.mark.parametrize(
    ("change", "word"),
    [(("low = 0", "low = 20"), "fit together"), (("within = 0.01", "within = 1e-300"), "fit together"),
     (("within = 0.01", "wthin = 0.01"), "did you mean"),
     (("at_most = 2.0", ""), "at_least or at_most"), (("end=final(b.y1)", "end of b"), "expected"),
     (('name = "gain"', 'name = "ramp"'), "same name"), (("cost = 3", 'cost = "much"'), "number"),
     (('name = "slope 1"', 'name = "slope 1"\ncost = 1'), "costs nothing")],
)  # fmt: skip
def test_wrong_options_are_one_line(options, change, word):
    options.write_text(options.read_text().replace(*change, 1))
    with pytest.raises(UsageError, match=word) as error:
        read(options)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("arguments", [["--at", "99"], ["--options", "missing.toml"], ["--set", "nonsense"],
                                       ["--processes", "0"], ["--set", "b.q=1"]])  # fmt: skip
def test_bad_arguments_are_one_line(doubled, options, tmp_path, capsys, arguments):
    call = ["envelope", str(doubled), "--options", str(options), "--out", str(tmp_path / "o"), *arguments]
    assert code(main, call) == 2
    assert len(capsys.readouterr().err.strip().splitlines()) == 1


def test_the_map_is_of_the_machine_that_the_changes_start_from(doubled, tmp_path):
    """Choices of groups that are not mapped count as they are, whatever the package has."""
    path = tmp_path / "o.toml"
    path.write_text(TEXT.format(limit=2.0).replace('"a.C[1,1]" = 1.0', '"a.C[1,1]" = 0.8'))
    found = run(doubled, path, tmp_path / "out", "--at", "2.4", "--no-plots")
    assert found["reach"][0]["value"] == pytest.approx(2.5, abs=0.011)
    assert found["cheapest"] == [{"cost": 0, "changes": []}]


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ('"a.C[1,1]" = 0.25', '"a.x0[2]" = 0.25', "both set"),
        ('name = "quarter"', 'name = "half"', "two choices have the same name"),
    ],
)
def test_options_that_contradict_themselves(doubled, tmp_path, capsys, old, new, told):
    path = tmp_path / "o.toml"
    path.write_text(TEXT.format(limit=2.0).replace(old, new))
    assert main(["envelope", str(doubled), "--options", str(path), "--out", str(tmp_path / "out"), "--no-plots"]) == 2
    assert told in capsys.readouterr().err


def test_decimals_are_those_of_the_bisection(doubled, options, tmp_path, capsys):
    assert main(["envelope", str(doubled), "--options", str(options), "--out", str(tmp_path), "--no-plots"]) == 0
    told = capsys.readouterr().out
    assert "slope 1     2.00" in told or "slope 1     1.99" in told



def test_a_hole_below_the_edge_is_told(options, monkeypatch):
    """What holds up to 8, but not from 3 to 5."""
    monkeypatch.setattr(search, "measure", lambda package, task: {"values": {
        "end": 1.0 if task.case["b.D[1,1]"] <= 8.0 and not 3.0 < task.case["b.D[1,1]"] < 5.0 else 9.0}})  # fmt: skip
    found = search.reach("p.ssp", search.Question(read(options), {}))
    assert found.value == pytest.approx(8.0, abs=0.01)
    assert 3.0 < found.hole < 5.0


def test_a_design_that_cannot_be_run_does_not_hide_the_others(doubled, tmp_path, capsys):
    path = tmp_path / "o.toml"
    text = TEXT.format(limit=2.0).replace('{ "a.x0[2]" = 1.0 }', '{ "a.x0[2]" = 1.0, "b.trouble" = 0 }')
    path.write_text(text.replace('{ "a.x0[2]" = 0.5 }', '{ "a.x0[2]" = 0.5, "b.trouble" = 1 }'))
    call = ["envelope", str(doubled), "--options", str(path), "--out", str(tmp_path / "o"), "--no-plots"]
    assert main(call) == 0
    assert "cannot be run at 0: component 'b'" in capsys.readouterr().out
    found = json.loads((tmp_path / "o" / "envelope.json").read_text())["reach"]
    assert [r["why"] is None for r in found] == [True, False, True]


def test_an_axis_of_whole_numbers_is_refused(doubled, options, tmp_path, capsys):
    options.write_text(options.read_text().replace("b.D[1,1]", "b.integer_in"))
    assert code(main, ["envelope", str(doubled), "--options", str(options), "--out", str(tmp_path / "o")]) == 2
    assert "integer_in" in capsys.readouterr().err


def test_one_label_for_two_metrics_is_refused(options):
    options.write_text(options.read_text().replace(
        "[[group]]", '[[require]]\nmetric = "end=final(a.y1)"\nat_most = 100\n[[group]]', 1))  # fmt: skip
    with pytest.raises(UsageError, match="two metrics have the label 'end'"):
        read(options)


def test_bounds_that_nothing_meets_are_refused(options):
    options.write_text(options.read_text().replace("at_most", "at_least = 5\nat_most"))
    with pytest.raises(UsageError, match="at least 5 and at most 2"):
        read(options)


@pytest.mark.parametrize("trouble", [1.0, 3.0])
def test_runs_that_fail_or_crash_beyond_the_edge_are_told(doubled, options, tmp_path, capsys, trouble):
    """The FMU of one design fails, or takes its process with it; the others are found all the same."""
    text = options.read_text().replace('"a.x0[2]" = 0.25', f'"a.x0[2]" = 0.25, "b.trouble" = {trouble}, "b.when" = 0.5')
    options.write_text(text)
    assert code(main, ["envelope", str(doubled), "--options", str(options), "--out", str(tmp_path / "o"), "--at", "1",
                       "--no-plots", "--processes", "1"]) == 0  # fmt: skip
    found = {r["ramp"]: r for r in json.loads((tmp_path / "o" / "envelope.json").read_text())["reach"]}
    assert found["slope 1"]["value"] == pytest.approx(2.0, abs=0.01)
    assert found["slope 0.5"]["value"] == pytest.approx(4.0, abs=0.01)
    assert found["slope 0.25"]["value"] is None
    assert found["slope 0.25"]["why"]


def test_another_package_is_told_that_it_needs_options_of_its_own(doubled, capsys):
    assert main(["envelope", str(doubled)]) == 2
    assert "options.toml: no connector 'arm.x_h'; these are the deep-sea machine's options" in capsys.readouterr().err
