"""One package for each row of the support table in docs/ssp.md, with a number worked out by hand.

Gains are FMUs without states: y1 = D u1. An output is read after the step in which its input was held, so a chain of n
gains, stepped in the order of the data, is up to date.
"""

from __future__ import annotations

import numpy as np
import pandas
import pytest
from deepsea_cosim.core.errors import CosimError
from deepsea_cosim.master.cli import main
from deepsea_cosim.master.simulation.run import Options, run

from benchmarks import native

from ..packages import (
    binding,
    bindings,
    component,
    connector,
    description,
    entry,
    link,
    mapping_file,
    pack,
    package,
    parameter,
    parameter_set,
    system,
    unit,
    values,
)
from .parts import constant, gain, last, with_fmu, with_input

pytestmark = pytest.mark.skipif(native.compiler is None, reason="there is no C compiler here")


# system features


def test_nested_systems_and_their_connectors(fmus, tmp_path):
    inner = system(
        "inner", gain("a", 3.0), made=(connector("in", "input"), connector("out", "output")),
        links=(link("in", "a.u1"), link("a.y1", "out")),
    )  # fmt: skip
    outer = system(
        "outer", inner, gain("b", 5.0), made=(connector("in", "input"), connector("out", "output")),
        links=(link("in", "inner.in"), link("inner.out", "b.u1"), link("b.y1", "out")),
    )  # fmt: skip
    root = system("root", constant("c", 2.0), outer, gain("d", 7.0),
                  links=(link("c.y1", "outer.in"), link("outer.out", "d.u1")))  # fmt: skip
    path = package(tmp_path / "p.ssp", root, with_fmu(fmus))
    assert last(tmp_path, path, "d.y1") == 2.0 * 3.0 * 5.0 * 7.0
    assert last(tmp_path, path, "outer.inner.a.y1") == 6.0


def test_connections_may_be_written_in_either_direction(fmus, tmp_path):
    root = system("root", constant("c", 2.0), gain("a", 3.0), links=(link("a.u1", "c.y1"),))
    assert last(tmp_path, package(tmp_path / "p.ssp", root, with_fmu(fmus)), "a.y1") == 6.0


def test_inputs_and_outputs_of_the_whole_system_with_stimuli(fmus, tmp_path):
    root = system("root", gain("a", 3.0), made=(connector("in", "input"), connector("out", "output")),
                  links=(link("in", "a.u1"), link("a.y1", "out")))  # fmt: skip
    path = package(tmp_path / "p.ssp", root, with_fmu(fmus))
    (tmp_path / "s.csv").write_text("time,in\n0,0\n0.5,1\n1,1\n")
    frame = run(path, tmp_path / "out", Options(stimuli=tmp_path / "s.csv")).frame()
    # the input at t_k is held from there on: the output at t_k answers to that of the step before
    assert frame["in"].tolist() == pytest.approx(np.interp(frame["time"] - 0.0, [0, 0.5, 1], [0, 1, 1]), abs=0.11)
    assert frame["out"].iloc[5] == pytest.approx(3.0 * 0.8)
    assert frame["out"].iloc[-1] == pytest.approx(3.0)


def test_discrete_stimuli_are_held(fmus, tmp_path):
    whole = component("a", "resources/L.fmu", connector("integer_in", "input", "Integer"))
    root = system("root", whole, made=(connector("n", "input", "Integer"),), links=(link("n", "a.integer_in"),))
    path = package(tmp_path / "p.ssp", root, with_fmu(fmus))
    (tmp_path / "s.csv").write_text("time,n\n0,2\n0.5,7\n")
    frame = run(path, tmp_path / "out", Options(stimuli=tmp_path / "s.csv")).frame()
    assert frame["a.integer_out"].tolist()[:6] == [2] * 6
    assert frame["a.integer_out"].tolist()[6:] == [7] * 5


