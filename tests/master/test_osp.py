"""System structures of the Open Simulation Platform: simulators, values, connections, steps, functions, groups."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys

import numpy as np
import pytest
from deepsea_cosim.master.algorithms import NAMES
from deepsea_cosim.master.cli import main
from deepsea_cosim.master.simulation.check import check
from deepsea_cosim.master.simulation.run import Options, run

from benchmarks import native

from .parts import redescribed

pytestmark = pytest.mark.skipif(native.compiler is None, reason="there is no C compiler here")

SPACE = "http://opensimulationplatform.com/MSMI/OSPSystemStructure"
RAMP = {"A[1,2]": 1.0, "x0[2]": 1.0, "C[1,1]": 1.0}
"""y1 = t."""


def simulator(name, values=None, source="L.fmu", kind="Real", **more):
    """A simulator with initial values."""
    inside = "".join(
        f'<InitialValue variable="{k}"><{kind} value="{v}"/></InitialValue>' for k, v in (values or {}).items()
    )
    given = "".join(f' {k}="{v}"' for k, v in more.items())
    return f'<Simulator name="{name}" source="{source}"{given}><InitialValues>{inside}</InitialValues></Simulator>'


def end(address, kind="Variable"):
    """An end of a connection, e.g. "a.y1"."""
    of, _, name = address.partition(".")
    return f'<{kind} {"function" if kind.startswith("Signal") else "simulator"}="{of}" name="{name}"/>'


def link(one, other, kind="Variable", **more):
    """A connection between variables, or a variable and a function's signal (which "+" marks), or groups of them."""
    kinds = [kind.replace("Variable", "Signal") if a.startswith("+") else kind for a in (one, other)]
    tag = f"{'Signal' if kinds[0] != kinds[1] else 'Variable'}{kind.removeprefix('Variable')}Connection"
    given = "".join(f' {k}="{v}"' for k, v in more.items())
    ends = "".join(end(a.removeprefix("+"), k) for a, k in zip((one, other), kinds, strict=True))
    return f"<{tag}{given}>{ends}</{tag}>"


def structure(folder, fmu, *simulators, links=(), functions="", times="<BaseStepSize>0.1</BaseStepSize>", stop=1.0):
    """A folder with the structure and its FMU."""
    folder.mkdir(parents=True, exist_ok=True)
    shutil.copy(fmu, folder / "L.fmu")
    (folder / "OspSystemStructure.xml").write_text(
        f'<?xml version="1.0" encoding="utf-8"?><OspSystemStructure xmlns="{SPACE}" version="0.1">'
        f"<StartTime>0.0</StartTime><EndTime>{stop}</EndTime>{times}"
        f"<Simulators>{''.join(simulators)}</Simulators>"
        + (f"<Functions>{functions}</Functions>" if functions else "")
        + f"<Connections>{''.join(links)}</Connections></OspSystemStructure>"
    )
    return folder


def frame(tmp_path, path, **options):
    return run(path, tmp_path / "out", Options(**options)).frame()


@pytest.mark.parametrize("version", [1, 2, 3])
@pytest.mark.parametrize("isolate", [False, True])
def test_simulators_values_and_a_connection_written_backwards(fmus, tmp_path, version, isolate):
    """A ramp that a gain of 3 reads, a step late as the parallel algorithm of OSP has it."""
    a, b = simulator("a", RAMP), simulator("b", {"B[1,1]": 3.0, "C[1,1]": 1.0})
    folder = structure(tmp_path / "s", fmus[version], a, b, links=(link("b.u1", "a.y1"),))
    for path in (folder, folder / "OspSystemStructure.xml"):
        found = frame(tmp_path, path, isolate=isolate)
        assert found["time"].iloc[-1] == 1.0
        assert found["a.y1"].tolist() == pytest.approx([k / 10 for k in range(11)])
        # the integral of 3 * held(t): 3 * 0.1 * (0 + 0.1 + ... + 0.9)
        assert found["b.y1"].iloc[-1] == pytest.approx(3 * 0.1 * 4.5)


