"""Units and items on the way through nested systems whose connectors do not state them, by hand."""

from __future__ import annotations

import pytest
from deepsea_cosim.core.errors import CosimError
from deepsea_cosim.master.simulation.run import run
from deepsea_cosim.master.system.addresses import matches

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
from .parts import last, with_fmu

pytestmark = pytest.mark.skipif(native.compiler is None, reason="there is no C compiler here")

UNITS = f"<ssd:Units>{unit('mm', m=1, factor=0.001)}{unit('m', m=1)}</ssd:Units>"
ITEMS = """<ssd:Enumerations>
<ssc:Enumeration name="Speed"><ssc:Item name="slow" value="7"/><ssc:Item name="fast" value="8"/></ssc:Enumeration>
<ssc:Enumeration name="Colour"><ssc:Item name="red" value="1"/><ssc:Item name="green" value="2"/>
<ssc:Item name="blue" value="3"/></ssc:Enumeration></ssd:Enumerations>"""
TABLE = """<ssc:EnumerationMappingTransformation><ssc:MapEntry source="slow" target="red"/>
<ssc:MapEntry source="fast" target="green"/></ssc:EnumerationMappingTransformation>"""


@pytest.mark.parametrize("stated", [None, "m"])
@pytest.mark.parametrize("nested", [False, True])
def test_a_mapping_shifts_in_the_unit_of_what_the_connector_leads_to(fmus, tmp_path, nested, stated):
    """1000 mm are 1 m, and half of one more, whether the connector says m or leads to what does."""
    shift = '<ssc:LinearTransformation factor="1" offset="0.5"/>'
    given = parameter_set(
        parameter("p", "Real", 1000, unit="mm"), units=f"<ssv:Units>{unit('mm', m=1, factor=0.001)}</ssv:Units>"
    )
    mapped = f"<ssd:ParameterMapping>{mapping_file(entry('p', 'k', shift))}</ssd:ParameterMapping>"
    a = component("a", "resources/L.fmu", connector("u1", "input", "Real", "m"), connector("y1", "output"),
                  bindings=bindings(binding(values({"D[1,1]": 1.0}))))  # fmt: skip
    made = (connector("k", "input", "Real", stated),)
    one = system("sub" if nested else "root", a, made=made, links=(link("k", "a.u1"),),
                 bindings=bindings(binding(given, mapped)))  # fmt: skip
    root = system("root", one) if nested else one
    path = package(tmp_path / "p.ssp", root, with_fmu(fmus), after=UNITS, stop=1.0, step=0.1)
    assert last(tmp_path, path, "sub.a.y1" if nested else "a.y1") == pytest.approx(1.5)


@pytest.mark.parametrize(("stated", "expected"), [("m", 3.0), ("mm", 2.001), (None, 2.001)])
def test_an_offset_in_a_unit_that_nothing_says_is_told(fmus, tmp_path, stated, expected):
    """1000 mm, shifted by 0.5 of what the nested connector is in, twice: 2 (1 m + 0.5 m) or 2 (1000 mm + 0.5 mm)."""
    a = component("a", "resources/L.fmu", connector("u1", "input", "Real", "m"), connector("y1", "output"),
                  bindings=bindings(binding(values({"D[1,1]": 1.0}))))  # fmt: skip
    twice, shift = (f'<ssc:LinearTransformation factor="{k}" offset="{d}"/>' for k, d in ((2, 0), (1, 0.5)))
    sub = system("sub", a, made=(connector("u", "input", "Real", stated),), links=(link("u", "a.u1", twice),))
    root = system("root", sub, made=(connector("in", "input", "Real", "mm"),), links=(link("in", "sub.u", shift),),
                  bindings=bindings(binding(values({"in": 1000.0}))))  # fmt: skip
    path = package(tmp_path / "p.ssp", root, with_fmu(fmus), after=UNITS)
    result = run(path, tmp_path / "out")
    assert result.frame()["sub.a.y1"].iloc[-1] == pytest.approx(expected)
    message = "connector 'sub.u' does not say its unit, nor does what it leads to at once"
    assert (message in " ".join(result.summary["warnings"])) == (stated is None)


def lamp(enumeration):
    """A nested system with a connector `mode` that leads to a component's colours, mapped within if it is a speed."""
    ends = (connector(f"item_{way}", kind, "Enumeration", enumeration="Colour")
            for way, kind in (("in", "input"), ("out", "output")))  # fmt: skip
    inner = link("mode", "a.item_in", TABLE if enumeration == "Speed" else "")
    made = (connector("mode", "input", "Enumeration", enumeration=enumeration),)
    return system("sub", component("a", "resources/L.fmu", *ends), made=made, links=(inner,))


def test_items_that_a_connector_does_not_know_are_those_of_what_it_leads_to(fmus, tmp_path):
    made = (connector("m", "input", "Enumeration", enumeration="Speed"),)
    root = system("root", lamp("Unheard"), made=made, links=(link("m", "sub.mode", TABLE),))
    path = package(tmp_path / "p.ssp", root, with_fmu(fmus), after=ITEMS, stop=1.0, step=0.1)
    assert last(tmp_path, path, "sub.a.item_out", changes=(("m", "fast"),)) == 2


def test_an_item_is_set_at_a_nested_connector_by_its_own_name_or_number(fmus, tmp_path):
    path = package(tmp_path / "p.ssp", system("root", lamp("Speed")), with_fmu(fmus), after=ITEMS, stop=1.0, step=0.1)
    assert last(tmp_path, path, "sub.a.item_out", changes=(("sub.mode", "fast"),)) == 2
    assert last(tmp_path, path, "sub.a.item_out", changes=(("sub.mode", "8"),)) == 2
    with pytest.raises(CosimError, match=r"--set sub.mode=9: 'sub.mode' is mapped by the names .*: slow, fast"):
        last(tmp_path, path, "sub.a.item_out", changes=(("sub.mode", "9"),))


@pytest.mark.parametrize(
    ("name", "pattern", "meant"),
    [("a[1].y1", "a[1].*", True), ("a1.y1", "a[1].*", False), ("a.out[2]", "*[2]", True), ("a.out[2]", "a.out", True),
     ("a.out[2]", "a.o?t", True), ("a.out[2]", "a.*[1]", False)],
)  # fmt: skip
def test_brackets_of_a_pattern_are_those_of_names(name, pattern, meant):
    assert matches(name, pattern) is meant