@pytest.mark.parametrize("options", [{}, {"isolate": True}, {"method": "nepce"}, {"method": "fixed-point"}])
@pytest.mark.parametrize("column", ["n", "a.{}_in"])
@pytest.mark.parametrize(("variable", "kind", "ends"), [
    ("wide", "Int64", (-(2**63), 2**53 + 1, 2**63 - 1)), ("huge", "UInt64", (0, 2**63 + 1, 2**64 - 1)),
])  # fmt: skip
def test_whole_numbers_of_stimuli_are_exact_to_the_ends_of_their_types(
    fmus, tmp_path, variable, kind, ends, column, options
):
    whole = component("a", "resources/L.fmu", connector(f"{variable}_in", "input", kind))
    made, links = (connector("n", "input", kind),), (link("n", f"a.{variable}_in"),)
    root = system("root", whole, made=made, links=links) if column == "n" else system("root", whole)
    path = package(tmp_path / "p.ssp", root, with_fmu(fmus, 3), version="2.0")
    first, second, third = ends
    name = column.format(variable)
    (tmp_path / "s.csv").write_text(f"time,{name}\n0,{first}\n0.4, {second}\n0.8,{third}\n")
    frame = run(path, tmp_path / "out", Options(stimuli=tmp_path / "s.csv", **options)).frame()
    assert frame[name].tolist() == [first] * 4 + [second] * 4 + [third] * 3
    gives = frame[f"a.{variable}_out"].tolist()
    assert gives[1:4] == [first] * 3
    assert gives[5:8] == [second] * 3
    assert gives[9:] == [third] * 2


@pytest.mark.parametrize("cell", [str(2**63), "-9223372036854775809", "1e19", "0.5", "inf", "1_0"])
def test_what_is_no_whole_number_of_the_type_is_refused_in_stimuli(fmus, tmp_path, cell):
    path = package(tmp_path / "p.ssp", system("root", component("a", "resources/L.fmu")), with_fmu(fmus, 3))
    (tmp_path / "s.csv").write_text(f"time,a.wide_in\n0,1\n0.5,{cell}\n")
    with pytest.raises(CosimError, match=r"s\.csv, line 3, column 'a\.wide_in'"):
        run(path, tmp_path / "out", Options(stimuli=tmp_path / "s.csv"))


@pytest.mark.parametrize(
    ("version", "options"),
    [(1, {}), (2, {}), (3, {}), (2, {"isolate": True}), (2, {"method": "nepce"}), (3, {"record": ("a.string_out",)})],
)
@pytest.mark.parametrize("column", ["s", "a.string_in"])
def test_strings_of_stimuli_are_held(fmus, tmp_path, version, options, column):
    text = component("a", "resources/L.fmu", connector("string_in", "input", "String"))
    root = system("root", text)
    if column == "s":
        root = system("root", text, made=(connector("s", "input", "String"),), links=(link("s", "a.string_in"),))
    path = package(tmp_path / "p.ssp", root, with_fmu(fmus, version))
    (tmp_path / "s.csv").write_text(f'time,{column}\n0,down\n0.5," up, ""slowly"" now"\n0.9,\n', encoding="utf-8")
    frame = run(path, tmp_path / "out", Options(stimuli=tmp_path / "s.csv", **options)).frame()
    assert frame["a.string_out"].fillna("").tolist() == ["down"] * 6 + [' up, "slowly" now'] * 4 + [""]
    if "record" not in options:
        assert frame[column].fillna("").tolist() == ["down"] * 5 + [' up, "slowly" now'] * 4 + [""] * 2


def test_signal_dictionary(fmus, tmp_path):
    dictionary = (
        '<ssd:SignalDictionaries><ssd:SignalDictionary name="bus" source="resources/bus.ssb"/></ssd:SignalDictionaries>'
    )
    bus = (
        '<ssb:SignalDictionary xmlns:ssb="http://ssp-standard.org/SSP1/SystemStructureSignalDictionary" '
        'xmlns:ssc="http://ssp-standard.org/SSP1/SystemStructureCommon" version="1.0">'
        '<ssb:DictionaryEntry name="speed"><ssc:Real unit="mm"/></ssb:DictionaryEntry>'
        f"<ssb:Units>{unit('mm', m=1, factor=0.001)}</ssb:Units></ssb:SignalDictionary>"
    )

    def tap(name):
        return (
            f'<ssd:SignalDictionaryReference name="{name}" dictionary="bus">'
            f"<ssd:Connectors>{connector('speed', 'inout')}</ssd:Connectors></ssd:SignalDictionaryReference>"
        )

    inner = system("inner", tap("bus"), gain("a", 1.0, unit_in="m"), links=(link("bus.speed", "a.u1"),))
    root = system("root", constant("c", 2.0, unit_out="m"), tap("tap"), inner, links=(link("c.y1", "tap.speed"),),
                  dictionaries=dictionary)  # fmt: skip
    units = f"<ssd:Units>{unit('m', m=1)}</ssd:Units>"
    path = package(tmp_path / "p.ssp", root, {**with_fmu(fmus), "resources/bus.ssb": bus}, after=units)
    assert last(tmp_path, path, "inner.a.u1") == pytest.approx(2.0)  # m -> mm -> m


