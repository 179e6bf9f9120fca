"""`--check` looks at what the run is told too, and says where in the package a fault is."""

from __future__ import annotations

import json
import zipfile

import pytest
from deepsea_cosim.core.errors import CosimError
from deepsea_cosim.master.cli import main
from deepsea_cosim.master.simulation.check import check
from deepsea_cosim.master.simulation.run import Options, run

from benchmarks import native

from ..packages import binding, bindings, component, connector, description, link, pack, package, system, values
from .parts import gain, redescribed, two, with_fmu, with_input

pytestmark = pytest.mark.skipif(native.compiler is None, reason="there is no C compiler here")


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        ([], ""),
        (["--set", "b.trouble=1", "--step", "0.5"], ""),
        (["--set", "b.truoble=1"], "component 'b' has no parameter 'truoble'"),
        (["--step", "-3"], "step -3 s: it has to be positive"),
        (["--stop-time", "inf"], "stop time inf: it has to be a number of seconds"),
        (["--stimuli", "nope.csv"], "nope.csv: cannot be read"),
    ],
)
def test_options_are_checked_with_the_package(fmus, tmp_path, capsys, arguments, told):
    path = two(tmp_path / "p.ssp", fmus[2])
    assert main([str(path), "--check", "--quiet", *arguments]) == (2 if told else 0)
    said = capsys.readouterr()
    assert said.out == ""
    assert told in said.err
    assert bool(told) == bool(said.err)


def test_the_table_at_the_end_shows_what_the_system_gives(fmus, tmp_path, capsys):
    root = system("root", gain("a", 3.0), made=(connector("in", "input"), connector("out", "output")),
                  links=(link("in", "a.u1"), link("a.y1", "out")))  # fmt: skip
    path = package(tmp_path / "p.ssp", root, with_fmu(fmus))
    assert main([str(path), "--set", "in=2", "--no-plot", "--out", str(tmp_path / "out")]) == 0
    assert ["out", "6", "6", "6", "6"] in [line.split() for line in capsys.readouterr().out.splitlines()]


def test_an_internal_negated_alias_of_fmi_1_is_no_fault(tmp_path):
    alias = '<ScalarVariable name="minus" valueReference="500" causality="internal" variability="discrete" ' + (
        'alias="negatedAlias"><Integer start="3"/></ScalarVariable></ModelVariables>'
    )
    fmu = redescribed(native.linear(tmp_path / "f", 1), tmp_path / "L.fmu", ("</ModelVariables>", alias))
    path = package(tmp_path / "p.ssp", system("root", gain("a", 3.0)), {"resources/L.fmu": fmu})
    assert not check(path).errors


def test_the_packages_own_times_are_checked(fmus, tmp_path, capsys):
    assert main([str(two(tmp_path / "p.ssp", fmus[2], stop=-3)), "--check"]) == 2
    assert "stop time -3 s" in capsys.readouterr().err


def test_a_table_drives_what_it_names(fmus, tmp_path, capsys):
    path = package(tmp_path / "p.ssp", with_input(), with_fmu(fmus))
    (tmp_path / "s.csv").write_text("time,in,a.u2\n0,1,0\n")
    assert main([str(path), "--check", "--stimuli", str(tmp_path / "s.csv")]) == 0
    told = capsys.readouterr().out
    assert "driven by nothing and keep their start values: 'a.u3', 'a.u4'" in told
    assert "'a.u2'" not in told
    assert "is given nothing" not in told


@pytest.mark.parametrize(("given", "told"), [((), True), (("--set", "in=2"), False)])
def test_an_input_of_the_system_that_nothing_drives_is_told(fmus, tmp_path, capsys, given, told):
    path = package(tmp_path / "p.ssp", with_input(), with_fmu(fmus))
    assert main([str(path), "--check", *given]) == 0
    assert ("the system's input 'in' is given nothing" in capsys.readouterr().out) == told


