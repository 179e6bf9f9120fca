"""The seldom used ends of the support table in docs/ssp.md: types and versions, and what other tools write."""

from __future__ import annotations

import pytest
from deepsea_cosim.core.errors import CosimError
from deepsea_cosim.master.simulation.check import check
from deepsea_cosim.master.simulation.run import Options, run

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
    unit,
    values,
)
from .parts import constant, gain, last, redescribed, with_fmu, with_input

pytestmark = pytest.mark.skipif(native.compiler is None, reason="there is no C compiler here")


def test_negated_alias_of_fmi_1(tmp_path):
    fmu = native.linear(tmp_path / "f", 1, negated="y1")
    root = system("root", gain("a", 3.0), constant("c", 2.0, source="resources/C.fmu"), links=(link("c.y1", "a.u1"),))
    path = package(tmp_path / "p.ssp", root, {"resources/L.fmu": fmu, "resources/C.fmu": native.linear(tmp_path, 2)})
    assert last(tmp_path, path, "a.y1") == -6.0
    assert last(tmp_path, path, "a.y1", isolate=True) == -6.0
    fmu = native.linear(tmp_path / "g", 1, negated="u1")
    with pytest.raises(CosimError, match="'a': 'u1' is a negated alias"):
        run(package(tmp_path / "p.ssp", root, {"resources/L.fmu": fmu, "resources/C.fmu": fmu}), tmp_path / "out")


def from_to(source, kind, value, target, other):
    """A component's input that another's output drives; the output is what its input was given."""
    given = bindings(binding(parameter_set(parameter(f"{source}_in", kind, value), version="2.0")))
    a = component("a", "resources/L.fmu", connector(f"{source}_out", "output", kind), bindings=given)
    b = component("b", "resources/L.fmu", connector(f"{target}_in", "input", other))
    return system("root", a, b, links=(link(f"a.{source}_out", f"b.{target}_in"),))


@pytest.mark.parametrize(
    ("source", "kind", "value", "target", "other", "message"),
    [
        ("wide", "Int64", 2**31, "integer", "Int32", r"'b': 2\.14748e\+09 does not fit into 'integer_in', which is I"),
        ("huge", "UInt64", 2**63, "wide", "Int64", "the value does not fit into the type of what it is connected to"),
        ("wide", "Int64", -1, "huge", "UInt64", "the value does not fit into the type of what it is connected to"),
    ],
)
def test_integers_that_do_not_fit_end_the_run(fmus, tmp_path, source, kind, value, target, other, message):
    path = package(tmp_path / "p.ssp", from_to(source, kind, value, target, other), with_fmu(fmus, 3), version="2.0")
    with pytest.raises(CosimError, match=message) as caught:
        run(path, tmp_path / "out")
    assert "at t =" not in str(caught.value)  # it is so before any time
    path = package(tmp_path / "q.ssp", from_to(source, kind, 7, target, other), with_fmu(fmus, 3), version="2.0")
    assert last(tmp_path, path, f"b.{target}_out") == 7


def test_a_real_that_single_precision_cannot_hold(fmus, tmp_path):
    b = component("b", "resources/L.fmu", connector("single_in", "input", "Float32"))
    root = system("root", constant("c", 1e300), b, links=(link("c.y1", "b.single_in"),))
    path = package(tmp_path / "p.ssp", root, with_fmu(fmus, 3), version="2.0")
    with pytest.raises(CosimError, match=r"1e\+300 does not fit into 'single_in', which is Float32"):
        run(path, tmp_path / "out")


@pytest.mark.parametrize("file", ["r.csv", "r.parquet", "r.h5"])
def test_the_largest_integers_are_recorded_as_they_are(fmus, tmp_path, file):
    pytest.importorskip({"r.csv": "pandas", "r.parquet": "pyarrow", "r.h5": "h5py"}[file])
    path = package(tmp_path / "p.ssp", from_to("huge", "UInt64", 2**63 + 5, "huge", "UInt64"), with_fmu(fmus, 3),
                   version="2.0")  # fmt: skip
    assert last(tmp_path, path, "b.huge_out", results=file) == 2**63 + 5