def test_package_as_a_component(fmus, tmp_path):
    inner = system("inner", gain("a", 3.0), made=(connector("in", "input"), connector("out", "output")),
                   links=(link("in", "a.u1"), link("a.y1", "out")))  # fmt: skip
    sub = package(tmp_path / "sub.ssp", inner, with_fmu(fmus))
    other = bindings(binding(values({"a.D[1,1]": 4.0})))
    root = system(
        "root", constant("c", 2.0),
        component("s", "resources/sub.ssp", connector("in", "input"), connector("out", "output"),
                  type="application/x-ssp-package", bindings=other),
        links=(link("c.y1", "s.in"),),
    )  # fmt: skip
    path = package(tmp_path / "p.ssp", root, {**with_fmu(fmus), "resources/sub.ssp": sub})
    assert last(tmp_path, path, "s.a.y1") == 8.0  # the component's binding overrides the package's own


def test_embedded_system_used_twice(fmus, tmp_path):
    part = system("part", gain("a", 3.0), made=(connector("in", "input"), connector("out", "output")),
                  links=(link("in", "a.u1"), link("a.y1", "out")), id="part")  # fmt: skip
    again = component("again", "#part", connector("in", "input"), connector("out", "output"),
                      type="application/x-ssp-definition")  # fmt: skip
    root = system(
        "root", constant("c", 2.0), part, again, links=(link("c.y1", "part.in"), link("part.out", "again.in"))
    )
    path = package(tmp_path / "p.ssp", root, with_fmu(fmus), version="2.0")
    assert last(tmp_path, path, "again.a.y1") == 18.0


def test_variants(fmus, tmp_path):
    def one(g):
        return description(system("root", constant("c", 1.0), gain("a", g), links=(link("c.y1", "a.u1"),)))

    path = pack(tmp_path / "p.ssp", {"SystemStructure.ssd": one(2.0), "Winter.ssd": one(5.0), **with_fmu(fmus)})
    assert last(tmp_path, path, "a.y1") == 2.0
    assert last(tmp_path, path, "a.y1", variant="Winter") == 5.0
    with pytest.raises(CosimError, match=r"no variant 'Summer'; it has SystemStructure.ssd, Winter.ssd"):
        run(path, tmp_path / "out", Options(variant="Summer"))


# parameters


def gain_with(*made, **other):
    """A gain whose parameters are bound as told, behind a constant of 1."""
    a = component("a", "resources/L.fmu", connector("u1", "input"), connector("y1", "output"), bindings=bindings(*made))
    return system("root", constant("c", 1.0), a, links=(link("c.y1", "a.u1"),), **other)


def test_later_bindings_and_higher_levels_win(fmus, tmp_path):
    low = [binding(values({"D[1,1]": g})) for g in (2.0, 3.0)]
    path = package(tmp_path / "p.ssp", gain_with(*low), with_fmu(fmus))
    assert last(tmp_path, path, "a.y1") == 3.0
    high = bindings(binding(values({"a.D[1,1]": 4.0})), binding(values({"a.D[1,1]": 5.0})))
    path = package(tmp_path / "q.ssp", gain_with(*low, bindings=high), with_fmu(fmus))
    assert last(tmp_path, path, "a.y1") == 5.0
    assert last(tmp_path, path, "a.y1", changes=(("a.D[1,1]", "6"),)) == 6.0


