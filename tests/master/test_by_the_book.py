"""What the standards allow though few tools write it, and what they rule out: each with a number worked out by hand."""

from __future__ import annotations

import json

import pytest
from deepsea_cosim.core.errors import CosimError
from deepsea_cosim.master.simulation.check import check
from deepsea_cosim.master.simulation.run import Options, run
from deepsea_cosim.master.slaves.fmu import describe

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
    package,
    parameter,
    parameter_set,
    system,
    unit,
    values,
)
from .parts import constant, gain, last, redescribed, with_fmu

pytestmark = pytest.mark.skipif(native.compiler is None, reason="there is no C compiler here")

UNITS = f"<ssd:Units>{unit('m', m=1)}{unit('mm', m=1, factor=0.001)}{unit('km', m=1, factor=1000)}</ssd:Units>"


@pytest.fixture(scope="module")
def metres(tmp_path_factory):
    """The linear FMU of FMI 2.0 whose first input is in m."""
    return native.linear(tmp_path_factory.mktemp("metres"), 2, units={"u1": "m"})


def mapped(given, *entries, **other):
    """A binding of values behind a mapping."""
    return bindings(binding(given, f"<ssd:ParameterMapping>{mapping_file(*entries)}</ssd:ParameterMapping>", **other))


def told(path, **options):
    """What a run and a check warn of."""
    warnings = run(path, path.with_suffix(".out"), Options(**options)).summary["warnings"]
    assert set(warnings) <= set(check(path, Options(**options)).warnings)
    return warnings


# inputs of the whole system


@pytest.mark.parametrize(
    ("own", "inner", "expected"),
    [
        (connector("in", "input"), connector("u1", "input"), 5000.0),  # in m, as the FMU says
        (connector("in", "input", None), connector("u1", "input"), 5000.0),
        (connector("in", "input"), connector("u1", "input", unit="mm"), 5e6),  # in mm, as its connector says
        (connector("in", "input", unit="mm"), connector("u1", "input"), 5000.0),
    ],
)
def test_an_input_without_unit_has_that_of_what_it_leads_to(metres, tmp_path, own, inner, expected):
    km = bindings(binding(parameter_set(parameter("in", "Real", 5, unit="km"), units=UNITS.replace("ssd:", "ssv:"))))
    a = component("a", "resources/L.fmu", inner)
    root = system("root", a, made=(own,), links=(link("in", "a.u1"),), bindings=km)
    path = package(tmp_path / "p.ssp", root, {"resources/L.fmu": metres}, after=UNITS)
    assert last(tmp_path, path, "a.u1") == pytest.approx(expected)


def test_an_input_without_unit_that_leads_to_two_says_which_is_taken(metres, tmp_path):
    a, b = (component(n, "resources/L.fmu", connector("u1", "input", unit=u)) for n, u in (("a", "mm"), ("b", "km")))
    root = system("root", a, b, made=(connector("in", "input"),), links=(link("in", "a.u1"), link("in", "b.u1")))
    path = package(tmp_path / "p.ssp", root, {"resources/L.fmu": metres}, after=UNITS)
    frame = run(path, tmp_path / "out", Options(changes=(("in", "2000000"),))).frame()
    assert (frame["a.u1"].iloc[-1], frame["b.u1"].iloc[-1]) == pytest.approx((2e6, 2.0))
    assert any("leads to mm, km; taken to be in mm" in text for text in told(path))


def test_an_input_has_the_items_of_what_it_leads_to(fmus, tmp_path):
    green = bindings(binding(parameter_set(parameter("in", "Enumeration", "green"))))
    a = component("a", "resources/L.fmu", connector("item_in", "input", "Enumeration", enumeration="Colour"))
    root = system(
        "root", a, made=(connector("in", "input", "Enumeration", enumeration="Colour"),),
        links=(link("in", "a.item_in"),), bindings=green,
    )  # fmt: skip
    assert last(tmp_path, package(tmp_path / "p.ssp", root, with_fmu(fmus)), "a.item_out") == 2


