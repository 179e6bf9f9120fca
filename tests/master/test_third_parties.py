"""What packages and FMUs of others do: aliases, values of their own, ends of their own, units in two ways, odd zips."""

from __future__ import annotations

import zipfile

import numpy as np
import pytest
from deepsea_cosim import simulate
from deepsea_cosim.core.errors import CosimError
from deepsea_cosim.master.algorithms import NAMES
from deepsea_cosim.master.engine.runner import last_step
from deepsea_cosim.master.simulation.check import check
from deepsea_cosim.master.simulation.run import Options, run
from deepsea_cosim.master.simulation.session import Session
from deepsea_cosim.master.simulation.time_grid import time_grid
from deepsea_cosim.ssp.archive import extract

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
    unit,
    values,
)
from .parts import constant, gain, last, linear, redescribed, with_fmu, with_input

pytestmark = pytest.mark.skipif(native.compiler is None, reason="there is no C compiler here")


def warnings(tmp_path, path, **options):
    return " ".join(run(path, tmp_path / "out", Options(**options)).summary["warnings"])


# values on their way


@pytest.mark.parametrize("version", [1, 2, 3])
def test_strings_reach_fmus_in_processes_of_their_own(fmus, tmp_path, version):
    a, b = (component(name, "resources/L.fmu") for name in "ab")
    root = system("root", a, b, links=(link("a.string_out", "b.string_in"),))
    path = package(tmp_path / "p.ssp", root, with_fmu(fmus, version))
    for isolate in (False, True):
        assert last(tmp_path, path, "b.string_out", changes=(("a.string_in", "hello"),), isolate=isolate) == "hello"


def test_a_session_drives_no_texts(fmus, tmp_path):
    path = package(tmp_path / "p.ssp", system("root", component("a", "resources/L.fmu")), with_fmu(fmus, 2))
    with Session(path) as session, pytest.raises(CosimError, match=r"'a\.string_in' is not a single number"):
        session.run(["a.y1"], 1.0, 0.1, inputs={"a.string_in": ([0.0, 1.0], [0.0, 1.0])})


def aliased(tmp_path, version):
    """An FMU whose input u1 is called u9 too."""
    fmu = native.linear(tmp_path / "n", version)
    if version == 3:
        old = '<Float64 name="u1" valueReference="0" causality="input" variability="continuous" start="0">'
        return redescribed(fmu, tmp_path / "A.fmu", (old, f'{old}<Alias name="u9"/>'))
    old = '<ScalarVariable name="u1" valueReference="0" causality="input" variability="continuous">'
    new = old.replace("u1", "u9").replace('">', '" alias="alias">', 1) if version == 1 else old.replace("u1", "u9")
    new = new.replace('variability="continuous">', 'variability="continuous" alias="alias">') if version == 1 else new
    return redescribed(fmu, tmp_path / "A.fmu", (old, f'{new}<Real start="0"/></ScalarVariable>{old}'))


@pytest.mark.parametrize("version", [1, 2, 3])
def test_an_alias_of_an_input_is_the_same_input(fmus, tmp_path, version):
    files = {"resources/L.fmu": fmus[2], "resources/A.fmu": aliased(tmp_path, version)}
    for name in ("u1", "u9"):
        a = component("a", "resources/A.fmu", connector(name, "input"),
                      bindings=bindings(binding(values({"D[1,1]": 3.0}))))  # fmt: skip
        path = package(tmp_path / "p.ssp", system("root", constant("c", 2.0), a, links=(link("c.y1", f"a.{name}"),)),
                       files)  # fmt: skip
        frame = run(path, tmp_path / "out").frame()
        assert frame[["a.u1", "a.u9", "a.y1"]].iloc[-1].tolist() == [2.0, 2.0, 6.0]
        alone = package(tmp_path / "q.ssp", system("root", a), files)
        assert last(tmp_path, alone, "a.y1", changes=((f"a.{name}", "5"),)) == 15.0
    root = system("root", constant("c", 2.0), a, links=(link("c.y1", "a.u1"), link("c.y1", "a.u9")))
    with pytest.raises(CosimError, match=r"'a\.u[19]' is another name of 'a\.u[19]', which is driven already"):
        run(package(tmp_path / "p.ssp", root, files), tmp_path / "out")