def test_external_set_with_a_prefix(fmus, tmp_path):
    high = bindings(binding(source="resources/v.ssv", prefix="a."))
    path = package(
        tmp_path / "p.ssp", gain_with(bindings=high), {**with_fmu(fmus), "resources/v.ssv": values({"D[1,1]": 9.0})}
    )
    assert last(tmp_path, path, "a.y1") == 9.0


def test_mapping_with_a_linear_transformation(fmus, tmp_path):
    ssm = mapping_file(entry("strength", "D[1,1]", '<ssc:LinearTransformation factor="2" offset="1"/>'))
    one = binding(values({"strength": 3.0}), '<ssd:ParameterMapping source="resources/m.ssm"/>')
    path = package(tmp_path / "p.ssp", gain_with(one), {**with_fmu(fmus), "resources/m.ssm": ssm})
    assert last(tmp_path, path, "a.y1") == 2.0 * 3.0 + 1.0


def passing(kind, type, value, inside="", mapped=None):
    """An FMU whose start value of one of its inputs is bound through a mapping."""
    ssm = mapping_file(entry("p", f"{kind}_in", inside))
    sets = parameter_set(parameter("p", type, value))
    one = binding(sets, f"<ssd:ParameterMapping>{ssm}</ssd:ParameterMapping>")
    a = component(
        "a", "resources/L.fmu", connector(f"{kind}_in", "input", type, enumeration=mapped), bindings=bindings(one)
    )
    return system("root", a)


COLOURS = (
    '<ssd:Enumerations><ssc:Enumeration name="Colour"><ssc:Item name="red" value="1"/>'
    '<ssc:Item name="green" value="2"/>'
    '<ssc:Item name="blue" value="3"/></ssc:Enumeration></ssd:Enumerations>'
)


@pytest.mark.parametrize("version", [1, 2, 3])
def test_mappings_of_booleans_integers_and_enumerations(fmus, tmp_path, version):
    flip = '<ssc:BooleanMappingTransformation><ssc:MapEntry source="true" target="false"/>' \
        '<ssc:MapEntry source="false" target="true"/></ssc:BooleanMappingTransformation>'  # fmt: skip
    path = package(tmp_path / "b.ssp", passing("boolean", "Boolean", "false", flip), with_fmu(fmus, version))
    assert last(tmp_path, path, "a.boolean_out") == 1
    table = (
        '<ssc:IntegerMappingTransformation><ssc:MapEntry source="3" target="30"/></ssc:IntegerMappingTransformation>'
    )
    path = package(tmp_path / "i.ssp", passing("integer", "Integer", "3", table), with_fmu(fmus, version))
    assert last(tmp_path, path, "a.integer_out") == 30
    names = '<ssc:EnumerationMappingTransformation><ssc:MapEntry source="red" target="blue"/>' \
        "</ssc:EnumerationMappingTransformation>"  # fmt: skip
    path = package(tmp_path / "e.ssp", passing("item", "Enumeration", "red", names, "Colour"), with_fmu(fmus, version),
                   after=COLOURS)  # fmt: skip
    assert last(tmp_path, path, "a.item_out") == 3


FLIP = ('<ssc:BooleanMappingTransformation><ssc:MapEntry source="true" target="false"/>'
        '<ssc:MapEntry source="false" target="true"/></ssc:BooleanMappingTransformation>')  # fmt: skip
THIRTY = '<ssc:IntegerMappingTransformation><ssc:MapEntry source="3" target="{}"/></ssc:IntegerMappingTransformation>'


@pytest.mark.parametrize(
    ("variable", "type", "table", "shown"),
    [("boolean", "Boolean", FLIP, 1), ("integer", "Integer", THIRTY.format(0), 3),
     ("integer", "Integer", THIRTY.format(30), 0)],
)  # fmt: skip
def test_an_input_that_nobody_gives_shows_what_its_mapping_makes_the_fmus_own_value(
    fmus, tmp_path, variable, type, table, shown
):
    """The FMU has 0, which the table makes of 3 or true, or of 0 itself."""
    a = component("a", "resources/L.fmu", connector(f"{variable}_in", "input", type))
    root = system("root", a, made=(connector("in", "input", type),), links=(link("in", f"a.{variable}_in", table),))
    assert last(tmp_path, package(tmp_path / "p.ssp", root, with_fmu(fmus)), "in") == shown


