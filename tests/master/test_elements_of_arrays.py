"""Connections of single elements of arrays (SSP 2.0: startIndices, endIndices), with numbers worked out by hand."""

from __future__ import annotations

import pytest
from deepsea_cosim.core.errors import CosimError
from deepsea_cosim.master.algorithms import NAMES
from deepsea_cosim.master.simulation.check import check
from deepsea_cosim.master.simulation.run import Options, run
from deepsea_cosim.master.system.tree import tree

from benchmarks import native

from ..packages import binding, bindings, component, connector, link, package, parameter_set, system, unit
from .parts import gain, linear, with_fmu

pytestmark = pytest.mark.skipif(native.compiler is None, reason="there is no C compiler here")

UNITS = f"<ssd:Units>{unit('m', m=1)}{unit('mm', m=1, factor=0.001)}</ssd:Units>"


def array(name, kind, unit=None):
    return connector(name, kind, "Float64", unit, sizes=(3,))


def passes_on(name, start, unit_in=None, unit_out=None):
    """A component whose array_out is its array_in, which starts with three values."""
    given = f'<ssv:Parameter name="array_in"><ssv:Float64 value="{start}"/><ssc:Dimension size="3"/></ssv:Parameter>'
    return component(
        name, "resources/L.fmu", array("array_in", "input", unit_in), array("array_out", "output", unit_out),
        bindings=bindings(binding(parameter_set(given, version="2.0"))),
    )  # fmt: skip


A, B, C = passes_on("a", "1 2 3"), passes_on("b", "7 8 9"), passes_on("c", "0 0 0")


def package_of(fmus, tmp_path, root):
    return package(tmp_path / "p.ssp", root, with_fmu(fmus, 3), version="2.0", after=UNITS)


def end(fmus, tmp_path, root, *names, **options):
    """The values of columns at the end; the package has no fault that --check would find."""
    path = package_of(fmus, tmp_path, root)
    assert not check(path).errors
    return run(path, tmp_path / "out", Options(**options)).frame()[list(names)].iloc[-1].tolist()


ALL = ("b.array_out[1]", "b.array_out[2]", "b.array_out[3]")


@pytest.mark.parametrize("isolate", [False, True])
@pytest.mark.parametrize("turned", [False, True])
def test_an_element_drives_an_element_and_the_others_keep_their_start(fmus, tmp_path, turned, isolate):
    """b = (a[3], 8, 9)"""
    one = link("a.array_out", "b.array_in", startIndices="3", endIndices="1")
    if turned:
        one = link("b.array_in", "a.array_out", startIndices="1", endIndices="3")
    assert end(fmus, tmp_path, system("root", A, B, links=(one,)), *ALL, isolate=isolate) == [3.0, 8.0, 9.0]


@pytest.mark.parametrize("method", NAMES)
def test_elements_beside_whole_arrays_and_scalars(fmus, tmp_path, method):
    """c = a; g = 2 c[2] = 4; b = (a[3], g, 2 a[1] + 1) = (3, 4, 3)"""
    links = (
        link("a.array_out", "b.array_in", startIndices="3", endIndices="1"),
        link("a.array_out", "c.array_in"),
        link("a.array_out", "b.array_in", '<ssc:LinearTransformation factor="2" offset="1"/>', startIndices="1",
             endIndices="3"),
        link("c.array_out", "g.u1", startIndices="2"),
        link("g.y1", "b.array_in", endIndices="2"),
    )  # fmt: skip
    root = system("root", A, B, C, gain("g", 2.0), links=links)
    found = end(fmus, tmp_path, root, *ALL, "c.array_out[3]", method=method)
    assert found == pytest.approx([3.0, 4.0, 3.0, 3.0])


def test_elements_in_other_units(fmus, tmp_path):
    """a[2] = 2 m is 2000 mm"""
    a, b = passes_on("a", "1 2 3", unit_out="m"), passes_on("b", "7 8 9", unit_in="mm")
    one = link("a.array_out", "b.array_in", startIndices="2", endIndices="2")
    assert end(fmus, tmp_path, system("root", a, b, links=(one,)), *ALL) == [7.0, 2000.0, 9.0]