def test_an_input_cannot_drive_a_parameter(fmus, tmp_path):
    a = component("a", "resources/L.fmu", connector("D[1,1]", "parameter"))
    root = system("root", a, made=(connector("in", "input"),), links=(link("in", "a.D[1,1]"),))
    path = package(tmp_path / "p.ssp", root, with_fmu(fmus))
    with pytest.raises(CosimError, match=r"the input 'in' cannot drive the parameter 'a\.D\[1,1\]'"):
        run(path, tmp_path / "out")
    assert any("cannot drive the parameter" in text for text in check(path).errors)


def test_an_output_that_would_show_a_parameter_is_refused(fmus, tmp_path):
    made = connector("p", "parameter"), connector("o", "output")
    root = system("root", gain("a", 1.0), made=made, links=(link("p", "o"),))
    path = package(tmp_path / "p.ssp", root, with_fmu(fmus))
    with pytest.raises(CosimError, match="'o' would show 'p', a parameter"):
        run(path, tmp_path / "out")
    assert check(path).errors


@pytest.mark.parametrize("kind", ["inout", "unspecified"])
def test_a_connector_of_any_kind_that_is_driven_is_an_output(fmus, tmp_path, kind):
    root = system("root", constant("a", 4.0), made=(connector("o", kind),), links=(link("a.y1", "o"),))
    assert last(tmp_path, package(tmp_path / "p.ssp", root, with_fmu(fmus), version="2.0"), "o") == 4.0


@pytest.mark.parametrize("sizes", [(10**12,), (2**40, 2**40)])
def test_an_array_that_no_memory_holds_is_refused(fmus, tmp_path, sizes):
    big = connector("in", "input").replace("</", "".join(f'<ssc:Dimension size="{n}"/>' for n in sizes) + "</")
    path = package(tmp_path / "p.ssp", system("root", gain("a", 1.0), made=(big,)), with_fmu(fmus), version="2.0")
    with pytest.raises(CosimError, match="values; refused"):
        run(path, tmp_path / "out")
    assert any("refused" in text for text in check(path).errors)


# parameters


def test_with_a_mapping_only_what_it_names_is_applied(fmus, tmp_path):
    bound = mapped(values({"g": 3.0, "x0[1]": 7.0, "C[1,1]": 1.0}), entry("g", "D[1,1]"))
    a = component("a", "resources/L.fmu", connector("u1", "input"), connector("y1", "output"), bindings=bound)
    path = package(tmp_path / "p.ssp", system("root", a), with_fmu(fmus))
    assert last(tmp_path, path, "a.y1", changes=(("a.u1", "2"),)) == 6.0
    assert any("the mapping does not name them: x0[1], C[1,1]" in text for text in told(path))


def test_empty_sources_are_none(fmus, tmp_path):
    through = mapped(values({"g": 3.0}), entry("g", "D[1,1]"), entry("", "x0[1]"))
    empty = through.replace("<ssd:ParameterMapping>", '<ssd:ParameterMapping source="">')
    for k, bound in enumerate((bindings(binding(values({"D[1,1]": 3.0}), source="")), through, empty)):
        a = component("a", "resources/L.fmu", connector("u1", "input"), connector("y1", "output"), bindings=bound)
        path = package(tmp_path / f"{k}.ssp", system("root", a), with_fmu(fmus))
        assert last(tmp_path, path, "a.y1", changes=(("a.u1", "2"),)) == 6.0


def test_two_parameters_mapped_to_one_are_told(fmus, tmp_path):
    bound = mapped(values({"g": 3.0, "h": 4.0}), entry("g", "D[1,1]"), entry("h", "D[1,1]"))
    a = component("a", "resources/L.fmu", connector("u1", "input"), connector("y1", "output"), bindings=bound)
    assert any("both mapped to" in t for t in told(package(tmp_path / "p.ssp", system("root", a), with_fmu(fmus))))