def test_initial_values_of_all_types(fmus, tmp_path):
    given = {"Integer": ("integer_in", 7), "Boolean": ("boolean_in", "true"), "String": ("string_in", "hello"),
             "Enumeration": ("item_in", 3)}  # fmt: skip
    parts = [simulator(c, dict([value]), kind=kind) for c, (kind, value) in zip("abcd", given.items(), strict=True)]
    last = frame(tmp_path, structure(tmp_path / "s", fmus[2], *parts)).iloc[-1]
    assert last["a.integer_out"] == 7
    assert bool(last["b.boolean_out"]) is True
    assert last["c.string_out"] == "hello"
    assert last["d.item_out"] == 3


@pytest.mark.parametrize(("method", "isolate"), [(None, False), (None, True), *((name, False) for name in NAMES)])
def test_functions_add_and_scale_without_delay(fmus, tmp_path, method, isolate):
    """c = 2 (a + b + d) + 5, where a = t, b = 10, d = -t, so that it is 25 at every point; e = a + b."""
    functions = (
        '<LinearTransformation name="twice" factor="2" offset="5"/><Sum name="sum" inputCount="3"/>'
        '<Sum name="other" inputCount="2"/>'
    )
    through = {"D[1,1]": 1.0}
    parts = (
        simulator("a", RAMP), simulator("b", {"C[1,1]": 1.0, "x0[1]": 10.0}),
        simulator("d", {**RAMP, "x0[2]": -1.0}), *(simulator(name, through) for name in "cef"),
    )  # fmt: skip
    links = (
        link("a.y1", "+sum.in[0]"), link("+sum.in[1]", "b.y1"), link("d.y1", "+sum.in[2]"),
        link("+sum.out", "f.u1"), link("f.y1", "+twice.in"), link("+twice.out", "c.u1"),
        link("a.y1", "+other.in[0]"), link("b.y1", "+other.in[1]"), link("+other.out", "e.u1"),
    )  # fmt: skip
    folder = structure(tmp_path / "s", fmus[2], *parts, functions=functions, links=links)
    found = frame(tmp_path, folder, method=method, isolate=isolate)
    assert found["sum.out"].tolist() == pytest.approx([10.0] * 11)
    assert found["twice.out"].tolist() == pytest.approx([25.0] * 11)
    assert found["c.y1"].tolist() == pytest.approx([25.0] * 11)
    assert found["other.out"].tolist() == pytest.approx([10 + k / 10 for k in range(11)])
    assert found["e.y1"].tolist() == pytest.approx([10 + k / 10 for k in range(11)])


def described(folder, groups, beside=""):
    """What OSP says beside an FMU of its groups."""
    name = "http://opensimulationplatform.com/MSMI/OSPModelDescription"
    (folder / beside).mkdir(exist_ok=True)
    (folder / beside / "Linear_OspModelDescription.xml").write_text(
        f'<OspModelDescription xmlns="{name}" version="0.1"><VariableGroups>{groups}</VariableGroups>'
        "</OspModelDescription>"
    )


GROUPS = (
    '<Generic name="all"><Force name="force"><Variable ref="y1"/><Variable ref="y2"/></Force>'
    '<LinearVelocity name="speed"><Variable ref="u1"/></LinearVelocity></Generic>'
    '<Generic name="turned"><Force name="f"><Variable ref="u1"/><Variable ref="u2"/></Force>'
    '<LinearVelocity name="v"><Variable ref="y1"/></LinearVelocity></Generic>'
    '<Generic name="out"><Variable name="y1"/><Variable name="y2"/></Generic>'
    '<Generic name="in"><Variable ref="u1"/><Variable ref="u2"/></Generic>'
)