def test_parameters_of_a_system_connector_reach_what_it_drives(fmus, tmp_path):
    a = component("a", "resources/L.fmu", connector("D[1,1]", "parameter"), connector("u1", "input"),
                  connector("y1", "output"))  # fmt: skip
    tenfold = '<ssc:LinearTransformation factor="10"/>'
    inner = system("inner", a,
                   made=(connector("in", "input"), connector("strength", "parameter")),
                   links=(link("in", "a.u1"), link("strength", "a.D[1,1]", tenfold)))  # fmt: skip
    root = system("root", constant("c", 1.0), inner, links=(link("c.y1", "inner.in"),),
                  bindings=bindings(binding(values({"inner.strength": 0.5}))))  # fmt: skip
    path = package(tmp_path / "p.ssp", root, with_fmu(fmus))
    assert last(tmp_path, path, "inner.a.y1") == 5.0


def test_start_value_of_a_system_input(fmus, tmp_path):
    root = system("root", gain("a", 3.0), made=(connector("in", "input"),), links=(link("in", "a.u1"),),
                  bindings=bindings(binding(values({"in": 4.0}))))  # fmt: skip
    assert last(tmp_path, package(tmp_path / "p.ssp", root, with_fmu(fmus)), "a.y1") == 12.0


def test_units_of_parameters(fmus, tmp_path):
    path_fmu = native.linear(tmp_path / "with units", 2, units={"x0[1]": "m"})
    units = f"<ssv:Units>{unit('km', m=1, factor=1000)}</ssv:Units>"
    sets = parameter_set(parameter("C[1,1]", "Real", 1), parameter("x0[1]", "Real", 2.5, unit="km"), units=units)
    root = system(
        "root", component("a", "resources/L.fmu", connector("y1", "output"), bindings=bindings(binding(sets)))
    )
    assert last(tmp_path, package(tmp_path / "p.ssp", root, {"resources/L.fmu": path_fmu}), "a.y1") == 2500.0


# connections


def through(inside="", unit_out=None, unit_in=None, after="", **other):
    root = system("root", constant("c", 2.0, unit_out=unit_out), gain("a", 1.0, unit_in=unit_in),
                  links=(link("c.y1", "a.u1", inside, **other),))  # fmt: skip
    return root, after


TEMPERATURES = f"{unit('K', K=1)}{unit('degC', K=1, offset=273.15)}"
UNITS = f"<ssd:Units>{unit('m', m=1)}{unit('mm', m=1, factor=0.001)}{TEMPERATURES}</ssd:Units>"


@pytest.mark.parametrize(
    ("inside", "out", "into", "other", "expected"),
    [
        ('<ssc:LinearTransformation factor="-3" offset="1"/>', None, None, {}, -5.0),
        ("", "m", "mm", {}, 2000.0),
        ("", "K", "degC", {}, 2.0 - 273.15),
        ("", "m", "mm", {"suppressUnitConversion": "true"}, 2.0),
        ('<ssc:LinearTransformation factor="2" offset="1"/>', "m", "mm", {}, 4001.0),
        ('<ssc:LinearTransformation factor="2" offset="1"/>', "m", "mm", {"suppressUnitConversion": "true"}, 5.0),
    ],
)
def test_transformations_and_units(fmus, tmp_path, inside, out, into, other, expected):
    root, _ = through(inside, out, into, **other)
    path = package(tmp_path / "p.ssp", root, with_fmu(fmus), after=UNITS)
    assert last(tmp_path, path, "a.u1") == pytest.approx(expected)


def test_units_that_the_fmus_declare(fmus, tmp_path):
    a = native.linear(tmp_path / "a", 2, units={"y1": "kN"})
    b = native.linear(tmp_path / "b", 3, units={"u1": "N"})
    root = system("root", constant("c", 2.0, source="resources/A.fmu"), gain("a", 1.0, source="resources/B.fmu"),
                  links=(link("c.y1", "a.u1"),))  # fmt: skip
    path = package(tmp_path / "p.ssp", root, {"resources/A.fmu": a, "resources/B.fmu": b})
    assert last(tmp_path, path, "a.u1") == pytest.approx(2000.0)


