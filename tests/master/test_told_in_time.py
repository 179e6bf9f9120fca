"""What is wrong is told before anything is loaded where it can be, and otherwise with component, variable and time."""

from __future__ import annotations

import zipfile

import pytest
from deepsea_cosim.master.cli import main
from deepsea_cosim.master.simulation.run import Options, run

from benchmarks import native

from ..packages import component, connector, link, package, system, unit
from .parts import constant, gain, last, redescribed, two, with_fmu

pytestmark = pytest.mark.skipif(native.compiler is None, reason="there is no C compiler here")


def told(path, tmp_path, capsys, *arguments):
    """What the command says of the package, and its exit code."""
    code = main([str(path), "--out", str(tmp_path / "out"), "--no-plot", "--quiet", *arguments])
    return code, capsys.readouterr().err


def ring(tmp_path, fmu):
    parts = gain("a", 1.0), gain("b", 0.5)
    links = link("a.y1", "b.u1"), link("b.y1", "a.u1")
    return package(tmp_path / "p.ssp", system("root", *parts, links=links), {"resources/L.fmu": fmu})


def once(tmp_path, fmus):
    able = 'canGetAndSetFMUstate="true"'
    fmu = redescribed(fmus[2], tmp_path / "L.fmu", (able, f'{able} canBeInstantiatedOnlyOncePerProcess="true"'))
    return package(tmp_path / "p.ssp", system("root", gain("a", 1.0), gain("b", 2.0)), {"resources/L.fmu": fmu})


def bond(tmp_path, fmus):
    path = two(tmp_path / "first.ssp", fmus[2])
    with zipfile.ZipFile(path) as old, zipfile.ZipFile(tmp_path / "p.ssp", "w") as new:
        for name in old.namelist():
            content = old.read(name)
            named = b'stepSize="0.01"><Bond a="a.y9" b="b.y1"/></Master>'
            new.writestr(name, content.replace(b'stepSize="0.01"/>', named))
    return tmp_path / "p.ssp"


def circle(tmp_path, fmus):
    calculated = redescribed(
        fmus[2], tmp_path / "L.fmu",
        ('name="y2" valueReference="11" causality="output" variability="continuous"',
         'name="y2" valueReference="11" causality="calculatedParameter" variability="fixed"'),
    )  # fmt: skip
    parts = [
        component(name, "resources/L.fmu", connector("y2", "calculatedParameter"), connector("D[1,1]", "parameter"))
        for name in ("a", "b")
    ]
    links = link("a.y2", "b.D[1,1]"), link("b.y2", "a.D[1,1]")
    return package(tmp_path / "p.ssp", system("root", *parts, links=links), {"resources/L.fmu": calculated})


EARLY = {
    "the same FMU twice": (once, (), "can be instantiated only once per process"),
    "a bond of nothing": (bond, (), "the power bond names 'a.y9', which drives nothing"),
    "parameters in a circle": (circle, (), "calculated parameters depend on each other: a -> b -> a"),
    "no way back": (lambda p, f: ring(p, f[1]), ("--method", "fixed-point"), "component 'a' cannot restore its state"),
    "no way back to another process": (
        lambda p, f: ring(p, f[2]), ("--method", "interface-jacobian", "--isolate"), "cannot be taken back"),
    "a limit for nobody": (lambda p, f: ring(p, f[2]), ("--step-timeout", "1"), "--step-timeout needs --isolate"),
    "a format of others": (lambda p, f: ring(p, f[2]), ("--results", "x.xlsx"), "results can be written as"),
}  # fmt: skip


@pytest.mark.parametrize("case", EARLY)
def test_the_check_finds_what_a_run_would(fmus, tmp_path, capsys, case):
    make, arguments, expected = EARLY[case]
    path = make(tmp_path, fmus)
    for more in (("--check",), ()):
        code, error = told(path, tmp_path, capsys, *arguments, *more)
        assert code == 2
        assert expected in error
    assert not (tmp_path / "out").exists()


def test_a_start_value_beyond_its_own_limits_is_told(fmus, tmp_path, capsys):
    odd = redescribed(fmus[2], tmp_path / "L.fmu", ('<Real start="1e300"', '<Real start="1e300" max="1"'))
    path = package(tmp_path / "p.ssp", system("root", component("a", "resources/L.fmu")), {"resources/L.fmu": odd})
    assert main([str(path), "--check"]) == 0
    assert "a.when = 1e+300 is out of range; allowed: -inf to 1" in capsys.readouterr().out


def test_an_error_in_a_run_names_variable_and_time(tmp_path, capsys):
    """An FMU that takes no input above 0.35, and one that gives no output above it."""
    source = (native.HERE / "fmus" / "linear.c").read_text()
    for old, new, doing in (
        ("        *p = v[k];\n", "        if (r[k] == 0 && v[k] > 0.35) return 3;\n", "setting the inputs (u1,"),
        ("        v[k] = *p;\n", "        if (r[k] == 10 && *p > 0.35) return 3;\n", "reading the outputs (y1,"),
    ):
        assert source.count(old) == 1
        (tmp_path / "odd.c").write_text(source.replace(old, new + old))
        fmu = native.packed(tmp_path / "odd.fmu", 2, native.compiled(tmp_path / "odd.c", 2, tmp_path / "Linear.so"))
        code, error = told(two(tmp_path / "p.ssp", fmu, step=0.1), tmp_path, capsys)
        assert code == 1
        assert doing in error
        assert " at t = 0." in error