def test_a_name_that_means_several_variables_sets_all_of_them(fmus, tmp_path):
    """SSP 2.0, ParameterBindings: 'tank.valve.k' is valve.k of tank, k of tank.valve, and the system's connector."""
    v = redescribed(fmus[2], tmp_path / "V.fmu", ('name="D[1,1]"', 'name="valve.k"'))
    k = redescribed(fmus[2], tmp_path / "K.fmu", ('name="D[1,1]"', 'name="k"'))
    pair = connector("u1", "input"), connector("y1", "output")
    for name, inner, sizes in (("one", "resources/L.fmu", (6.0, 0.0)), ("both", "resources/K.fmu", (6.0, 6.0))):
        root = system(
            "root", component("tank", "resources/V.fmu", *pair), component("tank.valve", inner, *pair),
            made=(connector("tank.valve.k", "parameter"),), bindings=bindings(binding(values({"tank.valve.k": 3.0}))),
        )  # fmt: skip
        path = package(tmp_path / f"{name}.ssp", root, {**with_fmu(fmus), "resources/V.fmu": v, "resources/K.fmu": k})
        frame = run(path, tmp_path / "out", Options(changes=(("tank.u1", "2"), ("tank.valve.u1", "2")))).frame()
        assert (frame["tank.y1"].iloc[-1], frame["tank.valve.y1"].iloc[-1]) == sizes
        assert not told(path)
        mine = tmp_path / "mine.ssv"
        mine.write_text(parameter_set(parameter("tank.valve.k", "Real", 4)))
        assert last(tmp_path, path, "tank.y1", parameters=(mine,), changes=(("tank.u1", "2"),)) == 8.0


def test_what_cannot_be_set_is_told_and_ignored(fmus, tmp_path):
    path = package(
        tmp_path / "p.ssp", system("root", gain("a", 1.0), bindings=bindings(binding(values({"a.y1": 99.0})))),
        with_fmu(fmus),
    )  # fmt: skip
    assert any("'a.y1' cannot be set" in text and "ignored" in text for text in told(path))
    with pytest.raises(CosimError, match="cannot be set"):
        run(path, tmp_path / "out", Options(changes=(("a.y1", "99"),)))


@pytest.mark.parametrize("name", ["[m]", "None"])
def test_units_that_tools_write(metres, tmp_path, name):
    bound = bindings(binding(parameter_set(parameter("u1", "Real", 5, unit=name))))
    path = package(tmp_path / "p.ssp", system("root", component("a", "resources/L.fmu", bindings=bound)),
                   {"resources/L.fmu": metres})  # fmt: skip
    assert last(tmp_path, path, "a.u1") == 5.0


# transformations


@pytest.mark.parametrize(
    ("kind", "type", "pair", "given", "expected"),
    [
        ("Integer", "integer", ("5", "50"), "5", 50),
        ("Integer", "integer", ("5", "50"), "7", 7),
        ("Boolean", "boolean", ("true", "false"), "false", 0),
        ("Boolean", "boolean", ("true", "false"), "true", 0),
        ("Enumeration", "item", ("red", "blue"), "red", 3),
        ("Enumeration", "item", ("red", "blue"), "green", 2),
    ],
)
def test_what_a_mapping_does_not_name_is_kept(fmus, tmp_path, kind, type, pair, given, expected):
    """SSC: partial mappings; on a connection, and of a parameter."""
    tag = f"ssc:{kind}MappingTransformation"
    inside = f'<{tag}><ssc:MapEntry source="{pair[0]}" target="{pair[1]}"/></{tag}>'
    ends = (connector(f"{type}_in", "input", kind), connector(f"{type}_out", "output", kind))
    a, b = (component(name, "resources/L.fmu", *ends) for name in "ab")
    root = system("root", a, b, links=(link(f"a.{type}_out", f"b.{type}_in", inside),))
    path = package(tmp_path / "p.ssp", root, with_fmu(fmus))
    assert last(tmp_path, path, f"b.{type}_out", changes=((f"a.{type}_in", given),)) == expected
    bound = mapped(parameter_set(parameter("p", kind, given)), entry("p", f"{type}_in", inside))
    root = system("root", component("a", "resources/L.fmu", bindings=bound))
    assert last(tmp_path, package(tmp_path / "q.ssp", root, with_fmu(fmus)), f"a.{type}_out") == expected


# units at borders


