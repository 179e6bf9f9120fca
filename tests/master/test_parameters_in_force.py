"""What every parameter is set to, and what gave it that value: in summary.json and by --info --parameters."""

from __future__ import annotations

import json

import pytest
from deepsea_cosim.master.cli import main
from deepsea_cosim.master.system.parameters import ParameterInForce

from benchmarks import native

from ..packages import (
    binding,
    bindings,
    component,
    connector,
    entry,
    link,
    mapping_file,
    package,
    parameter,
    parameter_set,
    system,
    values,
)
from .parts import redescribed, with_fmu

pytestmark = pytest.mark.skipif(native.compiler is None, reason="there is no C compiler here")

HALF = '<ssc:LinearTransformation factor="0.5" offset="1"/>'


def command(tmp_path, path, *arguments):
    """The parameters in the summary of a run."""
    code = main([str(path), "--out", str(tmp_path / "out"), "--no-plot", "--quiet", *arguments])
    assert code == 0
    return json.loads((tmp_path / "out" / "summary.json").read_text())


def all_sources(tmp_path, fmu):
    """D[1,1] by a mapping, D[1,2] inline, D[1,3] by an .ssv, D[1,4] and D[1,5] too, which the user changes."""
    mapping = '<ssd:ParameterMapping source="m.ssm"/>'
    bound = bindings(
        binding(values({"D[1,2]": 12.0, "D[1,4]": 14.0, "D[1,5]": 15.0})),
        binding(source="p.ssv"),
        binding(mapping=mapping, source="q.ssv"),
    )
    a = component("a", "resources/L.fmu", connector("y1", "output"), connector("D[1,2]", "parameter", unit="mm"),
                  bindings=bound)  # fmt: skip
    (tmp_path / "user.ssv").write_text(values({"a.D[1,4]": 44.0}))
    files = {
        "resources/L.fmu": fmu, "p.ssv": values({"D[1,3]": 13.0}), "q.ssv": values({"gain": 20.0}),
        "m.ssm": mapping_file(entry("gain", "D[1,1]", HALF)),
    }  # fmt: skip
    return package(tmp_path / "p.ssp", system("root", a), files)


@pytest.mark.parametrize("version", [1, 2, 3])
@pytest.mark.parametrize("isolate", [(), ("--isolate",)])
def test_the_summary_tells_value_unit_and_source(fmus, tmp_path, version, isolate):
    path = all_sources(tmp_path, fmus[version])
    given = "--parameters", str(tmp_path / "user.ssv"), "--set", "a.D[1,5]=55", "--set", "a.u1=3"
    told = command(tmp_path, path, *given, *isolate)["parameters"]
    seen = {name: (told[f"a.{name}"]["value"], told[f"a.{name}"]["unit"], told[f"a.{name}"]["from"])
            for name in ("D[1,1]", "D[1,2]", "D[1,3]", "D[1,4]", "D[1,5]", "D[1,6]", "u1")}  # fmt: skip
    assert seen == {
        "D[1,1]": (11.0, None, "mapping"), "D[1,2]": (12.0, "mm", "package"), "D[1,3]": (13.0, None, "package"),
        "D[1,4]": (44.0, None, "command line"), "D[1,5]": (55.0, None, "command line"), "D[1,6]": (0.0, None, "FMU"),
        "u1": (3.0, None, "command line"),
    }  # fmt: skip
    where = {name: told[f"a.{name}"]["where"] for name in seen}
    assert where["D[1,6]"] is None
    assert where["D[1,2]"].startswith("SystemStructure.ssd")
    assert where["D[1,3]"].startswith("p.ssv")
    assert where["D[1,1]"].startswith("q.ssv")
    assert "m.ssm" in where["D[1,1]"]
    assert where["D[1,4]"].startswith("user.ssv")
    assert where["D[1,5]"] == "--set a.D[1,5]=55"
    assert not any(name.startswith("a.y") for name in told)