def test_an_input_without_a_start_value_keeps_what_its_fmu_has(fmus, tmp_path):
    fmu = redescribed(fmus[3], tmp_path / "M.fmu", ('causality="input" start="1 2"', 'causality="input"'))
    path = package(tmp_path / "p.ssp", system("root", component("a", "resources/M.fmu")), {"resources/M.fmu": fmu})
    frame = run(path, tmp_path / "out").frame()
    assert frame[["a.many_in[1]", "a.many_in[2]", "a.many_out[2]"]].iloc[-1].tolist() == [1.0, 2.0, 2.0]


@pytest.mark.parametrize("method", ["gauss-seidel", "jacobi", "nepce"])
def test_outputs_of_the_system_are_there_from_the_first_row(fmus, tmp_path, method):
    root = system("root", constant("c", 7.0), made=(connector("out", "output"),), links=(link("c.y1", "out"),))
    path = package(tmp_path / "p.ssp", root, with_fmu(fmus))
    assert run(path, tmp_path / "out", Options(method=method)).frame()["out"].tolist() == [7.0] * 11
    with Session(path) as session:
        for value in (7.0, 9.0):
            _, rows = session.run(["c.y1", "out"], 1.0, 0.1, {"c.x0[1]": value}, method=method)
            assert (rows == value).all()


def test_an_output_of_the_system_that_shows_its_input_does_not_lag(fmus, tmp_path):
    root = with_input(connector("out", "output"))
    root = root.replace("</ssd:Connections>", f"{link('in', 'out')}</ssd:Connections>")
    path = package(tmp_path / "p.ssp", root, with_fmu(fmus))
    (tmp_path / "s.csv").write_text("time,in\n0,1\n1,2\n")
    frame = run(path, tmp_path / "out", Options(stimuli=tmp_path / "s.csv")).frame()
    assert frame["out"].tolist() == frame["in"].tolist()
    t = np.linspace(0.0, 1.0, 11)
    with Session(path) as session:
        _, rows = session.run(["in", "out"], 1.0, 0.1, inputs={"in": (t, 1.0 + t)})
    assert (rows[:, 0] == rows[:, 1]).all()


def test_an_input_of_the_system_that_nobody_gives_is_what_its_fmu_starts_with(tmp_path):
    fmu = redescribed(native.linear(tmp_path / "n", 2), tmp_path / "M.fmu", (
        'name="u1" valueReference="0" causality="input" variability="continuous"><Real start="0"/>',
        'name="u1" valueReference="0" causality="input" variability="continuous"><Real start="5"/>',
    ))  # fmt: skip
    frame = run(package(tmp_path / "p.ssp", with_input(), {"resources/L.fmu": fmu}), tmp_path / "out").frame()
    assert frame[["in", "a.u1", "a.y1"]].iloc[-1].tolist() == [5.0, 5.0, 15.0]


def test_a_jump_comes_on_time_where_times_are_rounded_down(fmus, tmp_path):
    path = package(tmp_path / "p.ssp", with_input(), with_fmu(fmus), stop=2.0, step=0.01)
    (tmp_path / "s.csv").write_text("time,in\n0,0\n1.36,0\n1.36,1\n2,1\n")
    frame = run(path, tmp_path / "out", Options(stimuli=tmp_path / "s.csv", method="jacobi")).frame()
    assert frame["in"].tolist() == [0.0] * 136 + [1.0] * 65
    frame = run(path, tmp_path / "out", Options(stimuli=tmp_path / "s.csv", step=0.34, method="jacobi")).frame()
    assert frame["in"].tolist() == [0.0] * 4 + [1.0] * 3


# steps


def test_the_last_step_is_as_long_as_the_others_where_the_step_divides_the_time(fmus, tmp_path):
    strict = bindings(binding(values({"trouble": 10.0})))
    root = system("root", component("a", "resources/L.fmu", bindings=strict))
    for version in (1, 2, 3):
        path = package(tmp_path / "p.ssp", root, with_fmu(fmus, version))
        assert len(run(path, tmp_path / "out").frame()) == 11
        assert len(run(path, tmp_path / "out", Options(isolate=True)).frame()) == 11