def test_groups_connect_their_variables_in_order_each_in_its_own_direction(fmus, tmp_path):
    a = simulator("a", {"x0[1]": 2.0, "x0[2]": 3.0, "C[1,1]": 1.0, "C[2,2]": 1.0})
    b = simulator("b", {"x0[1]": 7.0, "C[1,1]": 1.0})
    folder = structure(tmp_path / "s", fmus[2], a, b, links=(link("a.all", "b.turned", "VariableGroup"),))
    described(folder, GROUPS)
    last = frame(tmp_path, folder).iloc[-1]
    assert [last[c] for c in ("b.u1", "b.u2", "a.u1")] == pytest.approx([2.0, 3.0, 7.0])


def test_a_group_may_be_a_part_of_another_and_vectors_add(fmus, tmp_path):
    vectors = {"x0[1]": 1.0, "x0[2]": 10.0, "C[1,1]": 1.0, "C[2,2]": 1.0}
    parts = simulator("a", vectors), simulator("b", {**vectors, "x0[1]": 5.0}), simulator("c"), simulator("d")
    links = (
        link("a.out", "+v.in[0]", "VariableGroup"), link("+v.in[1]", "b.force", "VariableGroup"),
        link("+v.out", "c.in", "VariableGroup"), link("a.force", "d.f", "VariableGroup"),
    )  # fmt: skip
    folder = structure(
        tmp_path / "s", fmus[2], *parts, links=links, functions='<VectorSum name="v" inputCount="2" dimension="2"/>'
    )
    described(folder, GROUPS)
    last = frame(tmp_path, folder).iloc[-1]
    assert [last[c] for c in ("c.u1", "c.u2", "d.u1", "d.u2")] == pytest.approx([6.0, 20.0, 1.0, 10.0])


LIBCOSIM = """
import json, sys
from libcosimpy.CosimExecution import CosimExecution
from libcosimpy.CosimObserver import CosimObserver

execution = CosimExecution.from_osp_config_file(osp_path=sys.argv[1])
observer = CosimObserver.create_last_value()
execution.add_observer(observer)
names = sys.argv[2:]
places = [execution.slave_index_from_instance_name(instance_name=name) for name in names]
rows = []
for _ in range(200):
    execution.step()
    rows.append([observer.last_real_values(slave_index=k, variable_references=[10])[0] for k in places])
json.dump(rows, sys.stderr)
"""
"""Writes y1 of simulators, which has the value reference 10, after each step."""


def test_states_are_those_of_libcosim(fmus, tmp_path):
    """An oscillator and two lags in a circle, by a sum, a group and a transformation; to 1e-12 over 200 steps."""
    pytest.importorskip("libcosimpy")
    swing = {"A[1,2]": 1, "A[2,1]": -4, "B[2,1]": 1, "C[1,1]": 1, "C[2,2]": 1, "x0[1]": 1}
    lag = {"A[1,1]": -1, "B[1,1]": 0.5, "C[1,1]": 1}
    parts = (simulator("a", swing), simulator("b", {"C[1,1]": 1, "x0[1]": 10}), simulator("c", lag),
             simulator("d", {**lag, "A[1,1]": -2}))  # fmt: skip
    links = (
        link("a.force", "c.f", "VariableGroup"), link("c.y1", "+twice.in"), link("+twice.out", "a.u1"),
        link("a.y1", "+sum.in[0]"), link("b.y1", "+sum.in[1]"), link("c.y1", "+sum.in[2]"), link("+sum.out", "d.u1"),
    )  # fmt: skip
    functions = '<LinearTransformation name="twice" factor="2" offset="5"/><Sum name="sum" inputCount="3"/>'
    times = "<BaseStepSize>0.01</BaseStepSize><Algorithm>fixedStep</Algorithm>"
    folder = structure(tmp_path / "s", fmus[2], *parts, links=links, functions=functions, times=times, stop=2.0)
    described(folder, GROUPS)
    names = ["a", "b", "c", "d"]
    command = [sys.executable, "-c", LIBCOSIM, str(folder), *names]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    theirs = np.array(json.loads(done.stderr[done.stderr.index("[[") :]))
    ours = frame(tmp_path, folder)[[f"{name}.y1" for name in names]].to_numpy()[1:]
    assert np.ptp(ours[:, 0]) > 0.3
    assert ours == pytest.approx(theirs, abs=1e-12)