SET = """<?xml version="1.0"?>
<ssv:ParameterSet xmlns:ssv="http://ssp-standard.org/SSP1/SystemStructureParameterValues" version="1.0" name="mine">
  <ssv:Parameters>%s</ssv:Parameters>
</ssv:ParameterSet>
"""


def parameters(path, **values):
    made = (f'<ssv:Parameter name="{n}"><ssv:Real value="{v}"/></ssv:Parameter>' for n, v in values.items())
    path.write_text(SET % "".join(made))
    return path


def test_a_parameter_set_wins_over_the_packages_and_gives_way_to_set(fmus, tmp_path):
    """y = 3 in, as the package says; 5 in with the set, 7 in with --set."""
    path = package(tmp_path / "p.ssp", with_input(), with_fmu(fmus))
    mine = parameters(tmp_path / "mine.ssv", **{"a.D[1,1]": 5.0, "in": 2.0})

    def end(**options):
        result = run(path, tmp_path / "out", Options(parameters=(mine,), **options))
        return result.frame()["a.y1"].iloc[-1]

    assert end() == 10.0
    assert end(changes=(("a.D[1,1]", "7"),)) == 14.0
    manifest = json.loads((tmp_path / "out" / "manifest.json").read_text())
    assert str(mine) in manifest["sha256"]
    assert f"--parameters {mine}" in manifest["command"]


@pytest.mark.parametrize("check", [[], ["--check"]])
def test_a_bad_parameter_set_is_one_line(fmus, tmp_path, capsys, check):
    path = package(tmp_path / "p.ssp", with_input(), with_fmu(fmus))
    line = [str(path), "--out", str(tmp_path / "out"), *check, "--parameters"]
    assert main([*line, str(parameters(tmp_path / "b.ssv", **{"b.D": 1.0}))]) == 2
    assert "b.ssv, line 3: 'b.D' names no component of the package" in capsys.readouterr().err
    assert main([*line, str(tmp_path / "none.ssv")]) == 2
    assert "none.ssv: no such file" in capsys.readouterr().err
    (tmp_path / "x.ssv").write_text("<a/>")
    assert main([*line, str(tmp_path / "x.ssv")]) == 2
    assert "x.ssv, line 1: <a> is not a ParameterSet" in capsys.readouterr().err


@pytest.mark.parametrize("content", [b"no zip", b""])
def test_a_broken_fmu_is_told_with_its_place(tmp_path, content):
    path = package(tmp_path / "p.ssp", with_input(), {"resources/L.fmu": content})
    with pytest.raises(CosimError, match=r"SystemStructure\.ssd, line \d+: component 'a': L\.fmu: not a zip archive"):
        run(path, tmp_path / "out", Options())


def test_an_fmu_that_names_no_times_needs_them(fmus, tmp_path, capsys):
    assert main([str(fmus[2]), "--out", str(tmp_path / "out")]) == 2
    assert "give one with --stop-time" in capsys.readouterr().err


def test_a_package_without_the_usual_description_names_the_others(tmp_path, capsys):
    empty = pack(tmp_path / "e.ssp", {"Other.ssd": description(with_input())})
    assert main([str(empty), "--out", str(tmp_path / "out")]) == 2
    assert "it has Other.ssd: choose with --variant" in capsys.readouterr().err


def test_a_picture_of_nothing_is_refused_before_the_run(fmus, tmp_path, capsys):
    path = two(tmp_path / "p.ssp", fmus[2])
    assert main([str(path), "--out", str(tmp_path / "out"), "--plot", "c.*"]) == 2
    assert "--plot 'c.*' matches nothing" in capsys.readouterr().err
    assert not (tmp_path / "out" / "results.csv").exists()


def test_a_package_packed_with_its_folder_is_told(tmp_path, capsys):
    path = pack(tmp_path / "p.ssp", {"machine/SystemStructure.ssd": "<x/>"})
    assert main([str(path), "--check"]) != 0
    found = capsys.readouterr()
    assert "one is in 'machine/'; pack what is inside that folder" in found.out + found.err