@pytest.mark.parametrize("h", [0.1, 0.01, 1e-3, 0.3, 0.07])
def test_no_step_goes_beyond_the_stop_time(h):
    for n in range(1, 300):
        stop = n * h
        length = last_step(0.0, h, n, stop)
        assert (n - 1) * h + length <= stop
        assert length == pytest.approx(h, rel=1e-12)
    assert last_step(0.0, h, 3, 2.5 * h) == pytest.approx(0.5 * h)


def test_late_times_have_no_step_of_length_zero():
    class Structure:
        start_time, stop_time, step_size = 1e9, 1e9 + 0.1, 0.01

    assert time_grid(Structure()).steps == 10


@pytest.mark.parametrize("isolate", [False, True])
@pytest.mark.parametrize("version", [2, 3])
def test_an_fmu_may_end_the_run(fmus, tmp_path, version, isolate):
    """The state that it has reached is recorded; with FMI 2.0 it discards the step and says so when asked."""
    ramp = {"A[1,2]": 1.0, "x0[2]": 1.0, "C[1,1]": 1.0, "when": 0.4}
    for trouble, reached in ((8.0, 0.5), (9.0, 0.45)):
        a = component("a", "resources/L.fmu", bindings=bindings(binding(values({**ramp, "trouble": trouble}))))
        path = package(tmp_path / "p.ssp", system("root", a, constant("b", 1.0)), with_fmu(fmus, version))
        result = run(path, tmp_path / "out", Options(isolate=isolate))
        assert result.summary["status"] == "ended"
        assert result.summary["stop_time_s"] == pytest.approx(0.5)
        assert result.frame()["time"].iloc[-1] == pytest.approx(0.5)
        assert result.frame()["a.y1"].iloc[-1] == pytest.approx(reached)
        told = " ".join(result.summary["warnings"])
        assert "component 'a' ended the run at t = 0.5 s, before 1 s" in told
        assert ("came to t = 0.45 s in its last step" in told) == (trouble == 9.0)
    with Session(path) as session, pytest.raises(CosimError, match="'a' asks to end the simulation"):
        session.run(["a.y1"], 1.0, 0.1)


@pytest.mark.parametrize("method", NAMES)
@pytest.mark.parametrize("version", [2, 3])
def test_an_fmu_may_end_the_run_with_every_method(fmus, tmp_path, version, method):
    """Nothing is given to it afterwards, though others go to the end of the step."""
    ending = {"A[1,2]": 1.0, "x0[2]": 1.0, "C[1,1]": 1.0, "when": 0.4, "trouble": 8.0}
    a = component("a", "resources/L.fmu", connector("y1", "output"), connector("u1", "input"),
                  bindings=bindings(binding(values(ending))))  # fmt: skip
    links = (link("a.y1", "b.u1"), link("b.y1", "a.u1"))
    path = package(tmp_path / "p.ssp", system("root", a, gain("b", 0.5), links=links), with_fmu(fmus, version))
    result = run(path, tmp_path / "out", Options(method=method))
    assert result.summary["status"] == "ended"
    assert result.frame()["time"].iloc[-1] == pytest.approx(0.5)


def test_an_inner_step_that_does_not_fit_is_told(fmus, tmp_path):
    fmu = redescribed(fmus[3], tmp_path / "M.fmu", ("<CoSimulation ", '<CoSimulation fixedInternalStepSize="0.04" '))
    path = package(tmp_path / "p.ssp", system("root", component("a", "resources/M.fmu")), {"resources/M.fmu": fmu})
    assert "'a' has an inner step of 0.04 s; its step of 0.1 s is no multiple of that" in warnings(tmp_path, path)
    assert "inner step" not in warnings(tmp_path, path, step=0.2)


# units and values