def test_a_unit_that_the_package_only_names_is_as_the_fmu_defines_it(fmus, tmp_path):
    odd = native.linear(tmp_path / "odd", 2, units={"y1": "kN", "u1": "N"})
    root = system("root", constant("c", 2.0, unit_out="kN"), gain("a", 1.0), links=(link("c.y1", "a.u1"),))
    assert last(tmp_path, package(tmp_path / "p.ssp", root, {"resources/L.fmu": odd}), "a.u1") == pytest.approx(2000.0)


def test_turns_are_not_radians(fmus, tmp_path):
    root, _ = through("", "rpm", "rad/s")
    with pytest.raises(CosimError, match="cannot convert 'rpm' to 'rad/s'"):
        run(package(tmp_path / "p.ssp", root, with_fmu(fmus)), tmp_path / "out")


def pair(kind, type, inside="", mapped=None, value=None):
    """Two FMUs that pass a value of a type through."""
    source = bindings(binding(parameter_set(parameter(f"{kind}_in", type, value))))
    a = component("a", "resources/L.fmu", connector(f"{kind}_out", "output", type, enumeration=mapped), bindings=source)
    b = component("b", "resources/M.fmu", connector(f"{kind}_in", "input", type, enumeration=mapped))
    return system("root", a, b, links=(link(f"a.{kind}_out", f"b.{kind}_in", inside),))


@pytest.mark.parametrize("first", [1, 2, 3])
@pytest.mark.parametrize("second", [1, 2, 3])
def test_all_types_between_all_versions(fmus, tmp_path, first, second):
    files = {"resources/L.fmu": fmus[first], "resources/M.fmu": fmus[second]}
    for kind, type, value, expected in (
        ("integer", "Integer", -7, -7), ("boolean", "Boolean", "true", 1), ("string", "String", "äöü", "äöü"),
        ("item", "Enumeration", "green", 2),
    ):  # fmt: skip
        mapped = "Colour" if type == "Enumeration" else None
        path = package(tmp_path / f"{kind}.ssp", pair(kind, type, mapped=mapped, value=value), files, after=COLOURS)
        assert last(tmp_path, path, f"b.{kind}_out") == expected


def test_mappings_on_connections(fmus, tmp_path):
    files = {"resources/L.fmu": fmus[2], "resources/M.fmu": fmus[3]}
    for kind, type, value, inside, expected in (
        ("integer", "Integer", 3, '<ssc:IntegerMappingTransformation><ssc:MapEntry source="3" target="4"/>'
         "</ssc:IntegerMappingTransformation>", 4),
        ("boolean", "Boolean", "true", '<ssc:BooleanMappingTransformation><ssc:MapEntry source="true" target="false"/>'
         "</ssc:BooleanMappingTransformation>", 0),
        ("item", "Enumeration", "green",
         '<ssc:EnumerationMappingTransformation><ssc:MapEntry source="green" target="red"/>'
         "</ssc:EnumerationMappingTransformation>", 1),
    ):  # fmt: skip
        mapped = "Colour" if type == "Enumeration" else None
        path = package(tmp_path / f"{kind}.ssp", pair(kind, type, inside, mapped, value), files, after=COLOURS)
        if kind == "boolean":  # the start value of b, false, is not in the table; a's true comes first
            assert last(tmp_path, path, "b.boolean_out") == expected
        else:
            assert last(tmp_path, path, f"b.{kind}_out") == expected


def test_integers_may_drive_reals_but_not_the_other_way(fmus, tmp_path):
    one = bindings(binding(parameter_set(parameter("integer_in", "Integer", 5))))
    a = component("a", "resources/L.fmu", connector("integer_out", "output", "Integer"), bindings=one)
    root = system("root", a, gain("b", 2.0), links=(link("a.integer_out", "b.u1"),))
    assert last(tmp_path, package(tmp_path / "p.ssp", root, with_fmu(fmus)), "b.y1") == 10.0
    a = component("a", "resources/L.fmu", connector("integer_in", "input", "Integer"))
    root = system("root", constant("c", 1.0), a,
                  links=(link("c.y1", "a.integer_in"),))  # fmt: skip
    with pytest.raises(CosimError, match=r"'c.y1' is Real, 'a.integer_in' is Integer: these types do not fit"):
        run(package(tmp_path / "q.ssp", root, with_fmu(fmus)), tmp_path / "out")


