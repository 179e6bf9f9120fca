"""Items of enumerations given by name, through mappings by number or name, by hand; and what no mapping takes."""

from __future__ import annotations

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
    entry,
    link,
    mapping_file,
    package,
    parameter,
    parameter_set,
    system,
    values,
)
from .parts import gain, last, redescribed, with_fmu, with_input

pytestmark = pytest.mark.skipif(native.compiler is None, reason="there is no C compiler here")

ITEMS = """<ssd:Enumerations>
<ssc:Enumeration name="Gear"><ssc:Item name="low" value="10"/><ssc:Item name="high" value="30"/></ssc:Enumeration>
<ssc:Enumeration name="Colour"><ssc:Item name="red" value="1"/><ssc:Item name="green" value="2"/>
<ssc:Item name="blue" value="3"/></ssc:Enumeration></ssd:Enumerations>"""


def numbers(*pairs):
    inside = "".join(f'<ssc:MapEntry source="{a}" target="{b}"/>' for a, b in pairs)
    return f"<ssc:IntegerMappingTransformation>{inside}</ssc:IntegerMappingTransformation>"


def bound(kind, value, target, transformation):
    """A component whose variable is bound through a mapping."""
    ssm = mapping_file(entry("p", target, transformation))
    one = binding(parameter_set(parameter("p", kind, value)), f"<ssd:ParameterMapping>{ssm}</ssd:ParameterMapping>")
    return system("root", component("a", "resources/L.fmu", bindings=bindings(one)))


def inner(enumeration, transformation, *more):
    """A nested system whose connector g leads to a component's colours."""
    made = (connector("g", "parameter", "Enumeration", enumeration=enumeration),)
    ways = (link("g", "a.item_in", transformation),)
    return system("i", component("a", "resources/L.fmu"), made=made, links=ways)


def test_a_number_of_an_item_is_that_of_the_variable_where_the_parameter_does_not_say(fmus, tmp_path):
    path = package(tmp_path / "p.ssp", bound("Enumeration", "green", "item_in", numbers((2, 3))), with_fmu(fmus))
    assert last(tmp_path, path, "a.item_out") == 3


@pytest.mark.parametrize(
    ("enumeration", "item", "table"), [("Colour", "green", numbers((2, 3))), ("Gear", "high", numbers((30, 3)))]
)
def test_a_number_of_an_item_is_that_of_the_connector_that_it_is_given_to(fmus, tmp_path, enumeration, item, table):
    given = bindings(binding(parameter_set(parameter("i.g", "Enumeration", item))))
    root = system("root", inner(enumeration, table), bindings=given)
    path = package(tmp_path / "p.ssp", root, with_fmu(fmus), after=ITEMS)
    assert last(tmp_path, path, "i.a.item_out") == 3


def test_an_item_of_a_system_input_is_mapped_to_an_integer(fmus, tmp_path):
    made = (connector("x", "input", "Enumeration", enumeration="Colour"),)
    given = bindings(binding(parameter_set(parameter("x", "Enumeration", "blue"))))
    root = system("root", component("a", "resources/L.fmu"), made=made,
                  links=(link("x", "a.integer_in", numbers((3, 30))),), bindings=given)  # fmt: skip
    path = package(tmp_path / "p.ssp", root, with_fmu(fmus), after=ITEMS)
    assert last(tmp_path, path, "a.integer_out") == 30


@pytest.mark.parametrize(
    ("kind", "value", "target", "transformation", "why"),
    [
        ("Enumeration", "green", "u1", '<ssc:LinearTransformation factor="10" offset="1"/>', "cannot be scaled"),
        ("Enumeration", "green", "item_in", "<ssc:BooleanMappingTransformation>"
         '<ssc:MapEntry source="true" target="false"/></ssc:BooleanMappingTransformation>', "mapped as a boolean"),
        ("Boolean", "true", "integer_in", numbers((1, 5)), "is Boolean, 'a.integer_in' is Integer"),
        ("Enumeration", "green", "integer_in", numbers((2, 3)), "number of the item 'green' is not known"),
    ],
)  # fmt: skip
def test_what_no_mapping_takes_is_refused(fmus, tmp_path, kind, value, target, transformation, why):
    path = package(tmp_path / "p.ssp", bound(kind, value, target, transformation), with_fmu(fmus))
    with pytest.raises(CosimError, match=why):
        run(path, tmp_path / "out", Options())