def test_units_of_one_name_are_one_unit(tmp_path):
    """Published packages define m with a factor of 1e-3 beside FMUs in metres; nobody else scales by that."""
    for units in ({"x0[1]": "m", "y1": "m"}, {"y1": "m"}):
        fmu = native.linear(tmp_path / "f", 2, units=units)
        own = f"<ssv:Units>{unit('m', m=1, factor='1e-3')}</ssv:Units>"
        given = parameter_set(parameter("x0[1]", "Real", 2, unit="m"), parameter("C[1,1]", "Real", 1), units=own)
        root = system("root", component("a", "resources/L.fmu", bindings=bindings(binding(given))))
        path = package(tmp_path / "p.ssp", root, {"resources/L.fmu": fmu})
        assert last(tmp_path, path, "a.y1") == 2.0
        told = "unit 'm' is defined in two ways; the value is passed on as it is"
        assert (told in warnings(tmp_path, path)) == ("x0[1]" in units)
        assert (told in " ".join(check(path).lines())) == ("x0[1]" in units)


def test_a_rate_per_minute_is_no_angular_velocity(fmus, tmp_path):
    def path(source):
        a = gain("a", 1.0, unit_in="rad/s")
        return package(tmp_path / "p.ssp", system("root", constant("c", 3.0, unit_out=source), a,
                       links=(link("c.y1", "a.u1"),)), with_fmu(fmus))  # fmt: skip

    with pytest.raises(CosimError, match="cannot convert '1/min' to 'rad/s'"):
        run(path("1/min"), tmp_path / "out")
    assert last(tmp_path, path("1/s"), "a.y1") == 3.0


@pytest.mark.parametrize(
    ("factor", "expected"), [("0.10471975511965977", 6.283185307179586), ("0.1047", 6.282), ("0.016666666667", None)]
)
def test_a_rate_with_the_radians_of_a_turn_in_its_factor_is_an_angular_velocity(fmus, tmp_path, factor, expected):
    """60 U/min are 60 times its factor in 1/s; with 1 / 60 a turn may be meant, with 2 pi / 60 it is said."""
    units = f"<ssd:Units>{unit('U/min', s=-1, factor=factor)}{unit('rad/s', rad=1, s=-1)}</ssd:Units>"
    root = system("root", constant("c", 60.0, unit_out="U/min"), gain("a", 1.0, unit_in="rad/s"),
                  links=(link("c.y1", "a.u1"),))  # fmt: skip
    path = package(tmp_path / "p.ssp", root, with_fmu(fmus), after=units)
    if expected is None:
        assert any("cannot convert 'U/min' to 'rad/s'" in told for told in check(path).errors)
    else:
        assert last(tmp_path, path, "a.y1") == pytest.approx(expected, rel=1e-12)


def test_an_enumeration_that_the_package_does_not_define_is_that_of_the_fmu(fmus, tmp_path):
    item = '<ssv:Parameter name="item_in"><ssv:Enumeration name="Colour" value="blue"/></ssv:Parameter>'
    given = parameter_set(item)
    a = component("a", "resources/L.fmu", connector("item_out", "output", "Enumeration", enumeration="Colour"),
                  bindings=bindings(binding(given)))  # fmt: skip
    assert last(tmp_path, package(tmp_path / "p.ssp", system("root", a), with_fmu(fmus)), "a.item_out") == 3


def test_infinity_is_a_value_and_nan_is_none(fmus, tmp_path):
    def path(value):
        given = bindings(binding(values({"u6": value})))
        return package(tmp_path / "p.ssp", system("root", component("a", "resources/L.fmu", bindings=given)),
                       with_fmu(fmus))  # fmt: skip

    assert last(tmp_path, path("1e300"), "a.u6") == 1e300
    given = bindings(binding(values({"when": "INF"})))
    infinite = package(tmp_path / "q.ssp", system("root", component("a", "resources/L.fmu", bindings=given)),
                       with_fmu(fmus))  # fmt: skip
    assert last(tmp_path, infinite, "a.y1") == 0.0
    with pytest.raises(CosimError, match=r"a\.u6 = nan is not a number"):
        run(path("NaN"), tmp_path / "out")
    with pytest.raises(CosimError, match="'1_0' is not a value of type Real"):
        run(path("1_0"), tmp_path / "out")


# names


def nested(fmus, tmp_path):
    """A gain in a system: its factor and input are connectors of that system and of the whole one, in mm and m."""
    inner = system("in", gain("a", 3.0, unit_in="m"), made=(connector("g", "parameter"), connector("i", "input")),
                   links=(link("g", "a.D[1,1]"), link("i", "a.u1")))  # fmt: skip
    root = system("root", inner, made=(connector("k", "parameter"), connector("mm", "parameter", unit="mm")),
                  links=(link("k", "in.g"), link("mm", "in.i")))  # fmt: skip
    return package(tmp_path / "p.ssp", root, with_fmu(fmus))