def dictionary(**references):
    """A dictionary `bus` with the entry s in m, and references to it whose connectors have units of their own."""
    made = [
        f'<ssd:SignalDictionaryReference name="{name}" dictionary="bus"><ssd:Connectors>'
        f'{connector("s", kind, unit=u)}</ssd:Connectors></ssd:SignalDictionaryReference>'
        for name, (kind, u) in references.items()
    ]
    entries = '<ssb:DictionaryEntry name="s"><ssc:Real unit="m"/></ssb:DictionaryEntry>'
    entries += f"<ssb:Units>{unit('m', m=1)}</ssb:Units>"
    bus = (
        '<ssd:SignalDictionaries><ssd:SignalDictionary name="bus"><ssb:SignalDictionary version="1.0">'
        f"{entries}</ssb:SignalDictionary></ssd:SignalDictionary></ssd:SignalDictionaries>"
    )
    return made, bus


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize(
    ("references", "through", "expected"),
    [
        ({"R": ("inout", "mm")}, ("R", "R"), 2000.0),
        ({"R1": ("input", "mm"), "R2": ("output", "m")}, ("R1", "R2"), 2.0),
        ({"R1": ("input", "m"), "R2": ("output", "mm")}, ("R1", "R2"), 2e6),
    ],
)
def test_references_to_a_dictionary_convert(fmus, tmp_path, references, through, expected, turned):
    made, bus = dictionary(**references)
    a = component("a", "resources/L.fmu", connector("u1", "input"))
    links = (link("c.y1", f"{through[0]}.s"), link(f"{through[1]}.s", "a.u1"))
    root = system("root", constant("c", 2000.0), a, *made, links=links[::-1] if turned else links, dictionaries=bus)
    path = package(tmp_path / "p.ssp", root, with_fmu(fmus), after=UNITS)
    assert last(tmp_path, path, "a.u1") == pytest.approx(expected)


def test_a_reference_in_another_quantity_is_refused(fmus, tmp_path):
    made, bus = dictionary(R1=("input", "K"), R2=("output", "m"))
    links = (link("c.y1", "R1.s"), link("R2.s", "a.u1"))
    root = system("root", constant("c", 1.0), gain("a", 1.0), *made, links=links, dictionaries=bus)
    with pytest.raises(CosimError, match="different quantities"):
        run(package(tmp_path / "p.ssp", root, with_fmu(fmus)), tmp_path / "out")


@pytest.mark.parametrize(
    ("outside", "inside", "expected"), [("mm", "m", 2.0), ("m", "mm", 2e6), ("mm", "mm", 2000.0), ("m", "km", 2.0)]
)
def test_a_description_inside_may_have_other_units_than_its_component(fmus, tmp_path, outside, inside, expected):
    """2000 of the outer unit reach a variable without a unit as what they are inside; and back the same way."""
    made = (connector("in", "input", unit=inside), connector("out", "output", unit=inside))
    inner = system("s", gain("a", 1.0), made=made, links=(link("in", "a.u1"), link("a.y1", "out")))
    ends = (connector("in", "input", unit=outside), connector("out", "output", unit=outside))
    sub = component("S", "sub.ssd", *ends)  # without a type: an .ssd by its name
    root = system(
        "root", constant("c", 2000.0, unit_out=outside), sub, made=(connector("o", "output"),),
        links=(link("c.y1", "S.in"), link("S.out", "o")),
    )  # fmt: skip
    files = {**with_fmu(fmus), "sub.ssd": description(inner, after=UNITS)}
    frame = run(package(tmp_path / "p.ssp", root, files, after=UNITS), tmp_path / "out").frame()
    assert frame["S.a.u1"].iloc[-1] == pytest.approx(expected)
    assert frame["o"].iloc[-1] == pytest.approx(2000.0)


# arrays


def sized(name, kind, type, inside):
    return connector(name, kind, type).replace("</", f"{inside}</")