def test_elements_of_connectors_of_systems(fmus, tmp_path):
    """s.q = (a[3], a[2], -): b = (7, 2, 3) by q[2] -> b[2], q[1] -> b[3]; s.r = b: out = r[3] = 3, g = 10 r[2] = 20"""
    inside = (
        link("q", "b.array_in", startIndices="2", endIndices="2"),
        link("q", "b.array_in", startIndices="1", endIndices="3"),
        link("b.array_out", "r"),
    )
    inner = system("s", B, made=(array("q", "input"), array("r", "output")), links=inside)
    links = (
        link("a.array_out", "s.q", startIndices="3", endIndices="1"),
        link("a.array_out", "s.q", startIndices="2", endIndices="2"),
        link("s.r", "g.u1", startIndices="2"),
        link("s.r", "out", startIndices="3"),
    )
    root = system("root", A, inner, gain("g", 10.0), made=(connector("out", "output", "Float64"),), links=links)
    found = end(fmus, tmp_path, root, "s.b.array_out[1]", "s.b.array_out[2]", "s.b.array_out[3]", "g.y1", "out")
    assert found == [7.0, 2.0, 3.0, 20.0, 3.0]


def test_elements_of_one_end_of_a_whole_array(fmus, tmp_path):
    """Outside s.q = (a[3], a[2], a[1]), inside b = q; a dictionary's entry passes on the same way."""
    turned = tuple((k, 4 - k) for k in (1, 2, 3))
    inner = system("s", B, made=(array("q", "input"),), links=(link("q", "b.array_in"),))
    links = tuple(link("a.array_out", "s.q", startIndices=i, endIndices=k) for i, k in turned)
    names = [f"s.b.array_out[{k}]" for k in (1, 2, 3)]
    assert end(fmus, tmp_path, system("root", A, inner, links=links), *names) == [3.0, 2.0, 1.0]
    entry = '<ssb:DictionaryEntry name="v"><ssc:Float64/><ssc:Dimension size="3"/></ssb:DictionaryEntry>'
    bus = (
        '<ssd:SignalDictionaries><ssd:SignalDictionary name="D"><ssb:SignalDictionary version="2.0">'
        f"{entry}</ssb:SignalDictionary></ssd:SignalDictionary></ssd:SignalDictionaries>"
    )
    links = (
        *(link("a.array_out", "r.v", startIndices=i, endIndices=k) for i, k in turned), link("r.v", "b.array_in"),
    )  # fmt: skip
    reference = '<ssd:SignalDictionaryReference name="r" dictionary="D"/>'
    assert end(fmus, tmp_path, system("root", A, B, reference, links=links, dictionaries=bus), *ALL) == [3.0, 2.0, 1.0]


def own(*more):
    """in = (1, 2, 3): g = 2 in[2] = 4, b = (7, 8, in[1]); out = (g, in[3] m in mm, b[3])"""
    links = (
        link("in", "g.u1", startIndices="2"), link("in", "b.array_in", startIndices="1", endIndices="3"),
        link("g.y1", "out", endIndices="1"), link("in", "out", startIndices="3", endIndices="2"),
        link("b.array_out", "out", startIndices="3", endIndices="3"),
    )  # fmt: skip
    made = (array("in", "input", "m"), array("out", "output", "mm"))
    return system("root", B, gain("g", 2.0), *more, made=made, links=links)


def test_elements_of_inputs_and_outputs_of_the_whole_system(fmus, tmp_path):
    names = ("out[1]", "out[2]", "out[3]", "b.array_out[1]")
    assert end(fmus, tmp_path, own(), *names, changes=(("in", "1 2 3"),)) == [4.0, 3000.0, 1.0, 7.0]
    (tmp_path / "s.csv").write_text("time,in[1],in[2],in[3]\n0,1,2,3\n0.5,1,4,3\n")
    found = end(fmus, tmp_path, own(), *names, stimuli=tmp_path / "s.csv")
    assert found == [8.0, 3000.0, 1.0, 7.0]
    told = check(package_of(fmus, tmp_path, own()))
    assert "  in[1] -> b.array_in[3]" in tree(told.network, told.system)