def test_structural_parameters_give_arrays_their_size(fmus, tmp_path):
    def sized(*values):
        given = bindings(binding(parameter_set(*values, version="2.0")))
        root = system("root", component("a", "resources/L.fmu", bindings=given))
        return package(tmp_path / "p.ssp", root, with_fmu(fmus, 3), version="2.0")

    def many(n, path):
        return [last(tmp_path, path, f"a.many_out[{k + 1}]") for k in range(n)]

    four = '<ssv:Parameter name="many_in"><ssv:Float64 value="9 8 7 6"/><ssc:Dimension size="4"/></ssv:Parameter>'
    size = parameter("size", "UInt64", 4)
    assert many(2, sized()) == [1.0, 2.0]  # the start value
    assert many(4, sized(size)) == [1.0, 2.0, 3.0, 4.0]  # the FMU knows what the model description does not say
    assert many(4, sized(size, four)) == [9.0, 8.0, 7.0, 6.0]
    with pytest.raises(CosimError, match=r"a\.many_in has 2 values, not 4"):
        run(sized(four), tmp_path / "out")


def test_an_array_that_a_higher_level_wins_over_need_not_have_the_size_that_counts(fmus, tmp_path):
    """The component's 2 values are those of its own size; the system's 4 win, and the user's 3 over these."""

    def sized(prefix, n, text):
        array = f'<ssv:Parameter name="{prefix}many_in"><ssv:Float64 value="{text}"/><ssc:Dimension size="{n}"/>'
        return bindings(binding(
            parameter_set(parameter(f"{prefix}size", "UInt64", n), f"{array}</ssv:Parameter>", version="2.0")
        ))  # fmt: skip

    a = component("a", "resources/L.fmu", bindings=sized("", 2, "9 8"))
    root = system("root", a, bindings=sized("a.", 4, "5 6 7 8"))
    path = package(tmp_path / "p.ssp", root, with_fmu(fmus, 3), version="2.0")
    assert not check(path).errors
    assert [last(tmp_path, path, f"a.many_out[{k}]") for k in (1, 4)] == [5.0, 8.0]
    changes = (("a.size", "3"), ("a.many_in", "1 2 3"))
    assert not check(path, Options(changes=changes)).errors
    frame = run(path, tmp_path / "out", Options(changes=changes)).frame()
    assert frame[[f"a.many_out[{k}]" for k in (1, 2, 3)]].iloc[-1].tolist() == [1.0, 2.0, 3.0]


def test_arrays_as_inputs_and_outputs_of_the_whole_system(fmus, tmp_path):
    a = component("a", "resources/L.fmu", connector("array_in", "input", "Float64"),
                  connector("array_out", "output", "Float64"))  # fmt: skip
    root = system("root", a, made=(connector("in", "input", "Float64"), connector("out", "output", "Float64")),
                  links=(link("in", "a.array_in"), link("a.array_out", "out")))  # fmt: skip
    path = package(tmp_path / "p.ssp", root, with_fmu(fmus, 3), version="2.0")
    frame = run(path, tmp_path / "out", Options(changes=(("in", "4 5 6"),))).frame()
    assert frame[["out[1]", "out[2]", "out[3]"]].iloc[-1].tolist() == [4.0, 5.0, 6.0]
    (tmp_path / "s.csv").write_text("time,in[1],in[2],in[3]\n0,0,1,2\n1,1,1,4\n")
    frame = run(path, tmp_path / "out", Options(stimuli=tmp_path / "s.csv")).frame()
    assert frame[["in[1]", "in[2]", "in[3]"]].iloc[-1].tolist() == [1.0, 1.0, 4.0]
    assert frame[["out[1]", "out[2]", "out[3]"]].iloc[-1].tolist() == pytest.approx([0.9, 1.0, 3.8])
    for head, message in (("in", r"'in' is an array; give columns 'in\[1\]' to 'in\[3\]'"),
                          ("in[1]", r"column 'in\[2\]' is missing")):  # fmt: skip
        (tmp_path / "s.csv").write_text(f"time,{head}\n0,0\n1,1\n")
        with pytest.raises(CosimError, match=message):
            run(path, tmp_path / "out", Options(stimuli=tmp_path / "s.csv"))