@pytest.mark.parametrize("value", ["11", "-11"])
def test_a_value_of_a_system_input_is_in_the_range_of_what_it_reaches(fmus, tmp_path, value):
    """The FMU's integer_in takes 32 bits; 11e9 is beyond."""
    path = package(tmp_path / "p.ssp", with_input(name="u1"), with_fmu(fmus))
    assert last(tmp_path, path, "a.u1", changes=(("u1", value),)) == float(value)
    wide = component("a", "resources/L.fmu", connector("integer_in", "input", "Integer"))
    made = (connector("n", "input", "Int64"),)
    root = system("root", wide, made=made, links=(link("n", "a.integer_in"),))
    path = package(tmp_path / "w.ssp", root, with_fmu(fmus), version="2.0")
    with pytest.raises(CosimError, match=f"--set n={value}.*: a.integer_in = .* is out of range"):
        run(path, tmp_path / "out", Options(changes=(("n", f"{value}000000000"),)))


# texts


@pytest.mark.parametrize("text", ["007", "1e3", "nan", "true", " 5", "inf", ""])
@pytest.mark.parametrize("results", ["results.csv", "results.h5"])
def test_texts_in_a_frame_are_as_they_are(fmus, tmp_path, text, results):
    pytest.importorskip("h5py")
    ends = connector("string_in", "input", "String"), connector("string_out", "output", "String")
    path = package(tmp_path / "p.ssp", system("root", component("a", "resources/L.fmu", *ends)), with_fmu(fmus))
    options = Options(changes=(("a.string_in", text),), results=results)
    frame = run(path, tmp_path / "out", options).frame()
    assert frame["a.string_out"].tolist() == [text] * len(frame)
    assert frame["a.y1"].dtype == float


def test_stimuli_of_an_input_without_start_value_are_there_at_the_start(fmus, tmp_path):
    """y1 = 3 u1 at once, and inputs of FMI 1.0 need no start value."""
    told = 'name="u1" valueReference="0" causality="input" variability="continuous"><Real'
    fmu = redescribed(fmus[1], tmp_path / "N.fmu", (f'{told} start="0"', told))
    a = component("a", "resources/L.fmu", connector("u1", "input"), bindings=bindings(binding(values({"D[1,1]": 3.0}))))
    path = package(tmp_path / "p.ssp", system("root", a), {"resources/L.fmu": fmu})
    (tmp_path / "s.csv").write_text("time,a.u1\n0,2\n1,2\n")
    frame = run(path, tmp_path / "out", Options(stimuli=tmp_path / "s.csv")).frame()
    assert frame["a.y1"].tolist() == [6.0] * len(frame)


@pytest.mark.parametrize(
    ("table", "why"),
    [("time;in\n0;1\n", "columns are separated by commas, not by ;"), ("time\tin\n0\t1\n", "not by tabs"),
     ("time,in\n0,true\n", "'true' is not a number"), ("time,in\n0,1_0\n", "'1_0' is not a number"),
     ("time,in,in\n0,1,2\n", "column 'in' stands twice")],
)  # fmt: skip
def test_what_is_wrong_with_stimuli_is_told(fmus, tmp_path, table, why):
    (tmp_path / "s.csv").write_text(table)
    path = package(tmp_path / "p.ssp", with_input(), with_fmu(fmus))
    with pytest.raises(CosimError, match=why):
        run(path, tmp_path / "out", Options(stimuli=tmp_path / "s.csv"))


# what lies between two FMUs


@pytest.mark.parametrize("kind", ["Integer", "Boolean", "String"])
def test_a_connector_between_two_fmus_takes_values_of_its_type_only(fmus, tmp_path, kind):
    ends = connector("u1", "input"), connector("y1", "output")
    inner = system("i", component("b", "resources/L.fmu", *ends), made=(connector("g", "input", kind),),
                   links=(link("g", "b.u1"),))  # fmt: skip
    root = system("root", component("a", "resources/L.fmu", *ends), inner, links=(link("a.y1", "i.g"),))
    path = package(tmp_path / "p.ssp", root, with_fmu(fmus))
    with pytest.raises(CosimError, match=f"connector 'i.g' is {kind}|'i.g'.* is {kind}"):
        run(path, tmp_path / "out", Options())


