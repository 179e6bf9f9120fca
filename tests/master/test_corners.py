"""What a reviewer found: memory of earlier runs, discrete values, loops of whole numbers, short last steps and more."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from deepsea_cosim.core.errors import CosimError
from deepsea_cosim.master.algorithms import NAMES
from deepsea_cosim.master.simulation.check import check
from deepsea_cosim.master.simulation.run import Options, run
from deepsea_cosim.master.simulation.session import Session
from deepsea_cosim.master.slaves.base import FmuInstance

from benchmarks import native

from ..packages import (
    binding,
    bindings,
    component,
    connector,
    description,
    link,
    pack,
    package,
    parameter,
    parameter_set,
    system,
    values,
)
from .parts import linear, redescribed

pytestmark = pytest.mark.skipif(native.compiler is None, reason="there is no C compiler here")


CLOCK = {"A": [[0, 1], [0, 0]], "C": [[1, 0]], "x0": [0, 1]}
INTEGRATOR = {"A": [[0]], "B": [[1]], "C": [[1]]}


@pytest.mark.parametrize("method", NAMES)
def test_a_session_remembers_nothing_of_an_earlier_run(tmp_path, method):
    fmu = native.linear(tmp_path / "f", 2, through=False)
    root = system("root", linear("clock", **CLOCK), linear("i", **INTEGRATOR), links=(link("clock.y1", "i.u1"),))
    path = package(tmp_path / "p.ssp", root, {"resources/L.fmu": fmu})
    with Session(path) as session:
        first, second, third = (session.run(["i.y1"], 1.0, 0.1, method=method)[1] for _ in range(3))
    assert first.tolist() == second.tolist() == third.tolist()
    assert run(path, tmp_path / "out", Options(method=method)).frame()["i.y1"].tolist() == first[:, 0].tolist()


def test_a_session_takes_any_number_of_records(fmus, tmp_path):
    root = system("root", linear("clock", **CLOCK), linear("i", **INTEGRATOR), links=(link("clock.y1", "i.u1"),))
    with Session(package(tmp_path / "p.ssp", root, {"resources/L.fmu": fmus[2]})) as session:
        addresses = [f"clock.y{k + 1}" for k in range(6)]
        for k in range(1, 90):
            session.run([addresses[i] for i in range(6) if k >> i & 1] or ["i.y1"], 0.2, 0.1, method="nepce")
        with pytest.raises(CosimError, match=r"step 3 s is longer than the whole run of 1 s"):
            session.run(["i.y1"], 1.0, 3.0)


@pytest.mark.parametrize("method", ["gauss-seidel", "interface-jacobian"])
def test_a_session_shortens_its_last_step_as_a_run_does(tmp_path, method):
    fmu = native.linear(tmp_path / "f", 2, through=False)
    parts = linear("a", A=[[0]], B=[[-9.0]], C=[[1]], x0=[1]), linear("b", A=[[0]], B=[[1.0]], C=[[1]], x0=[0])
    root = system("root", *parts, links=(link("a.y1", "b.u1"), link("b.y1", "a.u1")))
    path = package(tmp_path / "p.ssp", root, {"resources/L.fmu": fmu})
    alone = run(path, tmp_path / "out", Options(method=method, step=0.03, stop_time=1.0)).frame()
    with Session(path) as session:
        t, rows = session.run(["a.y1"], 1.0, 0.03, method=method)
    assert t.tolist() == alone["time"].tolist()
    assert rows[:, 0].tolist() == alone["a.y1"].tolist()


@pytest.mark.parametrize("method", ["extrapolation", "nepce"])
def test_discrete_reals_are_passed_on_as_they_are(tmp_path, method):
    """A gear of 0, 1, 2, ... is never 1.5."""
    fmu = native.linear(tmp_path / "f", 2, through=False)
    y1 = 'name="y1" valueReference="10" causality="output" variability='
    gears = redescribed(fmu, tmp_path / "gears.fmu", (f'{y1}"continuous"', f'{y1}"discrete"'))
    clock = linear("clock", "resources/G.fmu", A=[[0, 10], [0, 0]], C=[[1, 0]], x0=[0, 1])
    root = system("root", clock, linear("i", **INTEGRATOR), links=(link("clock.y1", "i.u1"),))
    path = package(tmp_path / "p.ssp", root, {"resources/L.fmu": fmu, "resources/G.fmu": gears})
    frame = run(path, tmp_path / "out", Options(method=method)).frame()
    assert frame["i.u1"].to_numpy() == pytest.approx(frame["i.u1"].round().to_numpy(), abs=1e-9)


def test_loops_of_whole_numbers(fmus, tmp_path):
    """A negative number that goes round is a fixed point; nothing that could be solved for is an error."""
    given = bindings(binding(parameter_set(parameter("integer_in", "Integer", -1))))
    pair = [component(n, "resources/L.fmu", connector("integer_in", "input", "Integer"),
                      connector("integer_out", "output", "Integer"), bindings=given) for n in "ab"]  # fmt: skip
    links = (link("a.integer_out", "b.integer_in"), link("b.integer_out", "a.integer_in"))
    path = package(tmp_path / "p.ssp", system("root", *pair, links=links), {"resources/L.fmu": fmus[2]})
    assert run(path, tmp_path / "out").frame()["a.integer_out"].tolist() == [-1] * 11


def test_an_output_does_not_drive_a_parameter(fmus, tmp_path):
    root = system("root", linear("clock", **CLOCK), linear("a", D=[[1.0]]), links=(link("clock.y1", "a.D[1,1]"),))
    path = package(tmp_path / "p.ssp", root, {"resources/L.fmu": fmus[2]})
    with pytest.raises(CosimError, match=r"'clock\.y1' changes during a run and cannot drive the parameter 'a\.D"):
        run(path, tmp_path / "out")


def test_infinity_does_not_travel_in_silence(fmus, tmp_path):
    factor = '<ssc:LinearTransformation factor="1e200"/>'
    root = system("root", linear("c", C=[[1]], x0=[1e200]), linear("a", D=[[1e-300]]),
                  links=(link("c.y1", "a.u1", factor),))  # fmt: skip
    with pytest.raises(CosimError, match=r"not finite at t = 0 s: .*a\.u1 = inf"):
        run(package(tmp_path / "p.ssp", root, {"resources/L.fmu": fmus[2]}), tmp_path / "out")


def test_a_short_last_step_has_the_slope_of_the_others(tmp_path):
    """y = t into an integrator that takes slopes: exact but for the first step, which knows none."""
    fmu = native.linear(tmp_path / "f", 2, through=False, slopes=True)
    root = system("root", linear("clock", **CLOCK), linear("i", **INTEGRATOR), links=(link("clock.y1", "i.u1"),))
    path = package(tmp_path / "p.ssp", root, {"resources/L.fmu": fmu})
    x = run(path, tmp_path / "out", Options(method="extrapolation", step=0.3)).frame()["i.y1"].iloc[-1]
    assert x == pytest.approx(0.5 - 0.3**2 / 2.0, rel=1e-12)


def test_fmi_1_tells_what_its_outputs_depend_on(tmp_path):
    fmu = native.linear(tmp_path / "f", 1, direct=True)
    root = system("root", linear("clock", **CLOCK), linear("gain", D=[[2.0]]), linear("i", **INTEGRATOR),
                  links=(link("clock.y1", "gain.u1"), link("gain.y1", "i.u1")))  # fmt: skip
    frame = run(package(tmp_path / "p.ssp", root, {"resources/L.fmu": fmu}), tmp_path / "out",
                Options(method="jacobi")).frame()  # fmt: skip
    assert frame["gain.y1"].tolist() == pytest.approx((2.0 * frame["time"]).tolist())


def test_two_columns_of_one_name_are_refused(fmus, tmp_path):
    root = system("root", linear("clock", **CLOCK), made=(connector("time", "output"),),
                  links=(link("clock.y1", "time"),))  # fmt: skip
    path = package(tmp_path / "p.ssp", root, {"resources/L.fmu": fmus[2]})
    with pytest.raises(CosimError, match="two columns of the result would be called 'time'"):
        run(path, tmp_path / "out")
    assert any("would be called 'time'" in text for text in check(path).errors)


def test_a_fault_in_a_method_ends_the_run(fmus, tmp_path, monkeypatch):
    """Nothing that Python code of a method raises is lost on its way through the compiled loop."""
    from deepsea_cosim.master.slaves.fmi2 import Fmi2Instance

    whole, calls = Fmi2Instance.save, []

    def save(self):  # the first call is that of the probe for feed-through
        calls.append(self)
        if len(calls) > 1:
            raise ValueError("no state today")
        return whole(self)

    monkeypatch.setattr(Fmi2Instance, "save", save)
    root = system("root", linear("clock", **CLOCK), linear("i", **INTEGRATOR), links=(link("clock.y1", "i.u1"),))
    path = package(tmp_path / "p.ssp", root, {"resources/L.fmu": fmus[2]})
    with pytest.raises(CosimError, match="ValueError: no state today"):
        run(path, tmp_path / "out", Options(method="fixed-point"))


def test_large_systems_are_ordered_in_time(fmus, tmp_path):
    """2000 gains in a chain, listed from its end."""
    n = 2000
    names = [f"g{k}" for k in range(n)]
    parts = [component(name, "resources/L.fmu", connector("u1", "input"), connector("y1", "output")) for name in names]
    links = [link(f"{a}.y1", f"{b}.u1") for a, b in zip(names[1:], names, strict=False)]
    path = package(tmp_path / "p.ssp", system("root", *parts, links=tuple(links)), {"resources/L.fmu": fmus[2]})
    found = check(path)
    assert not found.errors
    assert found.system.order == names[::-1]


def test_fmus_with_thousands_of_variables_are_set_up_in_time(tmp_path):
    """Which say nothing of what depends on what, as is usual: every output might on every input."""
    n = 1000
    source = (native.HERE / "fmus" / "linear.c").read_text()
    old = "    if (r < 6) return &m->u[r];\n"
    assert source.count(old) == 1
    many = f"    static double many[{n}];\n    if (r >= 10000) return many + (r - 10000) % {n};\n"
    (tmp_path / "many.c").write_text(source.replace(old, many + old))
    built = native.compiled(tmp_path / "many.c", 2, tmp_path / "Linear.so")
    rows = "".join(
        f'<ScalarVariable name="{cause[0]}{k}" valueReference="{first + k}" causality="{cause}" '
        f'variability="continuous"><Real{start}/></ScalarVariable>'
        for cause, first, start in (("input", 10000, ' start="1"'), ("output", 10000 + n, "")) for k in range(n)
    )  # fmt: skip
    plain = native.packed(tmp_path / "plain.fmu", 2, built, through=None)
    begin = native.description(2, through=None).count("<ScalarVariable ") + n + 1
    outputs = "".join(f'<Unknown index="{begin + k}"/>' for k in range(n))
    changes = ("</ModelVariables>", rows + "</ModelVariables>"), ("<Outputs>", "<Outputs>" + outputs)
    fmu = redescribed(plain, tmp_path / "many.fmu", *changes)
    parts = (component(name, "resources/many.fmu") for name in "ab")
    links = tuple(link(f"a.o{k}", f"b.i{k}") for k in range(n))
    path = package(tmp_path / "p.ssp", system("root", *parts, links=links), {"resources/many.fmu": fmu})
    for method in ("gauss-seidel", "jacobi"):
        assert run(path, tmp_path / "out", Options(method=method)).summary["status"] == "ok"


def nested(outer, inner):
    """A gain of 1 in a description of its own; the component's connector `in` is as told, the system's as well."""
    gain = linear("a", D=[[1.0]])
    made = (inner, connector("out", "output"))
    part = description(system("part", gain, made=made, links=(link("in", "a.u1"), link("a.y1", "out"))))
    sub = component("sub", "part.ssd", outer, connector("out", "output"), type="application/x-ssp-definition")
    clock = component("c", "resources/L.fmu", connector("y1", "output", unit="m"),
                      bindings=bindings(binding(values({"C[1,1]": 1.0, "x0[1]": 2.0}))))  # fmt: skip
    root = system("root", clock, sub, links=(link("c.y1", "sub.in"),))
    return root, {"part.ssd": part}


@pytest.mark.parametrize(
    ("outer", "inner", "message"),
    [
        (connector("in", "input", unit="mm"), connector("in", "input"), 2000.0),
        (connector("in", "input", unit="mm"), connector("in", "input", unit="km"), 0.002),
        (connector("in", "input", "String"), connector("in", "input"), "is a String, that of its system is Real"),
        (connector("in", "output"), connector("in", "input"), "is of kind output, that of its system is input"),
        (connector("in", "input", unit="mm"), connector("in", "input", unit="K"), "is in mm, that of its system is K"),
    ],
)
def test_connectors_of_components_that_are_systems(fmus, tmp_path, outer, inner, message):
    root, files = nested(outer, inner)
    path = package(tmp_path / "p.ssp", root, {"resources/L.fmu": fmus[2], **files})
    if not isinstance(message, str):
        assert run(path, tmp_path / "out").frame()["sub.a.u1"].iloc[-1] == pytest.approx(message)
    else:
        with pytest.raises(CosimError, match=message):
            run(path, tmp_path / "out")


@pytest.mark.parametrize(
    ("type", "cells", "message"),
    [
        ("Integer", "2.9", r"line 2, column 'n': 2\.9 is not a value of type Integer"),
        ("Integer", "1e30", "is not a value of type Integer"),
        ("Boolean", "0.5", "is not a value of type Boolean"),
    ],
)
def test_whole_numbers_in_tables(fmus, tmp_path, type, cells, message):
    name = "integer_in" if type == "Integer" else "boolean_in"
    whole = component("a", "resources/L.fmu", connector(name, "input", type))
    root = system("root", whole, made=(connector("n", "input", type),), links=(link("n", f"a.{name}"),))
    path = package(tmp_path / "p.ssp", root, {"resources/L.fmu": fmus[2]})
    (tmp_path / "s.csv").write_text(f"time,n\n0,{cells}\n")
    with pytest.raises(CosimError, match=message):
        run(path, tmp_path / "out", Options(stimuli=tmp_path / "s.csv"))


@pytest.mark.parametrize("value", ["3000000000", "-99999999999999999999999"])
def test_whole_numbers_on_the_command_line(fmus, tmp_path, value):
    whole = component("a", "resources/L.fmu", connector("integer_in", "input", "Integer"))
    root = system("root", whole, made=(connector("n", "input", "Integer"),), links=(link("n", "a.integer_in"),))
    path = package(tmp_path / "p.ssp", root, {"resources/L.fmu": fmus[2]})
    with pytest.raises(CosimError, match="is not a value of the system's input 'n'"):
        run(path, tmp_path / "out", Options(changes=(("n", value),)))


def test_methods_that_go_back_say_why_not_when_isolated(fmus, tmp_path):
    root = system("root", linear("clock", **CLOCK), linear("i", **INTEGRATOR), links=(link("clock.y1", "i.u1"),))
    path = package(tmp_path / "p.ssp", root, {"resources/L.fmu": fmus[2]})
    with pytest.raises(CosimError, match=r"--isolate\) cannot be taken back"):
        run(path, tmp_path / "out", Options(method="fixed-point", isolate=True))


def test_a_power_bond_that_names_nothing(fmus, tmp_path):
    root = system("root", linear("clock", **CLOCK), linear("i", **INTEGRATOR), links=(link("clock.y1", "i.u1"),))
    text = description(root).replace('stepSize="0.1"/>', 'stepSize="0.1"><Bond a="nosuch.y" b="clock.y1"/></Master>')
    path = pack(tmp_path / "p.ssp", {"SystemStructure.ssd": text, "resources/L.fmu": fmus[2]})
    with pytest.raises(CosimError, match=r"the power bond names 'nosuch\.y', which drives nothing"):
        run(path, tmp_path / "out")


@pytest.mark.parametrize("method", ["extrapolation", "nepce", "fixed-point"])
def test_second_order_behind_an_fmu_that_answers_at_once(fmus, tmp_path, method):
    """t^2 through two gains into an integrator."""
    parabola = linear("clock", A=[[0, 1, 0], [0, 0, 1], [0, 0, 0]], C=[[1, 0, 0]], x0=[0, 0, 2])
    root = system("root", parabola, linear("a", D=[[2.0]]), linear("b", D=[[0.5]]), linear("i", **INTEGRATOR),
                  links=(link("clock.y1", "a.u1"), link("a.y1", "b.u1"), link("b.y1", "i.u1")))  # fmt: skip
    path = package(tmp_path / "p.ssp", root, {"resources/L.fmu": fmus[2]})
    errors = [
        abs(run(path, tmp_path / "out", Options(method=method, step=h)).frame()["i.y1"].iloc[-1] - 1.0 / 3.0)
        for h in (0.05, 0.025)
    ]
    assert errors[0] / errors[1] > 3.5


def test_stimuli_are_those_of_the_row(fmus, tmp_path):
    """clock + stimulus, t - t: nothing in every row."""
    add = linear("add", D=[[1.0, 1.0]])
    root = system("root", linear("clock", **CLOCK), add, made=(connector("in", "input"),),
                  links=(link("clock.y1", "add.u1"), link("in", "add.u2")))  # fmt: skip
    path = package(tmp_path / "p.ssp", root, {"resources/L.fmu": fmus[2]})
    (tmp_path / "s.csv").write_text("time,in\n0,0\n1,-1\n")
    frame = run(path, tmp_path / "out", Options(stimuli=tmp_path / "s.csv", method="jacobi")).frame()
    assert frame["in"].tolist() == pytest.approx((-frame["time"]).tolist())
    assert frame["add.y1"].tolist() == pytest.approx([0.0] * len(frame), abs=1e-12)


@pytest.mark.parametrize("method", ["extrapolation", "nepce"])
def test_a_short_last_step_is_foretold_as_far_as_it_is_long(tmp_path, method):
    """y = t is a straight line: exact but for the first step, whatever the last one's length."""
    fmu = native.linear(tmp_path / "f", 2, through=False)
    parts = [linear("clock", **CLOCK), linear("i", **INTEGRATOR)]
    if method == "nepce":  # which foretells what comes later in the order: put both into a loop
        parts.reverse()
    links = [link("clock.y1", "i.u1")]
    if method == "nepce":
        links.append(link("i.y1", "clock.u2"))
    path = package(tmp_path / "p.ssp", system("root", *parts, links=tuple(links)), {"resources/L.fmu": fmu})
    frame = run(path, tmp_path / "out", Options(method=method, step=0.3)).frame()
    assert frame["i.y1"].iloc[-1] == pytest.approx(0.5 - 0.3**2 / 2.0, rel=1e-12)