@pytest.mark.parametrize("isolate", [False, True])
@pytest.mark.parametrize("status", [-1, 9])
def test_a_status_that_is_none_ends_the_run(tmp_path, capsys, status, isolate):
    source = (native.HERE / "fmus" / "linear.c").read_text()
    (tmp_path / "odd.c").write_text(source.replace("case 1: return 3;", f"case 1: return {status};"))
    fmu = native.packed(tmp_path / "odd.fmu", 2, native.compiled(tmp_path / "odd.c", 2, tmp_path / "Linear.so"))
    path = two(tmp_path / "p.ssp", fmu, 1.0, 0.5)
    code, error = told(path, tmp_path, capsys, *(["--isolate"] if isolate else []))
    assert code == 1
    assert f"component 'b', doStep at t = 0.5 s: the FMU returned {status}, which is no status of FMI" in error


def test_systems_inside_each_other_without_end_are_refused(fmus, tmp_path, capsys):
    inner = gain("a", 1.0)
    for k in range(1000):
        inner = system(f"s{k}", inner)
    code, error = told(package(tmp_path / "p.ssp", system("root", inner), with_fmu(fmus)), tmp_path, capsys, "--check")
    assert code == 2
    assert "nested more than 32 levels deep" in error


def test_many_driven_inputs_need_no_links(fmus, tmp_path):
    """The places that a step needs are counted for them, too."""
    names = [f"p{k}" for k in range(20)]
    parts = [component(n, "resources/L.fmu") for n in names]
    path = package(tmp_path / "p.ssp", system("root", *parts), with_fmu(fmus))
    columns = [f"{n}.u{k}" for n in names for k in range(1, 7)]
    (tmp_path / "s.csv").write_text(f"time,{','.join(columns)}\n0{',0' * len(columns)}\n1{',1' * len(columns)}\n")
    for method in ("jacobi", "nepce"):
        assert last(tmp_path, path, "p7.u3", method=method, stimuli=tmp_path / "s.csv") == pytest.approx(1.0, abs=0.1)


def test_an_output_in_another_unit_than_the_fmus_is_told(tmp_path):
    """3 of the output are 3 kN for the package, so 3000 N arrive; and the record says kN."""
    fmu = native.linear(tmp_path, 2, through=False, units={"u1": "N", "y1": "N"})
    kilo = f"<ssd:Units>{unit('kN', kg=1, m=1, s=-2, factor=1000)}</ssd:Units>"
    root = system("root", constant("c", 3.0, unit_out="kN"), gain("b", 1.0), links=(link("c.y1", "b.u1"),))
    result = run(package(tmp_path / "p.ssp", root, {"resources/L.fmu": fmu}, after=kilo), tmp_path / "out", Options())
    assert result.frame()["b.u1"].iloc[-1] == 3000.0
    assert result.units["c.y1"] == "kN"
    assert "the package says 'c.y1' is in kN, its FMU says N; the package's word counts" in result.summary["warnings"]


@pytest.mark.parametrize(
    ("table", "expected"),
    [
        ("time,a.item_in\n0,red\n0.5,green\n", 2),
        ("time,a.item_in\n0,1\n\n0.5,77\n", "line 4, column 'a.item_in': 77 is not a value of type Enumeration"),
        ("time,a.item_in\n0,purple\n", "'purple' is not a number; known: red, green, blue"),
        ("time,a.integer_in\n\n\n0,1\n0.5,x\n", "line 5, column 'a.integer_in': 'x' is not a number"),
    ],
)
def test_a_table_has_items_and_lines(fmus, tmp_path, capsys, table, expected):
    whole = component("a", "resources/L.fmu", connector("item_in", "input", "Enumeration", enumeration="Colour"),
                      connector("integer_in", "input", "Integer"))  # fmt: skip
    path = package(tmp_path / "p.ssp", system("root", whole), with_fmu(fmus))
    (tmp_path / "s.csv").write_text(table)
    if isinstance(expected, int):
        assert last(tmp_path, path, "a.item_in", stimuli=tmp_path / "s.csv") == expected
        return
    code, error = told(path, tmp_path, capsys, "--stimuli", str(tmp_path / "s.csv"))
    assert code == 2
    assert expected in error


def test_what_is_no_item_is_refused(fmus, tmp_path, capsys):
    path = package(tmp_path / "p.ssp", system("root", component("a", "resources/L.fmu")), with_fmu(fmus))
    code, error = told(path, tmp_path, capsys, "--set", "a.item_in=77")
    assert code == 2
    assert "a.item_in = 77 is none of its items; known: red, green, blue" in error