def test_names_of_connectors_of_systems_can_be_set(fmus, tmp_path):
    path = nested(fmus, tmp_path)
    length = ("mm", "2000")  # 2 m
    assert last(tmp_path, path, "in.a.y1", changes=(length,)) == 6.0
    assert last(tmp_path, path, "in.a.y1", changes=(length, ("k", "5"))) == 10.0
    assert last(tmp_path, path, "in.a.y1", changes=(length, ("in.g", "7"))) == 14.0
    (tmp_path / "s.ssv").write_text(parameter_set(parameter("k", "Real", 5), parameter("mm", "Real", 2000, unit="mm")))
    assert last(tmp_path, path, "in.a.y1", parameters=(tmp_path / "s.ssv",)) == 10.0
    with Session(path) as session:
        assert session.targets("k") == [("in.a", "D[1,1]")]
        _, rows = session.run(["in.a.y1"], 1.0, 0.1, {"k": 5.0, "mm": 2000.0})
        assert rows[-1, 0] == 10.0


def test_connectors_of_systems_reach_the_components_that_are_loaded(fmus, tmp_path):
    """One that leads only to others sets nothing, as a value that the package binds for them."""
    root = system("root", gain("a", 3.0), gain("b", 4.0),
                  made=tuple(connector(n, "parameter") for n in ("both", "other")),
                  links=(link("both", "a.D[1,1]"), link("both", "b.D[1,1]"), link("other", "b.x0[1]")))  # fmt: skip
    path = package(tmp_path / "p.ssp", root, with_fmu(fmus))
    with Session(path, only=["a"]) as session:
        changes = {"both": 5.0, "other": 1.0, "a.u1": 2.0}
        assert session.run(["a.y1"], 1.0, 0.1, changes)[1][-1, 0] == 10.0
        assert session.targets("both") == [("a", "D[1,1]")]
        assert session.values(changes)["a.D[1,1]"] == 5.0
        with pytest.raises(CosimError, match="no component has a parameter 'others'"):
            session.run(["a.y1"], 1.0, 0.1, {"others": 1.0})


def test_bindings_that_set_nothing_say_why(fmus, tmp_path):
    root = system("root", gain("a", 3.0), made=(connector("x", "output"), connector("y", "parameter")),
                  links=(link("a.y1", "x"),),
                  bindings=bindings(binding(values({"x": 1.0, "y": 1.0, "z": 1.0}))))  # fmt: skip
    told = warnings(tmp_path, package(tmp_path / "p.ssp", root, with_fmu(fmus)))
    assert "connector 'x' is an output; the value is ignored" in told
    assert "connector 'y' leads nowhere; the value is ignored" in told
    assert "nothing is called 'z'; the value is ignored" in told


def test_a_bound_input_of_a_nested_system_is_not_without_value(fmus, tmp_path):
    inner = system("in", gain("a", 3.0), made=(connector("i", "input"),), links=(link("i", "a.u1"),),
                   bindings=bindings(binding(values({"i": 2.0}))))  # fmt: skip
    path = package(tmp_path / "p.ssp", system("root", inner), with_fmu(fmus))
    assert last(tmp_path, path, "in.a.y1") == 6.0
    assert "nothing gives it a value" not in warnings(tmp_path, path)


def test_a_nested_input_that_the_user_gives_a_value_is_not_without(fmus, tmp_path):
    inner = system("in", gain("a", 3.0), made=(connector("i", "input"),), links=(link("i", "a.u1"),))
    path = package(tmp_path / "p.ssp", system("root", inner), with_fmu(fmus))
    assert "nothing gives it a value" in warnings(tmp_path, path)
    for name in ("in.i", "in.a.u1"):
        assert last(tmp_path, path, "in.a.y1", changes=((name, "2"),)) == 6.0
        assert "nothing gives it a value" not in warnings(tmp_path, path, changes=((name, "2"),))