@pytest.mark.parametrize(
    ("made", "message"),
    [
        (sized("array_in", "input", "Float64", '<ssc:Dimension size="5"/>'), "is 5, its FMU's variable has 3 values"),
        (sized("array_in", "input", "Float64", '<ssc:Dimension sizeConnector="n"/>'), "'n' is not a connector"),
        (sized("array_in", "input", "Float64", '<ssc:Dimension size="3" sizeConnector="array_in"/>'), "not both"),
    ],
)
def test_dimensions_have_to_fit(fmus, tmp_path, made, message):
    path = package(tmp_path / "p.ssp", system("root", component("a", "resources/L.fmu", made)), with_fmu(fmus, 3),
                   version="2.0")  # fmt: skip
    with pytest.raises(CosimError, match=message):
        run(path, tmp_path / "out")
    assert any(message in text for text in check(path).errors)


def test_values_have_to_fill_their_dimensions(fmus, tmp_path):
    given = parameter("array_in", "Float64", "1 2 3")
    given = given.replace("</ssv:Parameter>", '<ssc:Dimension size="2"/></ssv:Parameter>')
    bound = bindings(binding(parameter_set(given, version="2.0")))
    path = package(tmp_path / "p.ssp", system("root", component("a", "resources/L.fmu", bindings=bound)),
                   with_fmu(fmus, 3), version="2.0")  # fmt: skip
    with pytest.raises(CosimError, match="3 values do not fill the dimensions of 2"):
        run(path, tmp_path / "out")


def test_several_values_without_a_dimension_are_an_array(fmus, tmp_path):
    """The schema of SSP 2.0 lets them pass; a variable that is none has one value."""

    def path(name):
        given = f'<ssv:Parameter name="{name}"><ssv:Float64 value="1 2 3"/></ssv:Parameter>'
        a = component("a", "resources/L.fmu", bindings=bindings(binding(parameter_set(given, version="2.0"))))
        return package(tmp_path / "p.ssp", system("root", a), with_fmu(fmus, 3), version="2.0")

    told = "parameter 'array_in' has 3 values and no <ssc:Dimension>; taken for an array"
    result = run(path("array_in"), tmp_path / "out")
    assert result.frame()["a.array_out[3]"].iloc[-1] == 3.0
    assert any(told in warning for warning in result.summary["warnings"])
    assert any(told in error for error in check(path("array_in")).errors)
    with pytest.raises(CosimError):
        run(path("u1"), tmp_path / "out")


def test_a_size_cannot_be_driven(fmus, tmp_path):
    size = '<ssd:Connector name="size" kind="structuralParameter"><ssc:UInt64/></ssd:Connector>'
    c = redescribed(fmus[3], tmp_path / "C.fmu", (
        '<Int32 name="integer_out" valueReference="501" causality="output" variability="discrete">',
        '<Int32 name="integer_out" valueReference="501" causality="local" variability="constant" start="4">',
    ))  # fmt: skip
    one = '<ssd:Connector name="integer_out" kind="constant"><ssc:Int32/></ssd:Connector>'
    root = system("root", component("c", "resources/C.fmu", one), component("a", "resources/L.fmu", size),
                  links=(link("c.integer_out", "a.size"),))  # fmt: skip
    path = package(tmp_path / "p.ssp", root, {**with_fmu(fmus, 3), "resources/C.fmu": c}, version="2.0")
    with pytest.raises(CosimError, match=r"'a\.size' gives arrays their size and cannot be driven"):
        run(path, tmp_path / "out")


# model descriptions


@pytest.mark.parametrize(
    ("version", "change"),
    [
        (2, ('dependencies="1 2 3', 'dependencies="1  2 3')),
        (3, ('dependencies="0 1 2', 'dependencies=" 0  1 2')),
        (2, ('<SimpleType name="Colour">', '<SimpleType name="Colour"><!-- of things -->')),
        (3, ("<TypeDefinitions>", '<TypeDefinitions><BinaryType name="osi" mimeType="application/x" maxSize="10"/>')),
    ],
)
def test_model_descriptions_that_are_valid_are_read(fmus, tmp_path, version, change):
    fmu = redescribed(fmus[version], tmp_path / "X.fmu", change)
    assert last(tmp_path, package(tmp_path / "p.ssp", system("root", gain("a", 2.0)), {"resources/L.fmu": fmu}),
                "a.y1", changes=(("a.u1", "3"),)) == 6.0  # fmt: skip