def test_arrays_wide_integers_and_single_precision_of_fmi_3(fmus, tmp_path):
    given = bindings(binding(parameter_set(parameter("wide_in", "Int64", 2**62 + 1),
                                           parameter("single_in", "Float32", 0.5),
                                           '<ssv:Parameter name="array_in"><ssv:Float64 value="1 2 3"/><ssc:Dimension '
                                           'size="3"/></ssv:Parameter>', version="2.0")))  # fmt: skip
    a = component("a", "resources/L.fmu", *(connector(f"{k}_out", "output", t) for k, t in
                                            (("wide", "Int64"), ("single", "Float32"), ("array", "Float64"))),
                  bindings=given)  # fmt: skip
    b = component("b", "resources/L.fmu", *(connector(f"{k}_in", "input", t) for k, t in
                                            (("wide", "Int64"), ("single", "Float32"),
                                             ("array", "Float64"))))  # fmt: skip
    root = system("root", a, b, links=tuple(link(f"a.{k}_out", f"b.{k}_in") for k in ("wide", "single", "array")))
    path = package(tmp_path / "p.ssp", root, with_fmu(fmus, 3), version="2.0")
    frame = run(path, tmp_path / "out").frame()
    assert frame["b.wide_out"].iloc[-1] == 2**62 + 1  # more than a double can hold
    assert frame["b.single_out"].iloc[-1] == 0.5
    assert frame[[f"b.array_out[{k}]" for k in (1, 2, 3)]].iloc[-1].tolist() == [1.0, 2.0, 3.0]


# what an input is when several say so, or nobody


def test_an_input_that_nobody_gives_a_value_leaves_start_values_alone(fmus, tmp_path):
    root = with_input(inner=binding(values({"u1": 4.0})))
    frame = run(package(tmp_path / "p.ssp", root, with_fmu(fmus)), tmp_path / "out").frame()
    assert frame["a.y1"].tolist() == [12.0] * len(frame)


def test_a_name_of_the_system_is_meant_before_that_of_a_component(fmus, tmp_path):
    path = package(tmp_path / "p.ssp", with_input(name="u1"), with_fmu(fmus))
    assert last(tmp_path, path, "a.y1", changes=(("u1", "4"),)) == 12.0


def test_stimuli_win_over_bindings_from_the_start(fmus, tmp_path):
    root = with_input(bindings=bindings(binding(values({"in": 5.0}))))
    (tmp_path / "s.csv").write_text("time,in\n0,1\n1,1\n")
    path = package(tmp_path / "p.ssp", root, with_fmu(fmus))
    frame = run(path, tmp_path / "out", Options(stimuli=tmp_path / "s.csv")).frame()
    assert frame["a.y1"].tolist() == [3.0] * len(frame)


@pytest.mark.parametrize("value", ["abc", "nan", ""])
def test_wrong_values_of_system_inputs(fmus, tmp_path, value):
    path = package(tmp_path / "p.ssp", with_input(), with_fmu(fmus))
    with pytest.raises(CosimError, match="not a value of the system's input 'in'"):
        run(path, tmp_path / "out", Options(changes=(("in", value),)))


def test_an_array_does_not_spill_into_other_inputs(fmus, tmp_path):
    three = '<ssv:Parameter name="in"><ssv:Real value="7 8 9"/><ssc:Dimension size="3"/></ssv:Parameter>'
    root = with_input(connector("other", "input"), bindings=bindings(binding(parameter_set(three, version="2.0"))))
    with pytest.raises(CosimError, match="has 1 values, not 3"):
        run(package(tmp_path / "p.ssp", root, with_fmu(fmus), version="2.0"), tmp_path / "out")