def test_a_mapping_of_integers_may_be_followed_by_a_real(fmus, tmp_path):
    """7 is mapped to 5, which a real connector takes, times 2 and 1 more."""
    a = component("a", "resources/L.fmu", connector("integer_out", "output", "Integer"),
                  connector("integer_in", "input", "Integer"))  # fmt: skip
    b = component("b", "resources/L.fmu", connector("u1", "input"), connector("y1", "output"))
    inner = system("i", b, made=(connector("g", "input", "Integer"),),
                   links=(link("g", "b.u1", '<ssc:LinearTransformation factor="2" offset="1"/>'),))  # fmt: skip
    root = system("root", a, inner, links=(link("a.integer_out", "i.g", numbers((7, 5))),))
    path = package(tmp_path / "p.ssp", root, with_fmu(fmus))
    assert last(tmp_path, path, "i.b.u1", changes=(("a.integer_in", "7"),)) == 11.0


@pytest.mark.parametrize("back", [False, True])
def test_a_connection_of_unspecified_ends_goes_to_the_one_that_nothing_else_drives(fmus, tmp_path, back):
    """y1 = 3 u1, u1 = 2 from the system's input through two connectors that do not say what they are."""
    own = bindings(binding(values({"D[1,1]": 3.0})))
    b = component("b", "resources/L.fmu", connector("u1", "input"), connector("y1", "output"), bindings=own)
    inner = system("i", b, made=(connector("g", "unspecified"),), links=(link("b.u1", "g"),))
    way = link("g", "i.g") if back else link("i.g", "g")
    outer = system("o", inner, made=(connector("g", "unspecified"),), links=(way,))
    root = system("root", outer, made=(connector("x", "input"),), links=(link("o.g", "x"),))
    path = package(tmp_path / "p.ssp", root, with_fmu(fmus))
    assert last(tmp_path, path, "o.i.b.y1", changes=(("x", "2"),)) == 6.0


def wide(size):
    """Two arrays of FMI 3.0 with a nested system's connector of a stated size before the second one."""
    ends = connector("many_in", "input", "Float64"), connector("many_out", "output", "Float64")
    made = (connector("g", "input", "Float64", sizes=size),)
    inner = system("i", component("b", "resources/L.fmu", *ends), made=made, links=(link("g", "b.many_in"),))
    return system("root", component("a", "resources/L.fmu", *ends), inner, links=(link("a.many_out", "i.g"),))


def test_a_connector_on_the_way_of_an_array_has_its_size(fmus, tmp_path):
    path = package(tmp_path / "p.ssp", wide((2,)), with_fmu(fmus, 3), version="2.0")
    assert last(tmp_path, path, "i.b.many_in[2]") == last(tmp_path, path, "a.many_out[2]")
    path = package(tmp_path / "q.ssp", wide((7,)), with_fmu(fmus, 3), version="2.0")
    with pytest.raises(CosimError, match=r"'a.many_out' has 2 values and connector 'i.g' 7"):
        run(path, tmp_path / "out", Options())
    assert "connector 'i.g' 7" in check(path).errors[0]


def test_an_output_of_the_system_has_the_size_that_it_states(fmus, tmp_path):
    a = component("a", "resources/L.fmu", connector("many_out", "output", "Float64"))
    root = system("root", a, made=(connector("y", "output", "Float64", sizes=(3,)),), links=(link("a.many_out", "y"),))
    path = package(tmp_path / "p.ssp", root, with_fmu(fmus, 3), version="2.0")
    with pytest.raises(CosimError, match=r"'a.many_out' has 2 values and connector 'y' 3"):
        run(path, tmp_path / "out", Options())


def test_an_array_of_one_value_is_an_array(fmus, tmp_path):
    a = component("a", "resources/L.fmu", connector("many_out", "output", "Float64"))
    path = package(tmp_path / "p.ssp", system("root", a), with_fmu(fmus, 3), version="2.0")
    frame = run(path, tmp_path / "out", Options(changes=(("a.size", "1"),))).frame()
    assert "a.many_out[1]" in frame.columns
    assert "a.many_out" not in frame.columns