@pytest.mark.parametrize("first", [0, 1])
def test_a_parameter_that_is_connected_and_bound_too(fmus, tmp_path, first):
    """The connection counts, wherever either stands, and a remark says so."""
    given = [("k", 5.0), ("a.D[1,1]", 7.0)]
    root = system("root", gain("a", 3.0), made=(connector("k", "parameter"), connector("i", "input")),
                  links=(link("k", "a.D[1,1]"), link("i", "a.u1")),
                  bindings=bindings(binding(values(dict([*given[first:], *given[:first]])))))  # fmt: skip
    path = package(tmp_path / "p.ssp", root, with_fmu(fmus))
    assert last(tmp_path, path, "a.y1", changes=(("i", "2"),)) == 10.0
    assert "'a.D[1,1]' is bound, and connected to 'k'" in warnings(tmp_path, path, changes=(("i", "2"),))


def test_two_internal_variables_of_one_name_count_only_where_they_are_named(fmus, tmp_path):
    twins = "".join(
        f'<ScalarVariable name="twin" valueReference="{20 + k}" causality="local" variability="continuous"><Real/>'
        "</ScalarVariable>" for k in (4, 5)
    )  # fmt: skip
    fmu = redescribed(fmus[2], tmp_path / "twins.fmu", ("</ModelVariables>", f"{twins}</ModelVariables>"))
    made = {"resources/L.fmu": fmu}
    root = system("root", gain("a", 3.0), made=(connector("i", "input"),), links=(link("i", "a.u1"),))
    assert last(tmp_path, package(tmp_path / "p.ssp", root, made), "a.y1", changes=(("i", "2"),)) == 6.0
    shown = system("root", gain("a", 3.0, connector("twin", "output")), made=(connector("o", "output"),),
                   links=(link("a.twin", "o"),))  # fmt: skip
    with pytest.raises(CosimError, match="twin"):
        run(package(tmp_path / "q.ssp", shown, made), tmp_path / "out")


def test_a_parameter_given_twice_counts_only_where_a_mapping_names_it(fmus, tmp_path):
    twice = parameter_set(parameter("g", "Real", 5), parameter("x", "Real", 1), parameter("x", "Real", 2))

    def path(source):
        mapped = f"<ssd:ParameterMapping>{mapping_file(entry(source, 'a.D[1,1]'))}</ssd:ParameterMapping>"
        root = system("root", gain("a", 3.0), made=(connector("i", "input"),), links=(link("i", "a.u1"),),
                      bindings=bindings(binding(twice, mapped)))  # fmt: skip
        return package(tmp_path / "p.ssp", root, with_fmu(fmus))

    assert last(tmp_path, path("g"), "a.y1", changes=(("i", "2"),)) == 10.0
    with pytest.raises(CosimError, match="'x' is given twice"):
        run(path("x"), tmp_path / "out")


def test_a_name_of_another_component_says_where_it_is(fmus, tmp_path):
    other = native.linear(tmp_path / "other", 2, plain=True)
    root = system("root", gain("a", 3.0), component("b", "resources/P.fmu"))
    path = package(tmp_path / "p.ssp", root, {**with_fmu(fmus), "resources/P.fmu": other})
    with pytest.raises(CosimError, match=r"component 'b' has no parameter 'u5'; 'u5' is a parameter of 'a'"):
        run(path, tmp_path / "out", Options(changes=(("b.u5", "1"),)))


def test_setting_a_connected_input_is_told(fmus, tmp_path):
    root = system("root", constant("c", 2.0), gain("a", 3.0), links=(link("c.y1", "a.u1"),))
    path = package(tmp_path / "p.ssp", root, with_fmu(fmus))
    told = warnings(tmp_path, path, changes=(("a.u1", "9"),))
    assert "--set a.u1=9: 'a.u1' is connected to 'c.y1', which counts" in told


def test_check_looks_at_substeps_and_columns(fmus, tmp_path):
    path = package(tmp_path / "p.ssp", system("root", gain("a", 3.0)), with_fmu(fmus))
    assert not check(path, Options(record=("a.y1",), substeps=(("a", 2),))).errors
    assert "there is no component 'b'" in check(path, Options(substeps=(("b", 2),))).errors[0]
    assert "--record 'b.*' matches nothing" in check(path, Options(record=("b.*",))).errors[0]
    assert "--plot 'b.*' matches nothing" in check(path, Options(plot=("b.*",))).errors[0]