def test_sizes_that_are_set_count(fmus, tmp_path):
    """Structural parameters of --set decide whether arrays fit, in --check as in a run."""
    a, b = (component(n, "resources/L.fmu", connector("many_in", "input", "Float64"),
                      connector("many_out", "output", "Float64")) for n in "ab")  # fmt: skip
    root = system("root", a, b, links=(link("a.many_out", "b.many_in"),))
    path = package(tmp_path / "p.ssp", root, {"resources/L.fmu": fmus[3]}, version="2.0")
    assert not check(path).errors
    one = check(path, Options(changes=(("a.size", "3"),))).errors
    assert one
    assert "'a.many_out' has 3 values and 'b.many_in' 2" in one[0]
    assert not check(path, Options(changes=(("a.size", "3"), ("b.size", "3")))).errors


def test_a_variant_by_name_does_not_ask_for_the_others(fmus, tmp_path):
    named = [description(system("root", gain("a", 1.0))).replace('name="test"', 'name="V"') for _ in range(2)]
    files = {"resources/L.fmu": fmus[2], "Good.ssd": named[0], "Bad.ssd": "<no"}
    path = package(tmp_path / "p.ssp", system("root", gain("a", 1.0)), files)
    assert not check(path, Options(variant="V")).errors
    path = package(tmp_path / "q.ssp", system("root", gain("a", 1.0)), {**files, "Bad.ssd": named[1]})
    assert "Bad.ssd, Good.ssd are all named 'V'" in check(path, Options(variant="V")).errors[0]


def test_the_tree_shows_what_is_set_and_what_lies_on_the_way(fmus, tmp_path, capsys):
    shift = '<ssc:LinearTransformation factor="2" offset="-1"/>'
    made = (connector("k", "parameter"), connector("in", "input", "Real", "mm"))
    links = link("k", "a.D[1,1]"), link("in", "a.u1", shift)
    a = component("a", "resources/L.fmu", connector("u1", "input"), connector("D[1,1]", "parameter"),
                  bindings=bindings(binding(values({"x0[1]": 5.0}), prefix="")))  # fmt: skip
    path = package(tmp_path / "p.ssp", system("root", a, made=made, links=links), {"resources/L.fmu": fmus[2]})
    assert main([str(path), "--info"]) == 0
    shown = capsys.readouterr().out
    assert "inputs: in [mm]" in shown
    assert "sets: x0[1] = 5" in shown
    assert "k -> a.D[1,1]" in shown
    assert "in -> a.u1  (2 x - 1)" in shown


def test_several_faults_are_told_at_once_and_nothing_that_follows_from_them(fmus, tmp_path):
    """Each in a line of its own: missing files, a wrong kind, a wrong factor, two dangling ends, a type."""
    wrong = (
        component("b", "resources/M.fmu", connector("y1", "output")),
        component("c", "resources/L.fmu", connector("u1", "inptu")),
        system("s", component("d", "resources/N.fmu")),
    )
    links = (
        link("a.y1", "b.u1"),
        link("c.y1", "a.u1"),
        link("a.y1", "e.u1"),
        link("a.y1", "a.u2", '<ssc:LinearTransformation factor="x"/>'),
        link("a.y9", "a.u3"),
        link("a.string_out", "a.u4"),
    )
    bound = bindings(binding(values({"b.k": 1.0, "c.k": 1.0})), binding(source="resources/p.ssv"))
    root = system("root", gain("a", 1.0), *wrong, links=links, bindings=bound)
    text = description(root).replace("<ssd:", "\n<ssd:")
    found = check(pack(tmp_path / "p.ssp", {"SystemStructure.ssd": text, **with_fmu(fmus)}))
    told = "\n".join(found.errors)
    for message in (
        "'resources/p.ssv' is missing in the package",
        "component 'b' needs 'resources/M.fmu', which is missing in the package",
        "connector 'u1': kind 'inptu' is not supported",
        "component 'd' needs 'resources/N.fmu', which is missing in the package",
        "there is no component 'e'",
        'factor="x" is not a number',
        "component 'a' has no variable 'y9'",
        "'a.string_out' is String, 'a.u4' is Real: these types do not fit together",
    ):
        assert told.count(message) == 1, told
    assert len(found.errors) == 8
    assert not found.warnings
    assert all("SystemStructure.ssd, line " in error for error in found.errors)
    with pytest.raises(CosimError, match="which is missing in the package"):
        run(tmp_path / "p.ssp", tmp_path / "out")