@pytest.mark.parametrize(("kind", "value"), [("Integer", "2.5"), ("Boolean", "3"), ("Real", "x"), ("Real", "nan")])
def test_a_nested_connector_takes_values_of_its_type_only(fmus, tmp_path, kind, value):
    ends = connector("u1", "input"), connector("y1", "output")
    inner = system("i", component("b", "resources/L.fmu", *ends), made=(connector("g", "input", kind),),
                   links=(link("g", "b.u1"),))  # fmt: skip
    path = package(tmp_path / "p.ssp", system("root", inner), with_fmu(fmus))
    with pytest.raises(CosimError, match=f"--set i.g={value}: '{value}' is not a value of connector 'i.g' .one {kind}"):
        run(path, tmp_path / "out", Options(changes=(("i.g", value),)))
    if kind == "Integer":
        assert last(tmp_path, path, "i.b.u1", changes=(("i.g", "2"),)) == 2.0


def test_a_calculated_parameter_of_fmi_1_drives_a_parameter(fmus, tmp_path):
    """y2 = 5 from a state that stands still; FMI 1.0 has it after fmiInitializeSlave."""
    told = 'name="y2" valueReference="11" causality="output" variability='
    fmu = redescribed(fmus[1], tmp_path / "C.fmu", (f'{told}"continuous"', f'{told}"parameter"'))
    given = bindings(binding(values({"C[2,1]": 1.0, "x0[1]": 5.0})))
    a = component("a", "resources/C.fmu", connector("y2", "output"), bindings=given)
    b = component("b", "resources/L.fmu", connector("D[1,1]", "parameter"), connector("y1", "output"),
                  bindings=bindings(binding(values({"u1": 2.0}))))  # fmt: skip
    root = system("root", b, a, links=(link("a.y2", "b.D[1,1]"),))
    path = package(tmp_path / "p.ssp", root, {"resources/C.fmu": fmu, "resources/L.fmu": fmus[2]})
    assert last(tmp_path, path, "b.y1") == 10.0
    assert last(tmp_path, path, "b.y1", isolate=True) == 10.0


def test_places_in_a_nested_package_name_it(fmus, tmp_path):
    wrong = system("s", gain("g", 1.0), links=(link("g.y1", "g.u9"), link("g.y1", "nobody.u")))
    inner = package(tmp_path / "sub.ssp", wrong, with_fmu(fmus))
    holder = component("i", "resources/sub.ssp", type="application/x-ssp-package")
    path = package(tmp_path / "p.ssp", system("root", holder), {"resources/sub.ssp": inner})
    assert "sub.ssp/SystemStructure.ssd, line 1: there is no component 'nobody'" in check(path).errors[0]
    path = package(tmp_path / "q.ssp", system("root", component("i", "resources/sub.ssp#X", type=
                   "application/x-ssp-package")), {"resources/sub.ssp": inner})  # fmt: skip
    assert "SystemStructure.ssd, line 1: sub.ssp: the package has no variant 'X'" in check(path).errors[0]


def test_a_missing_parameter_set_is_told_with_who_asks_for_it(fmus, tmp_path):
    own = bindings(binding(source="no.ssv"))
    path = package(tmp_path / "p.ssp", system("root", component("a", "resources/L.fmu", bindings=own)), with_fmu(fmus))
    assert check(path).errors == ["SystemStructure.ssd, line 1: 'no.ssv' is missing in the package"]


def test_stimuli_beside_the_run_are_remarked(fmus, tmp_path):
    (tmp_path / "s.csv").write_text("time,in\n5,1\n6,2\n")
    path = package(tmp_path / "p.ssp", with_input(), with_fmu(fmus))
    options = Options(stimuli=tmp_path / "s.csv")
    told = "its times, 5 to 6 s, are all after the run from 0 to 1 s"
    assert any(told in r for r in run(path, tmp_path / "out", options).summary["warnings"])
    assert any(told in r for r in check(path, options).warnings)


def test_an_input_of_a_continuous_and_a_discrete_real_is_remarked(fmus, tmp_path):
    told = 'name="u2" valueReference="1" causality="input" variability='
    fmu = redescribed(fmus[2], tmp_path / "D.fmu", (f'{told}"continuous"', f'{told}"discrete"'))
    (tmp_path / "s.csv").write_text("time,in\n0,1\n1,2\n")
    a = component("a", "resources/L.fmu", connector("u1", "input"), connector("u2", "input"))
    ways = link("in", "a.u1"), link("in", "a.u2")
    root = system("root", a, made=(connector("in", "input"),), links=ways)
    path = package(tmp_path / "p.ssp", root, {"resources/L.fmu": fmu})
    found = check(path, Options(stimuli=tmp_path / "s.csv")).warnings
    assert any("'in' is held from row to row, for 'a.u2' is discrete; 'a.u1' is continuous" in w for w in found)