# archives and files


def test_a_unit_defined_twice_alike_is_one(fmus, tmp_path):
    root = system("root", gain("a", 3.0))
    for factor, wrong in (("1.0", False), ("2.0", True)):
        units = f"<ssd:Units>{unit('x', m=1)}{unit('x', m=1, factor=factor)}</ssd:Units>"
        path = package(tmp_path / "p.ssp", root, with_fmu(fmus), after=units)
        if wrong:
            with pytest.raises(CosimError, match="unit 'x' is defined in two ways"):
                run(path, tmp_path / "out")
        else:
            run(path, tmp_path / "out")


def test_entries_of_archives_with_dots_and_backslashes(tmp_path):
    fmu = native.linear(tmp_path / "n", 2)
    with zipfile.ZipFile(fmu, "a") as archive:
        archive.writestr("./extra/p.ssv", values({"D[1,1]": 4.0}))
    a = component("a", "resources/L.fmu", bindings=bindings(binding(source="extra/p.ssv", sourceBase="component")))
    path = package(tmp_path / "p.ssp", system("root", a), {"resources/L.fmu": fmu})
    assert last(tmp_path, path, "a.y1", changes=(("a.u1", "2"),)) == 8.0
    with zipfile.ZipFile(tmp_path / "b.zip", "w") as archive:
        archive.writestr("resources\\x", "")
    with pytest.raises(CosimError, match="has a backslash"):
        extract(tmp_path / "b.zip", tmp_path / "there")


# what is said of runs that went wrong


def oscillator(fmus, tmp_path, step, stop):
    """A mass and a spring of 10 rad/s, coupled."""

    fmu = native.linear(tmp_path / "n", 2, through=False, units={"u1": "N", "y1": "m/s"})
    other = native.linear(tmp_path / "m", 2, through=False, units={"u1": "m/s", "y1": "N"})
    root = system("root", linear("mass", A=[[0]], B=[[1]], C=[[1]], x0=[1]),
                  linear("spring", "resources/S.fmu", A=[[0]], B=[[-100]], C=[[1]]),
                  links=(link("mass.y1", "spring.u1"), link("spring.y1", "mass.u1")))  # fmt: skip
    return package(tmp_path / "p.ssp", root, {"resources/L.fmu": fmu, "resources/S.fmu": other}, step=step, stop=stop)


@pytest.mark.parametrize("method", ["jacobi", "extrapolation"])
def test_a_run_that_explodes_is_not_trusted(fmus, tmp_path, method):
    result = run(oscillator(fmus, tmp_path, 0.3, 60.0), tmp_path / "out", Options(method=method))
    assert any("the coupling is unstable" in text or "do not trust" in text for text in result.summary["warnings"])
    text = (tmp_path / "out" / "summary.json").read_text()
    assert "NaN" not in text
    assert "Infinity" not in text


def test_a_run_that_explodes_is_not_trusted_where_no_unit_tells_a_power(fmus, tmp_path):
    """A spring of 100 N/m on 1 kg, omega h = 3, by a coupling that is unstable there; no units, so no power bond."""

    def path(step, stop):
        root = system("root", linear("mass", A=[[0, 1], [0, 0]], B=[[0], [1]], C=[[1, 0]], x0=[1, 0]),
                      linear("spring", A=[[0]], B=[[0]], C=[[1]], D=[[-100.0]]),
                      links=(link("mass.y1", "spring.u1"), link("spring.y1", "mass.u1")))  # fmt: skip
        return package(tmp_path / "p.ssp", root, with_fmu(fmus), step=step, stop=stop)

    told = warnings(tmp_path, path(0.3, 12.0), method="jacobi")
    assert "runs away: it reaches" in told
    assert "runs away" not in warnings(tmp_path, path(1e-3, 2.0), method="jacobi")


def test_an_error_that_half_the_step_shows_is_a_warning(fmus, tmp_path):
    path = oscillator(fmus, tmp_path, 1e-3, 30.0)  # omega h = 0.01: the amplitude grows fourfold
    told = warnings(tmp_path, path, method="jacobi", check_step=True)
    assert "--check-step: '" in told
    assert "do not trust this run" in told
    assert "--check-step" not in warnings(tmp_path, path, method="nepce", check_step=True)