def test_a_clock_of_a_declared_type_that_nothing_uses_does_no_harm(fmus, tmp_path):
    told = 'intervalVariability="constant" intervalDecimal="0.1"'
    fmu = redescribed(
        fmus[3], tmp_path / "X.fmu",
        ("<TypeDefinitions>", f'<TypeDefinitions><ClockType name="ck" {told}/>'),
        ('<Float64 name="time"', f'<Clock name="clk" valueReference="1500" causality="input" variability="discrete" '
         f'declaredType="ck" {told}/><Float64 name="time"'),
    )  # fmt: skip
    path = package(tmp_path / "p.ssp", system("root", gain("a", 2.0)), {"resources/L.fmu": fmu})
    assert last(tmp_path, path, "a.y1", changes=(("a.u1", "3"),)) == 6.0
    warnings = json.loads((tmp_path / "out" / "summary.json").read_text())["warnings"]
    assert [w for w in warnings if "'a' has clocks ('clk'); none is ticked" in w]


CLOCK = '<ssd:Connector name="clk" kind="input"><ssc:Clock/></ssd:Connector>'
TICKED = '<ssd:Connector name="u2" kind="input"><ssc:Float64/><ssd:Clock name="clk"/></ssd:Connector>'


def ticked(fmus, tmp_path, *links):
    """2 x 3 by an FMU with a clock, which the package lists, on a system that has one too."""
    fmu = redescribed(fmus[3], tmp_path / "K.fmu", (
        '<Float64 name="time"', '<Clock name="clk" valueReference="1500" causality="input" variability="discrete" '
        'intervalVariability="triggered"/><Float64 name="time"'))  # fmt: skip
    root = system("root", constant("c", 3.0), gain("a", 2.0, CLOCK, TICKED), made=(CLOCK,),
                  links=(link("c.y1", "a.u1"), *links))  # fmt: skip
    return package(tmp_path / "p.ssp", root, {"resources/L.fmu": fmu}, version="2.0")


def test_clocks_that_nothing_is_connected_to_do_no_harm(fmus, tmp_path):
    path = ticked(fmus, tmp_path)
    assert not check(path).errors
    assert last(tmp_path, path, "a.y1") == 6.0
    assert "clk" not in run(path, tmp_path / "out").frame().columns


@pytest.mark.parametrize("ends", [("clk", "a.clk"), ("c.y1", "a.u2")])
def test_connected_clocks_are_refused(fmus, tmp_path, ends):
    with pytest.raises(CosimError, match="is a clock or belongs to one; connected clocks are not supported"):
        run(ticked(fmus, tmp_path, link(*ends)), tmp_path / "out")


@pytest.mark.parametrize("kind", ["output", "calculatedParameter"])
def test_an_output_of_fmi_1_that_does_not_change(fmus, tmp_path, kind):
    old = '<ScalarVariable name="y1" valueReference="10" causality="output" variability="continuous">'
    fmu = redescribed(fmus[1], tmp_path / "X.fmu", (old, old.replace("continuous", "parameter")))
    a = component("a", "resources/L.fmu", connector("y1", kind),
                  bindings=bindings(binding(values({"C[1,1]": 1.0, "x0[1]": 2.0}))))  # fmt: skip
    root = system("root", a, made=(connector("o", kind),), links=(link("a.y1", "o"),))
    assert last(tmp_path, package(tmp_path / "p.ssp", root, {"resources/L.fmu": fmu}), "o") == 2.0


def test_arrays_of_texts_start_with_all_their_values(fmus, tmp_path):
    fmu = redescribed(fmus[3], tmp_path / "X.fmu", (
        '<Float64 name="time"',
        '<String name="words" valueReference="1600" causality="parameter" variability="fixed"><Dimension start="2"/>'
        '<Start value="a"/><Start value="b"/></String><Float64 name="time"',
    ))  # fmt: skip
    assert describe("a", fmu).start("words") == ("a", "b")