def test_a_size_that_the_fmu_refuses_is_told_with_its_parameter(fmus, tmp_path):
    a = component("a", "resources/L.fmu", connector("many_out", "output", "Float64"))
    path = package(tmp_path / "p.ssp", system("root", a), with_fmu(fmus, 3), version="2.0")
    with pytest.raises(CosimError, match="setting the structural parameter size = 99999"):
        run(path, tmp_path / "out", Options(changes=(("a.size", "99999"),)))


def test_texts_of_an_array_are_given_as_a_list(fmus, tmp_path):
    fmu = redescribed(fmus[3], tmp_path / "X.fmu", (
        '<Float64 name="time"',
        '<String name="words" valueReference="1600" causality="parameter" variability="fixed"><Dimension start="2"/>'
        '<Start value="a"/><Start value="b"/></String><Float64 name="time"',
    ))  # fmt: skip
    instance = describe("a", fmu)
    assert instance.checked("words", '["x y", "z"]') == ("x y", "z")
    assert instance.checked("words", "[x") == ("[x", "[x")
    with pytest.raises(CosimError, match="words has 2 values, not 3"):
        instance.checked("words", '["x", "y", "z"]')


def test_a_text_with_a_value_and_values_is_refused(fmus, tmp_path):
    both = '<ssv:Parameter name="s"><ssv:String value="a"><ssv:Value value="b"/></ssv:String></ssv:Parameter>'
    a = component("a", "resources/L.fmu", bindings=bindings(binding(parameter_set(both))))
    path = package(tmp_path / "p.ssp", system("root", a), with_fmu(fmus))
    assert any("has a value and <Value> elements" in text for text in check(path).errors)


REV = """<ssd:Enumerations><ssc:Enumeration name="Rev"><ssc:Item name="blue" value="1"/>
<ssc:Item name="green" value="2"/><ssc:Item name="red" value="3"/></ssc:Enumeration>
<ssc:Enumeration name="Colour"><ssc:Item name="red" value="1"/>
<ssc:Item name="green" value="2"/><ssc:Item name="blue" value="3"/></ssc:Enumeration></ssd:Enumerations>"""


def colours(between, first="", second=""):
    """Colours of one component on their way to those of another, through a nested system's connector."""
    a = component("a", "resources/L.fmu", connector("item_out", "output", "Enumeration", enumeration="Colour"))
    b = component("b", "resources/L.fmu", connector("item_in", "input", "Enumeration", enumeration="Colour"))
    inner = system("i", b, made=(connector("g", "input", "Enumeration", enumeration=between),),
                   links=(link("g", "b.item_in", second),))  # fmt: skip
    return system("root", a, inner, links=(link("a.item_out", "i.g", first),))


def names(*pairs):
    inside = "".join(f'<ssc:MapEntry source="{a}" target="{b}"/>' for a, b in pairs)
    return f"<ssc:EnumerationMappingTransformation>{inside}</ssc:EnumerationMappingTransformation>"


@pytest.mark.parametrize("first", ["", numbers((1, 3))])
def test_items_with_other_numbers_in_between_are_refused(fmus, tmp_path, first):
    path = package(tmp_path / "p.ssp", colours("Rev", first), with_fmu(fmus), after=REV)
    with pytest.raises(CosimError, match="give an EnumerationMappingTransformation"):
        run(path, tmp_path / "out", Options())


def test_items_with_other_numbers_in_between_are_mapped_there_and_back(fmus, tmp_path):
    same = [(name, name) for name in ("red", "green", "blue")]
    path = package(tmp_path / "p.ssp", colours("Rev", names(*same), names(*same)), with_fmu(fmus), after=REV)
    for item, number in (("red", 1), ("blue", 3)):
        assert last(tmp_path, path, "i.b.item_in", changes=(("a.item_in", item),)) == number


def test_an_integer_that_is_no_item_ends_the_run(fmus, tmp_path):
    a = component("a", "resources/L.fmu", connector("integer_out", "output", "Integer"))
    b = component("b", "resources/L.fmu", connector("item_in", "input", "Enumeration"))
    root = system("root", a, b, links=(link("a.integer_out", "b.item_in"),))
    path = package(tmp_path / "p.ssp", root, with_fmu(fmus))
    assert last(tmp_path, path, "b.item_in", changes=(("a.integer_in", "3"),)) == 3
    with pytest.raises(CosimError, match="does not fit into the type of what it is connected to"):
        run(path, tmp_path / "out", Options(changes=(("a.integer_in", "7"),)))