def test_annotations_and_meta_data_are_ignored_everywhere(fmus, tmp_path):
    note = '<ssv:Annotations><ssc:Annotation type="x.y"><z xmlns="z"/></ssc:Annotation></ssv:Annotations>'
    sets = parameter_set(parameter("D[1,1]", "Real", 2)).replace("</ssv:ParameterSet>", f"{note}</ssv:ParameterSet>")
    path = package(tmp_path / "p.ssp", gain_with(binding(sets)), with_fmu(fmus))
    assert last(tmp_path, path, "a.y1") == 2.0


def test_a_system_parameter_reaches_components_without_connectors(fmus, tmp_path):
    a = component("a", "resources/L.fmu")
    root = system("root", constant("c", 1.0), a, made=(connector("g", "parameter"),),
                  links=(link("c.y1", "a.u1"), link("g", "a.D[1,1]")),
                  bindings=bindings(binding(values({"g": 6.0}))))  # fmt: skip
    assert last(tmp_path, package(tmp_path / "p.ssp", root, with_fmu(fmus)), "a.y1") == 6.0


def test_connected_arrays_on_the_command_line(fmus, tmp_path, capsys):
    a, b = (component(n, "resources/L.fmu", connector(f"array_{way}", kind, "Float64"))
            for n, way, kind in (("a", "out", "output"), ("b", "in", "input")))  # fmt: skip
    root = system("root", a, b, links=(link("a.array_out", "b.array_in"),))
    path = package(tmp_path / "p.ssp", root, with_fmu(fmus, 3), version="2.0")
    for method in ("gauss-seidel", "extrapolation"):
        options = ["--out", str(tmp_path / "out"), "--no-plot", "--record", "b.array_out", "--method", method]
        assert main([str(path), *options]) == 0
    assert "a.array_out[1]" in capsys.readouterr().out
    columns = list(pandas.read_csv(tmp_path / "out" / "results.csv"))
    assert columns == ["time", *(f"b.array_out[{k}]" for k in (1, 2, 3))]


@pytest.mark.parametrize(
    ("links", "message"),
    [
        ((link("a.nosuch", "b.D[1,1]"),), "has no variable 'nosuch'"),
        ((link("a.string_out", "b.D[1,1]"),), "changes during a run and cannot drive the parameter"),
    ],
)
def test_connections_to_parameters_are_checked_before_anything_is_loaded(fmus, tmp_path, links, message):
    root = system("root", component("a", "resources/L.fmu"), component("b", "resources/L.fmu"), links=links)
    with pytest.raises(CosimError, match=message):
        run(package(tmp_path / "p.ssp", root, with_fmu(fmus)), tmp_path / "out")


def test_a_source_that_is_no_uri(fmus, tmp_path):
    with pytest.raises(CosimError, match="is not a URI"):
        run(package(tmp_path / "p.ssp", system("root", component("a", "//[x")), with_fmu(fmus)), tmp_path / "out")


# what is refused


@pytest.mark.parametrize(
    ("root", "message"),
    [
        (system("root", gain("a", 1.0, implementation="ModelExchange")), "asks for ModelExchange"),
        (system("root", component("a", "resources/L.fmu", type="text/x-python")), "type 'text/x-python'"),
        (system("root", '<ssd:Component name="a"/>'), "component 'a' has no source"),
        (system("root", gain("a", 1.0), links=(link("a.y1", "a.u1", startIndices="1", endIndices="1"),)),
         "'a.u1' is no array, but indices are given for it"),
        (system("root", gain("a", 1.0), links=(link("a.y1", "b.u1"),)), "there is no component 'b'"),
        (system("root", gain("a", 1.0), links=(link("a.y1", "a.y1"),)), "are the same"),
        (system("root", gain("a", 1.0), gain("b", 1.0), links=(link("a.y1", "b.u1"), link("b.y1", "b.u1"))),
         "already driven by the connection in line"),
        (system("root", gain("a", 1.0), '<ssd:Gadget name="g"/>'), "<Gadget> inside <Elements> is not supported"),
    ],
)  # fmt: skip
def test_what_is_not_supported_is_refused_by_name(fmus, tmp_path, root, message):
    with pytest.raises(CosimError) as error:
        run(package(tmp_path / "p.ssp", root, with_fmu(fmus), version="2.0"), tmp_path / "out")
    assert message in str(error.value)
    assert "SystemStructure.ssd, line" in str(error.value)
    assert "\n" not in str(error.value)