@pytest.mark.parametrize("reference", ["-1", "99999999999"])
def test_a_value_reference_that_is_none_is_refused(fmus, tmp_path, reference):
    old = 'valueReference="1" causality="input"'
    fmu = redescribed(fmus[2], tmp_path / "X.fmu", (old, old.replace('"1"', f'"{reference}"')))
    path = package(tmp_path / "p.ssp", system("root", gain("a", 2.0)), {"resources/L.fmu": fmu})
    assert any("it has to fit 32 bits" in text for text in check(path).errors)


def test_an_own_step_that_is_no_number_is_refused(fmus, tmp_path):
    able = "canGetAndSetFMUState"
    fmu = redescribed(fmus[3], tmp_path / "X.fmu", (able, f'fixedInternalStepSize="abc" {able}'))
    path = package(tmp_path / "p.ssp", system("root", gain("a", 2.0)), {"resources/L.fmu": fmu})
    assert any("cannot be read" in text for text in check(path).errors)


# packages


def test_long_annotations_and_zeros_are_no_attack(fmus, tmp_path):
    deep = "<x>" * 300 + "a" * 11_000_000 + "</x>" * 300
    note = f'<ssd:Annotations><ssc:Annotation type="x.y">{deep}</ssc:Annotation></ssd:Annotations>'
    root = system("root", constant("a", 2.0)).replace("</ssd:System>", f"{note}</ssd:System>")
    path = package(tmp_path / "p.ssp", root, {**with_fmu(fmus), "extra/table.bin": bytes(3_000_000)})
    assert last(tmp_path, path, "a.y1") == 2.0


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"source": "resources"}, "'resources' is a folder; an FMU is a zip archive"),
        ({"source": ""}, "has no source"),
        ({"source": "resources/L.fmu", "type": "application/x-ssp-definition"}, "is no .ssd, as its type"),
    ],
)
def test_sources_that_are_something_else(fmus, tmp_path, given, message):
    source = given.pop("source")
    path = package(tmp_path / "p.ssp", system("root", component("a", source, **given)), with_fmu(fmus))
    with pytest.raises(CosimError, match=message):
        run(path, tmp_path / "out")


@pytest.mark.parametrize("isolate", [False, True])
def test_strings_are_read_where_somebody_wants_them(fmus, tmp_path, monkeypatch, isolate):
    """Each reading is a call of Python, eight times what the rest of a step takes."""
    seen = []
    kind = type(describe("a", fmus[2]))
    exchange = kind.exchange_texts
    monkeypatch.setattr(kind, "exchange_texts", lambda *of: (seen.append(of[1]), exchange(*of))[1])
    ends = connector("string_in", "input", "String"), connector("string_out", "output", "String")
    given = bindings(binding(parameter_set(parameter("string_in", "String", "äöü"))))
    a = component("a", "resources/L.fmu", connector("y1", "output"), *ends, bindings=given)
    path = package(tmp_path / "p.ssp", system("root", a), with_fmu(fmus), stop=1.0, step=0.01)
    found = run(path, tmp_path / "some", Options(record=("a.y1",), isolate=isolate)).frame()
    assert "a.string_out" not in found.columns
    assert seen.count("Get") == 0
    found = run(path, tmp_path / "all", Options(isolate=isolate)).frame()
    assert set(found["a.string_out"]) == {"äöü"}
    assert isolate or seen.count("Get") >= 100

@pytest.mark.parametrize("suffix", [".csv", ".parquet", ".h5"])
def test_the_frame_has_the_same_types_whatever_the_file_is(fmus, tmp_path, suffix):
    """Booleans stand in a CSV as 1 and 0."""
    pytest.importorskip("h5py" if suffix == ".h5" else "pyarrow" if suffix == ".parquet" else "csv")
    part = gain("a", 2.0, connector("boolean_out", "output", "Boolean"), connector("boolean_in", "input", "Boolean"))
    path = package(tmp_path / "p.ssp", system("root", part), with_fmu(fmus))
    frame = run(path, tmp_path / "out", Options(changes=(("a.boolean_in", "true"),), results=f"r{suffix}")).frame()
    assert frame["a.boolean_out"].dtype == bool
    assert frame["a.boolean_out"].all()
    assert frame["a.y1"].dtype == float