def test_the_step_is_the_shortest_of_the_simulators_and_others_are_told(fmus, tmp_path):
    """Of 0.021 at a base of 0.01 two base steps are left; libcosim steps the other one every 0.05 s."""
    parts = simulator("a", RAMP, stepSize="0.021"), simulator("b", stepSize="0.05")
    folder = structure(tmp_path / "s", fmus[2], *parts, times="<BaseStepSize>0.01</BaseStepSize>")
    summary = run(folder, tmp_path / "out").summary
    assert summary["step_s"] == pytest.approx(0.02)
    assert summary["method"] == "jacobi"
    assert sum("'b'" in w and "0.05" in w for w in summary["warnings"]) == 1
    plain = structure(tmp_path / "t", fmus[2], *parts, times="<Algorithm>ecco</Algorithm>")
    found = run(plain, tmp_path / "out").summary
    assert found["step_s"] == pytest.approx(0.1)
    assert sum("ecco" in w for w in found["warnings"]) == 1


def test_values_keep_their_numbers_whatever_their_units(fmus, tmp_path):
    """As in libcosim; units that differ are told, those behind a linear transformation are its business."""
    odd = redescribed(
        fmus[2], tmp_path / "U.fmu",
        ('<ScalarVariable name="y1" valueReference="10" causality="output" variability="continuous"><Real',
         '<ScalarVariable name="y1" valueReference="10" causality="output" variability="continuous"><Real unit="m"'),
        ('<ScalarVariable name="u1" valueReference="0" causality="input" variability="continuous"><Real',
         '<ScalarVariable name="u1" valueReference="0" causality="input" variability="continuous"><Real unit="mm"'),
        ("<TypeDefinitions>", '<UnitDefinitions><Unit name="m"><BaseUnit m="1"/></Unit><Unit name="mm">'
         '<BaseUnit m="1" factor="0.001"/></Unit></UnitDefinitions><TypeDefinitions>'),
    )  # fmt: skip
    a = simulator("a", {"C[1,1]": 1.0, "x0[1]": 4.0})
    links = link("a.y1", "b.u1"), link("a.y1", "+mm.in"), link("+mm.out", "c.u1")
    folder = structure(tmp_path / "s", odd, a, simulator("b"), simulator("c"), links=links,
                       functions='<LinearTransformation name="mm" factor="1000"/>')  # fmt: skip
    result = run(folder, tmp_path / "out")
    assert result.frame()["b.u1"].iloc[-1] == 4.0
    assert result.frame()["c.u1"].iloc[-1] == 4000.0
    assert [w for w in result.summary["warnings"] if " mm" in w and "'b.u1'" in w]
    assert not [w for w in result.summary["warnings"] if "c.u1" in w]


def test_a_power_bond_is_reported(fmus, tmp_path):
    a, b = simulator("a", {"x0[1]": 2.0, "C[1,1]": 1.0}), simulator("b", {"x0[1]": 7.0, "C[1,1]": 1.0})
    links = link("a.y1", "b.u1", powerBond="p"), link("a.u1", "b.y1", powerBond="p")
    summary = run(structure(tmp_path / "s", fmus[2], a, b, links=links), tmp_path / "out").summary
    assert len(summary["coupling"]) == 1
    assert summary["coupling"][0]["exchanged_energy_J"] == pytest.approx(14.0)