def test_a_closed_session_says_so(fmus, tmp_path):
    path = package(tmp_path / "p.ssp", system("root", gain("a", 3.0)), with_fmu(fmus))
    with Session(path) as session:
        session.run(["a.y1"], 1.0, 0.1)
    with pytest.raises(CosimError, match="the session is closed"):
        session.run(["a.y1"], 1.0, 0.1)


def test_one_name_or_file_for_many(fmus, tmp_path):
    path = package(tmp_path / "p.ssp", system("root", gain("a", 3.0)), with_fmu(fmus))
    (tmp_path / "s.ssv").write_text(values({"a.u1": 2.0}))
    for given in (tmp_path / "s.ssv", str(tmp_path / "s.ssv"), [tmp_path / "s.ssv"]):
        frame = simulate(path, tmp_path / "out", record="a.y1", plot="a.*", parameters=given).frame()
        assert list(frame) == ["time", "a.y1"]
        assert frame["a.y1"].iloc[-1] == 6.0


def of_modelica(name, kind):
    """A connector as Dymola exports one whose type is not one of Modelica's own."""
    type = '<ssc:Binary mime-type="text/x-modelica; path=Modelica.Units.SI.Time"/>'
    return f'<ssd:Connector name="{name}" kind="{kind}">{type}</ssd:Connector>'


def test_connectors_of_types_of_modelica_are_what_they_lead_to(fmus, tmp_path):
    """5 through a gain of 3; 7 through the parameter of the nested system."""
    b = component("b", "resources/L.fmu", of_modelica("u1", "input"), of_modelica("y1", "output"),
                  bindings=bindings(binding(values({"D[1,1]": 3.0}))))  # fmt: skip
    made = (of_modelica("u", "input"), of_modelica("p", "parameter"), of_modelica("o", "output"))
    inner = system("s", b, constant("a", 0.0), made=made, links=(link("u", "b.u1"), link("p", "a.x0[1]"),
                   link("b.y1", "o")))  # fmt: skip
    root = system("root", inner, made=(of_modelica("in", "input"), of_modelica("out", "output")),
                  links=(link("in", "s.u"), link("s.o", "out")),
                  bindings=bindings(binding(values({"s.p": 7.0, "in": 5.0}))))  # fmt: skip
    path = package(tmp_path / "p.ssp", root, with_fmu(fmus))
    found = check(path)
    assert not found.errors
    assert not found.warnings
    assert run(path, tmp_path / "out").frame()[["out", "s.a.y1"]].iloc[-1].tolist() == [15.0, 7.0]


@pytest.mark.parametrize(
    ("name", "kind", "value", "expected"),
    [("boolean", "Boolean", "True", 1), ("boolean", "Boolean", "FALSE", 0), ("integer", "Integer", "5.0", 5)],
)
def test_values_that_scripts_write_are_taken_and_told(fmus, tmp_path, name, kind, value, expected):
    """The schema does not allow them, but they leave no doubt."""
    given = bindings(binding(parameter_set(parameter(f"{name}_in", kind, value))))
    root = system("root", component("a", "resources/L.fmu", bindings=given))
    path = package(tmp_path / "p.ssp", root, with_fmu(fmus))
    assert last(tmp_path, path, f"a.{name}_out") == expected
    assert f"'{value}' is not a valid value of the atomic type" in warnings(tmp_path, path)
    assert any(f"'{value}' is not a valid value" in told for told in check(path).errors)


@pytest.mark.parametrize(
    ("kind", "value"), [("Boolean", "yes"), ("Integer", "5.5"), ("Integer", "5."), ("Integer", "")]
)
def test_values_that_leave_a_doubt_are_refused(fmus, tmp_path, kind, value):
    given = bindings(binding(parameter_set(parameter(f"{kind.lower()}_in", kind, value))))
    root = system("root", component("a", "resources/L.fmu", bindings=given))
    path = package(tmp_path / "p.ssp", root, with_fmu(fmus))
    with pytest.raises(CosimError, match=f"'{value}' is not a value of type {kind}"):
        run(path, tmp_path / "out")