def test_a_connection_brings_its_value_and_wins(fmus, tmp_path):
    """y2 of a, made a calculated parameter, is 7; b's binding and the user's change do not count."""
    calculated = redescribed(
        fmus[2], tmp_path / "L.fmu",
        ('name="y2" valueReference="11" causality="output" variability="continuous"',
         'name="y2" valueReference="11" causality="calculatedParameter" variability="fixed"'),
    )  # fmt: skip
    a = component("a", "resources/L.fmu", connector("y2", "calculatedParameter"),
                  bindings=bindings(binding(values({"C[2,1]": 1.0, "x0[1]": 7.0}))))  # fmt: skip
    b = component("b", "resources/L.fmu", connector("D[1,1]", "parameter"), connector("u1", "input"),
                  bindings=bindings(binding(values({"D[1,1]": 2.0, "u1": 1.0}))))  # fmt: skip
    c = component("c", "resources/L.fmu", connector("y1", "output"))
    root = system("root", a, b, c, links=(link("a.y2", "b.D[1,1]"), link("c.y1", "b.u1")))
    path = package(tmp_path / "p.ssp", root, {"resources/L.fmu": calculated})
    told = command(tmp_path, path)["parameters"]
    assert told["b.D[1,1]"] == {"value": 7.0, "unit": None, "from": "connection", "where": "a.y2"}
    assert "b.u1" not in told, "an input that is connected has no value of its own"


def test_structural_parameters_and_inputs_of_the_system(fmus, tmp_path):
    made = connector("u1", "input", unit="mm"), connector("size", "structuralParameter", "UInt64")
    three = parameter_set(parameter("size", "UInt64", 3), version="2.0")
    a = component("a", "resources/L.fmu", *made, bindings=bindings(binding(three)))
    root = system("root", a, made=(connector("in", "input", unit="m"),), links=(link("in", "a.u1"),))
    path = package(tmp_path / "p.ssp", root, with_fmu(fmus, 3), version="2.0")
    told = command(tmp_path, path, "--set", "in=2")["parameters"]
    assert told["a.size"]["value"] == 3
    assert told["a.size"]["from"] == "package"
    assert told["in"] == {"value": 2.0, "unit": "m", "from": "command line", "where": "--set in=2"}


def test_bytes_and_arrays_of_them_are_hexadecimal():
    for value, told in ((b"\x01\xff", "01ff"), ((b"\x01", b""), ["01", ""]), ((1.0, 2.0), [1.0, 2.0])):
        made = ParameterInForce("a", "b", value, None, "FMU", "").summary()
        assert json.loads(json.dumps(made))["value"] == told


def test_what_stimuli_drive_is_no_parameter(fmus, tmp_path):
    a = component("a", "resources/L.fmu", connector("u1", "input"), bindings=bindings(binding(values({"u1": 1.0}))))
    path = package(tmp_path / "p.ssp", system("root", a), with_fmu(fmus, 2))
    (tmp_path / "s.csv").write_text("time,a.u1\n0,1\n1,2\n")
    assert "a.u1" not in command(tmp_path, path, "--stimuli", str(tmp_path / "s.csv"))["parameters"]
    assert command(tmp_path, path)["parameters"]["a.u1"]["value"] == 1.0


def rows(text):
    """The table's rows by name."""
    return {line.split()[0]: line for line in text.split("\nparameters\n")[1].splitlines()[1:]}


def test_info_lists_them_with_their_limits(fmus, tmp_path, capsys):
    limited = '<Real start="5" min="-2" max="1e9" unit="s"'
    fmu = redescribed(fmus[2], tmp_path / "L.fmu", ('<Real start="1e300"', limited))
    path = all_sources(tmp_path, fmu)
    arguments = "--parameters", str(tmp_path / "user.ssv"), "--set", "a.D[1,5]=55"
    assert main([str(path), *arguments, "--info", "--parameters"]) == 0
    lines = rows(capsys.readouterr().out)
    assert lines["a.when"].split() == ["a.when", "5", "s", "-2", "1e+09", "FMU"]
    assert lines["a.D[1,1]"].split()[1:3] == ["11", "mapping:"]
    assert lines["a.D[1,2]"].split()[1:4] == ["12", "mm", "SystemStructure.ssd,"]
    assert lines["a.D[1,4]"].split()[1:5] == ["44", "command", "line:", "user.ssv,"]
    assert lines["a.D[1,5]"].split()[1:] == ["55", "command", "line:", "--set", "a.D[1,5]=55"]
    assert main([str(path), "--info"]) == 0
    assert "\nparameters\n" not in capsys.readouterr().out


def test_without_a_file_it_is_for_looking(fmus, tmp_path, capsys):
    path = all_sources(tmp_path, fmus[2])
    assert main([str(path), "--parameters"]) == 2
    assert "--info" in capsys.readouterr().err