def test_sources_elsewhere_and_of_a_proxy_of_this_machine(fmus, tmp_path):
    folder = structure(tmp_path / "s" / "inner", fmus[2], simulator("a", RAMP, source="../M.fmu"),
                       simulator("b", RAMP, source="proxyfmu://localhost?file=../M.fmu"))  # fmt: skip
    shutil.copy(fmus[2], tmp_path / "s" / "M.fmu")
    last = frame(tmp_path, folder).iloc[-1]
    assert last["a.y1"] == last["b.y1"] == pytest.approx(1.0)


def test_info_and_parameters_know_it(fmus, tmp_path, capsys):
    folder = structure(tmp_path / "s", fmus[2], simulator("a", {"D[1,1]": 4.5}), links=(link("a.y1", "+f.in"),),
                       functions='<LinearTransformation name="f" factor="3"/>')  # fmt: skip
    assert main([str(folder), "--info", "--parameters"]) == 0
    shown = capsys.readouterr().out
    assert "f: out = 3 in" in shown
    row = next(line for line in shown.splitlines() if line.strip().startswith("a.D[1,1]"))
    assert row.split()[1:3] == ["4.5", "OspSystemStructure.xml,"]


WRONG = {
    "no such simulator": ({"links": (link("a.y1", "c.u1"),)}, "'c'"),
    "no such variable": ({"links": (link("a.y1", "b.u77"),)}, "u77"),
    "no such signal": ({"links": (link("a.y1", "+s.in[2]"),), "functions": '<Sum name="s" inputCount="2"/>'}, "in[2]"),
    "a function of no name": ({"functions": '<Gain name="g"/>'}, "<Gain>"),
    "no group": ({"links": (link("a.out", "b.in", "VariableGroup"),)}, "Linear_OspModelDescription.xml"),
    "an FMU elsewhere": ({"more": (simulator("c", source="http://example.org/x.fmu"),)}, "http://example.org/x.fmu"),
    "a missing FMU": ({"more": (simulator("c", source="no.fmu"),), "links": (link("c.y1", "a.u1"),)}, "no.fmu"),
    "a value that is none": ({"more": (simulator("c", {"D[1,1]": "x"}),)}, "D[1,1]"),
    "a step that is none": ({"times": "<BaseStepSize>0</BaseStepSize>"}, "BaseStepSize"),
    "an element of no meaning": ({"times": "<Scenario/>"}, "<Scenario>"),
    "a name twice": ({"more": (simulator("a"),)}, "'a'"),
}  # fmt: skip


@pytest.mark.parametrize("case", WRONG)
def test_what_is_not_supported_is_one_line_with_its_place(fmus, tmp_path, capsys, case):
    given, named = WRONG[case]
    given = dict(given)
    folder = structure(tmp_path / "s", fmus[2], simulator("a"), simulator("b"), *given.pop("more", ()), **given)
    for more in ((), ("--check",)):
        assert main([str(folder), "--out", str(tmp_path / "out"), "--no-plot", *more]) == 2
        told = capsys.readouterr().err
        assert len(told.splitlines()) == 1
        assert named in told
        assert "OspSystemStructure.xml, line" in told
    assert len(check(folder).errors) == 1


def test_a_group_that_does_not_fit_is_told(fmus, tmp_path, capsys):
    folder = structure(tmp_path / "s", fmus[2], simulator("a"), simulator("b"),
                       links=(link("a.out", "b.v", "VariableGroup"),))  # fmt: skip
    described(folder, GROUPS)
    assert main([str(folder), "--check"]) == 2
    assert "2 variables" in capsys.readouterr().err


def test_a_description_of_ssp_beside_it_counts(fmus, tmp_path):
    """A folder is a package first."""
    folder = structure(tmp_path / "s", fmus[2], simulator("a"))
    (folder / "SystemStructure.ssd").write_text("<nothing/>")
    assert main([str(folder), "--check"]) == 2
    assert main([str(folder / "OspSystemStructure.xml"), "--check"]) == 0