@pytest.mark.parametrize(("kind", "value"), [("Integer", 2.5), ("Boolean", 1.0), ("UInt8", 300.0)])
def test_a_parameter_set_gives_a_connector_values_of_its_type(fmus, tmp_path, kind, value):
    ends = connector("u1", "input"), connector("y1", "output")
    inner = system("i", component("b", "resources/L.fmu", *ends), made=(connector("g", "parameter", kind),),
                   links=(link("g", "b.D[1,1]"),))  # fmt: skip
    path = package(tmp_path / "p.ssp", system("root", inner), with_fmu(fmus), version="2.0")
    (tmp_path / "v.ssv").write_text(values({"i.g": value}))
    with pytest.raises(CosimError, match=r"connector 'i\.g'"):
        run(path, tmp_path / "out", Options(parameters=(tmp_path / "v.ssv",)))


def test_a_parameter_of_another_shape_is_refused(fmus, tmp_path):
    fmu = redescribed(fmus[3], tmp_path / "S.fmu", (
        '<Float64 name="time"', '<Float64 name="grid" valueReference="1700" causality="parameter" variability="fixed" '
        'start="0"><Dimension start="4"/><Dimension start="2"/></Float64><Float64 name="time"'))  # fmt: skip
    given = parameter("grid", "Float64", "1 2 3 4 5 6 7 8").replace(
        "</ssv:Parameter>", '<ssc:Dimension size="2"/><ssc:Dimension size="4"/></ssv:Parameter>'
    )
    a = component("a", "resources/S.fmu", bindings=bindings(binding(parameter_set(given, version="2.0"))))
    path = package(tmp_path / "p.ssp", system("root", a), {"resources/S.fmu": fmu}, version="2.0")
    assert any("is 2 x 4 in shape and 'a.grid' 4 x 2" in text for text in check(path).errors)


LARGEST = 2**64 - 1


@pytest.mark.parametrize(
    ("kind", "value", "target", "pair", "expected"),
    [
        ("huge", LARGEST, "huge", (LARGEST, 7), 7),
        ("huge", LARGEST, "integer", (LARGEST, 7), 7),
        ("huge", 5, "huge", (5, LARGEST), LARGEST),
        ("huge", LARGEST, "huge", (-1, 7), LARGEST),  # no UInt64 is -1, though both look alike in 64 bits
        ("wide", -1, "wide", (LARGEST, 7), -1),
    ],
)
def test_mappings_of_the_largest_integers(fmus, tmp_path, kind, value, target, pair, expected):
    """SSP 2.0 maps integers from -2^63 to 2^64 - 1; a source that its type does not have is ignored."""
    type = {"huge": "UInt64", "wide": "Int64"}[kind]
    given = bindings(binding(parameter_set(parameter(f"{kind}_in", type, value), version="2.0")))
    a, b = component("a", "resources/L.fmu", bindings=given), component("b", "resources/L.fmu")
    root = system("root", a, b, links=(link(f"a.{kind}_out", f"b.{target}_in", numbers(pair)),))
    path = package(tmp_path / "p.ssp", root, with_fmu(fmus, 3), version="2.0")
    assert not check(path).errors
    assert last(tmp_path, path, f"b.{target}_out") == expected


@pytest.mark.parametrize(
    ("ends", "pair", "message"),
    [
        (("a.wide_out", "b.huge_in"), (1, LARGEST), f"{LARGEST} needs a UInt64, 'a.wide_out' is Int64"),
        (("a.integer_out", "b.item_in"), (1, 0), "0 is not a value of 'b.item_in', which is Enumeration; it has red"),
    ],
)
def test_values_that_a_mapping_of_integers_cannot_make(fmus, tmp_path, ends, pair, message):
    a, b = (component(name, "resources/L.fmu") for name in "ab")
    path = package(tmp_path / "p.ssp", system("root", a, b, links=(link(*ends, numbers(pair)),)), with_fmu(fmus, 3),
                   version="2.0")  # fmt: skip
    assert any(message in told for told in check(path).errors)