def test_descriptions_in_folders_find_their_files(fmus, tmp_path):
    inner = description(system("inner", gain("a", 3.0, source="../fmus/L.fmu"),
                               made=(connector("in", "input"), connector("out", "output")),
                               links=(link("in", "a.u1"), link("a.y1", "out"))))  # fmt: skip
    sub = component("sub", "parts/inner.ssd", connector("in", "input"), connector("out", "output"),
                    type="application/x-ssp-definition")  # fmt: skip
    root = system("root", constant("c", 2.0, source="fmus/L.fmu"), sub, links=(link("c.y1", "sub.in"),))
    path = package(tmp_path / "p.ssp", root, {"parts/inner.ssd": inner, "fmus/L.fmu": fmus[2]})
    assert last(tmp_path, path, "sub.a.y1") == 6.0
    again = description(system("inner", component("x", "../SystemStructure.ssd", type="application/x-ssp-definition")))
    path = package(tmp_path / "q.ssp", root, {"parts/inner.ssd": again, "fmus/L.fmu": fmus[2]})
    with pytest.raises(CosimError, match=r"contains itself \(SystemStructure.ssd -> parts/inner.ssd -> System"):
        run(path, tmp_path / "out")


def test_parameters_beside_a_description_that_is_a_component(fmus, tmp_path):
    """sourceBase 'component' is the description's own folder; a file that is not there is named."""
    inner = description(system("inner", gain("a", 3.0, source="../fmus/L.fmu"),
                               made=(connector("in", "input"), connector("out", "output")),
                               links=(link("in", "a.u1"), link("a.y1", "out"))))  # fmt: skip
    root = system("root", *(component(
        "sub", "parts/inner.ssd", connector("in", "input"), connector("out", "output"),
        bindings=bindings(binding(source="given.ssv", sourceBase="component")), type="application/x-ssp-definition",
    ), constant("c", 2.0, source="fmus/L.fmu")), links=(link("c.y1", "sub.in"),))  # fmt: skip
    files = {"parts/inner.ssd": inner, "fmus/L.fmu": fmus[2]}
    path = package(tmp_path / "p.ssp", root, {**files, "parts/given.ssv": values({"a.D[1,1]": 5.0})})
    assert last(tmp_path, path, "sub.a.y1") == 10.0
    with pytest.raises(CosimError, match=r"'given\.ssv' is not beside inner\.ssd"):
        run(package(tmp_path / "q.ssp", root, files), tmp_path / "out")


# what other tools write


def test_an_empty_element_name_is_the_system_itself(fmus, tmp_path):
    root = with_input().replace('startConnector="in"', 'startElement="" startConnector="in"')
    assert 'startElement=""' in root
    path = package(tmp_path / "p.ssp", root, with_fmu(fmus))
    assert last(tmp_path, path, "a.y1", changes=(("in", "4"),)) == 12.0


@pytest.mark.parametrize(
    ("owner", "annotation"),
    [
        ("system", '<oms:Annotations xmlns:oms="o"><oms:SimulationInformation><oms:FixedStepMaster stepSize="0.25"/>'
                   "</oms:SimulationInformation></oms:Annotations>"),
        ("experiment", '<osp:Algorithm xmlns:osp="o"><osp:FixedStepAlgorithm baseStepSize="0.25"/></osp:Algorithm>'),
    ],
)  # fmt: skip
def test_the_step_that_other_masters_annotate(fmus, tmp_path, owner, annotation):
    made = f'<ssd:Annotations><ssc:Annotation type="x">{annotation}</ssc:Annotation></ssd:Annotations>'
    text = description(system("root", constant("c", 2.0)), stop=None)
    experiment = '<ssd:DefaultExperiment stopTime="1"/></ssd:SystemStructureDescription>'
    if owner == "system":
        text = text.replace("</ssd:Elements></ssd:System>", f"</ssd:Elements>{made}</ssd:System>")
    else:
        experiment = experiment.replace('stopTime="1"/>', f'stopTime="1">{made}</ssd:DefaultExperiment>')
    text = text.replace("</ssd:SystemStructureDescription>", experiment)
    path = pack(tmp_path / "p.ssp", {"SystemStructure.ssd": text, **with_fmu(fmus)})
    assert run(path, tmp_path / "out").summary["step_s"] == 0.25