def test_the_trust_report_knows_inputs_that_take_slopes(tmp_path):
    """A mass on a spring, half a swing of either kind: what is told is small in both."""
    told = []
    for slopes in (False, True):
        fmu = native.linear(tmp_path / str(slopes), 2, through=False, slopes=slopes,
                            units={"u1": "N", "y1": "m/s"})  # fmt: skip
        other = native.linear(tmp_path / str(slopes), 2, "S", through=False, slopes=slopes,
                              units={"u1": "m/s", "y1": "N"})  # fmt: skip
        root = system("root", linear("mass", A=[[0]], B=[[1]], C=[[1]], x0=[1]),
                      linear("spring", "resources/S.fmu", A=[[0]], B=[[-100]], C=[[1]]),
                      links=(link("mass.y1", "spring.u1"), link("spring.y1", "mass.u1")))  # fmt: skip
        path = package(tmp_path / f"{slopes}.ssp", root, {"resources/L.fmu": fmu, "resources/S.fmu": other}, step=0.01)
        told.append(run(path, tmp_path / "out", Options(method="extrapolation")).summary["coupling"][0]["relative"])
    assert told[0] < 0.02
    assert told[1] < 0.02


@pytest.mark.parametrize(("declared", "size"), [(None, 1.0), (-20.0, 20.0), (0.0, 1.0), (np.nan, 1.0), (np.inf, 1.0)])
def test_a_nominal_value_that_is_none_is_1(declared, size):
    assert FmuInstance.nominal(SimpleNamespace(_declared=lambda name, attribute: declared), "x") == size


def test_stimuli_without_a_column_are_told(tmp_path):
    fmu = {"resources/L.fmu": native.linear(tmp_path, 2)}
    (tmp_path / "s.csv").write_text("time\n0\n1\n")
    path = package(tmp_path / "p.ssp", system("root", linear("a", D=[[1.0]])), fmu)
    result = run(path, tmp_path / "out", Options(stimuli=tmp_path / "s.csv"))
    assert any("has no column but time, so it drives nothing" in w for w in result.summary["warnings"])