def test_fmus_of_another_platform_are_looked_at_all_the_same(fmus, tmp_path):
    """Two components of an FMU without a library for this platform, and a string that drives a real."""
    with zipfile.ZipFile(fmus[2]) as old, zipfile.ZipFile(tmp_path / "W.fmu", "w") as new:
        new.writestr("modelDescription.xml", old.read("modelDescription.xml"))
        new.writestr("binaries/vax11/Linear.so", b"")
    root = system("root", gain("a", 1.0), gain("b", 1.0), links=(link("a.string_out", "b.u1"),))
    path = package(tmp_path / "p.ssp", root, {"resources/L.fmu": tmp_path / "W.fmu"})
    told = "\n".join(check(path).errors)
    assert told.count("has no library for this platform") == 1
    assert "it has vax11" in told
    assert "'a.string_out' is String, 'b.u1' is Real: these types do not fit together" in told
    with pytest.raises(CosimError, match="has no library for this platform"):
        run(path, tmp_path / "out")


def test_what_an_incomplete_system_lacks_is_told_with_its_tree(fmus, tmp_path, capsys):
    root = system("root", gain("a", 1.0), links=(link("a.y1", "b.u1"),))
    path = package(tmp_path / "p.ssp", root, with_fmu(fmus))
    assert main([str(path), "--info"]) == 2
    said = capsys.readouterr()
    assert "a: L.fmu (FMI 2.0;" in said.out
    assert "there is no component 'b'" in said.err


def test_a_limit_that_is_no_number_does_not_end_the_check(fmus, tmp_path):
    """The run never asks for it, so it is a warning; what else is wrong is told too."""
    limit = ('name="B[6,3]" valueReference="252" causality="parameter" variability="fixed"><Real start="0"',
             'name="B[6,3]" valueReference="252" causality="parameter" variability="fixed"><Real min="x" start="0"')
    fmu = {"resources/L.fmu": redescribed(fmus[2], tmp_path / "L.fmu", limit)}
    found = check(package(tmp_path / "p.ssp", system("root", gain("a", 1.0)), fmu))
    assert not found.errors
    assert any("min=\"x\" of 'B[6,3]' is not a number" in told for told in found.warnings)
    run(tmp_path / "p.ssp", tmp_path / "out")
    root = system("root", gain("a", 1.0), links=(link("a.nothing", "a.u1"),))
    assert any("nothing" in told for told in check(package(tmp_path / "q.ssp", root, fmu)).errors)


def test_a_table_cannot_drive_a_connected_input_by_another_name(fmus, tmp_path):
    alias = ('name="u2" valueReference="1"', 'name="u2" valueReference="0"')
    fmu = {"resources/L.fmu": redescribed(fmus[2], tmp_path / "L.fmu", alias)}
    root = system("root", gain("a", 1.0), gain("b", 1.0), links=(link("a.y1", "b.u1"),))
    (tmp_path / "in.csv").write_text("time,b.u2\n0,50\n1,50\n")
    with pytest.raises(CosimError, match=r"column 'b\.u2' is connected and cannot be driven"):
        run(package(tmp_path / "p.ssp", root, fmu), tmp_path / "out", Options(stimuli=tmp_path / "in.csv"))