def test_a_unit_that_two_define_as_different_quantities_is_passed_on(fmus, tmp_path):
    """The package's "N" is no force: the FMU's is."""
    fmu = native.linear(tmp_path / "f", 2, units={"u1": "N"})
    root = system("root", constant("c", 2.0, unit_out="N"), gain("a", 3.0, source="resources/N.fmu"),
                  links=(link("c.y1", "a.u1"),))  # fmt: skip
    units = f"<ssd:Units>{unit('N', m=1)}</ssd:Units>"
    path = package(tmp_path / "p.ssp", root, {**with_fmu(fmus), "resources/N.fmu": fmu}, after=units)
    result = run(path, tmp_path / "out")
    assert result.frame()["a.y1"].iloc[-1] == 6.0
    assert any("'N' is defined in two ways" in text for text in result.summary["warnings"])


def test_units_that_nothing_defines_are_as_their_names_say(fmus, tmp_path):
    root = system("root", constant("c", 36.0, unit_out="km/h"), gain("a", 1.0, unit_in="m/s"),
                  links=(link("c.y1", "a.u1"),))  # fmt: skip
    assert last(tmp_path, package(tmp_path / "p.ssp", root, with_fmu(fmus)), "a.y1") == pytest.approx(10.0)


@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize("declared", [False, True])
def test_a_difference_has_no_offset(tmp_path, version, declared):
    """10 degC of difference are 10 K; said by the variable itself or by its declared type."""
    fmu = native.linear(tmp_path / "f", version, units={"u1": "N"})
    kind = "Float64" if version == 3 else "Real"
    unit_name = ('unit="N"', 'unit="degC"')
    units = ('<Unit name="N"><BaseUnit kg="1" m="1" s="-2"/>', '<Unit name="degC"><BaseUnit K="1" offset="273.15"/>')
    here = 'name="u1" valueReference="0" causality="input" variability="continuous" start="0"'
    if version == 2:
        here = f'<{kind} start="0"'
    more = ' declaredType="T"' if declared else ' relativeQuantity="true"'
    types = '<Float64Type name="T" relativeQuantity="true"/>' if version == 3 else \
        '<SimpleType name="T"><Real relativeQuantity="true"/></SimpleType>'  # fmt: skip
    changes = [units, (f'{here} {unit_name[0]}', f"{here} {unit_name[1]}{more}")]
    if declared:
        changes.append(("<TypeDefinitions>", f"<TypeDefinitions>{types}"))
    warm = redescribed(fmu, tmp_path / "warm.fmu", *changes)
    root = system("root", constant("c", 10.0, unit_out="K"), gain("a", 3.0, source="resources/W.fmu"),
                  links=(link("c.y1", "a.u1"),))  # fmt: skip
    path = package(tmp_path / "p.ssp", root, {"resources/L.fmu": fmu, "resources/W.fmu": warm})
    assert last(tmp_path, path, "a.y1") == 30.0


@pytest.mark.parametrize(("version", "kind"), [(2, "Real"), (3, "UInt64")])
def test_ranges_of_declared_types_and_of_unsigned_numbers_count(tmp_path, version, kind):
    fmu = native.linear(tmp_path / "f", version)
    if version == 2:
        name, value, changes = "u1", "11", [
            ("<TypeDefinitions>", '<TypeDefinitions><SimpleType name="T"><Real max="10"/></SimpleType>'),
            ('<Real start="0"/>', '<Real declaredType="T" start="0"/>'),
        ]  # fmt: skip
    else:
        name, value = "huge_in", "11"
        changes = [('name="huge_in" valueReference="730"', 'name="huge_in" valueReference="730" max="10"')]
    limited = redescribed(fmu, tmp_path / "limited.fmu", *changes)
    given = bindings(binding(parameter_set(parameter(name, kind, value))))
    part = component("a", "resources/L.fmu", connector(name, "input", kind), bindings=given)
    path = package(tmp_path / "p.ssp", system("root", part), {"resources/L.fmu": limited})
    with pytest.raises(CosimError, match=rf"a\.{name} = 11 is out of range; allowed: \S+ to 10"):
        run(path, tmp_path / "out")