@pytest.mark.parametrize(
    ("links", "message"),
    [
        ([("a.array_out", "b.array_in", "0", "1")], 'startIndices="0": indices begin with 1'),
        ([("a.array_out", "b.array_in", "1", "4")], "endIndices=\"4\": 'b.array_in' is 3 in size"),
        ([("a.array_out", "b.array_in", "1 1", "1")], "startIndices=\"1 1\": 'a.array_out' is 3 in size"),
        ([("a.array_out", "b.array_in", None, "1")], "'a.array_out' has 3 values and one element of 'b.array_in' 1"),
        ([("a.array_out", "b.array_in", "1", None)], "one element of 'a.array_out' has 1 values and 'b.array_in' 3"),
        ([("a.many_out", "b.array_in", "3", "1")], "'a.many_out' is 2 in size and has no element [3]"),
        ([("a.y1", "b.array_in", "1", "1")], "'a.y1' is no array, but indices are given for it"),
        ([("in", "b.array_in", "1", "1")], "'in' has no sizes in the package"),
        ([("in", "b.array_in", None, "1"), ("a.array_out", "b.array_in", "1", "1")], "'b.array_in[1]' is already"),
        ([("a.array_out", "b.array_in", None, None), ("in", "b.array_in", None, "1")], "'b.array_in[1]' is already"),
        ([("in", "b.array_in", None, "1"), ("a.array_out", "b.array_in", None, None)], "'b.array_in' is already"),
        ([("k", "b.size", None, "1")], "connections of single elements of parameters are not supported"),
    ],
)  # fmt: skip
def test_what_is_wrong_with_indices_is_told(fmus, tmp_path, links, message):
    made = tuple(link(a, b, startIndices=i, endIndices=k) for a, b, i, k in links)
    outer = (connector("in", "input", "Float64"), connector("k", "parameter", "UInt64"))
    path = package_of(fmus, tmp_path, system("root", A, B, made=outer, links=made))
    with pytest.raises(CosimError) as error:
        run(path, tmp_path / "out")
    assert message in str(error.value)
    assert "SystemStructure.ssd, line" in str(error.value)
    assert any(message in told for told in check(path).errors)


@pytest.mark.parametrize("method", NAMES[1:])
def test_columns_of_an_array_may_stand_in_any_order(fmus, tmp_path, method):
    """a passes on the input v of the system, which a table drives to (1, 2, 3) at the end."""
    root = system("root", A, made=(array("v", "input"),), links=(link("v", "a.array_in"),))
    (tmp_path / "in.csv").write_text("time,v[3],v[1],v[2]\n0,0,0,0\n1,3,1,2\n")
    names = [f"a.array_out[{k}]" for k in (1, 2, 3)]
    found = end(fmus, tmp_path, root, *names, method=method, stimuli=tmp_path / "in.csv")
    assert found == pytest.approx([1.0, 2.0, 3.0])


@pytest.mark.parametrize("method", ["gauss-seidel", "jacobi"])
def test_an_output_of_the_system_with_elements_of_its_inputs_beside_those_of_components(fmus, tmp_path, method):
    """Each is recorded at its time: o = (t, 10 t) at every point, as clock.y1 and in are."""
    clock = linear("clock", A=[[0, 1], [0, 0]], B=[[0], [0]], C=[[1, 0]], x0=[0, 1])
    made = (connector("in", "input", "Float64"), connector("o", "output", "Float64", sizes=(2,)))
    links = (link("clock.y1", "o", endIndices="1"), link("in", "o", endIndices="2"))
    path = package_of(fmus, tmp_path, system("root", clock, made=made, links=links))
    (tmp_path / "in.csv").write_text("time,in\n0,0\n1,10\n")
    frame = run(path, tmp_path / "out", Options(method=method, stimuli=tmp_path / "in.csv")).frame()
    assert frame["o[1]"].tolist() == frame["clock.y1"].tolist() == pytest.approx(frame["time"].tolist())
    assert frame["o[2]"].tolist() == frame["in"].tolist() == pytest.approx((10.0 * frame["time"]).tolist())
