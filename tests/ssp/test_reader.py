"""Reading packages: what is understood, and one clear line for what is not."""

import zipfile

import pytest
from deepsea_cosim.core.errors import PackageError, UsageError
from deepsea_cosim.ssp.archive import UnpackLimits, extract
from deepsea_cosim.ssp.flatten import flatten
from deepsea_cosim.ssp.reader import read

HEAD = (
    '<ssd:SystemStructureDescription xmlns:ssd="http://ssp-standard.org/SSP1/SystemStructureDescription" '
    'xmlns:ssc="http://ssp-standard.org/SSP1/SystemStructureCommon" '
    'xmlns:ssv="http://ssp-standard.org/SSP1/SystemStructureParameterValues" version="1.0" name="t">'
)


def write(path, system, **files):
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("SystemStructure.ssd", f"{HEAD}{system}</ssd:SystemStructureDescription>")
        for name, content in files.items():
            archive.writestr(f"resources/{name.replace('__', '.')}", content)
    return path


COMPONENT = '<ssd:Component name="a" source="resources/a.fmu"/>'


def test_shipped_scenarios(built, tmp_path):
    s = read(built / "deepsea_6km.ssp", tmp_path)
    parts = dict(s.system.components())
    assert list(parts) == ["hydraulics", "arm"]
    assert (s.start_time, s.stop_time, s.step_size) == (0.0, 22.0, 1e-3)
    (values,) = s.system.bindings
    assert {p.name: p.value for p in values.parameters} == {"hydraulics.depth": 6000.0, "arm.depth": 6000.0}
    assert ("hydraulics", "F_h") in [c.start for c in s.system.connections]
    assert not s.remarks
    connectors = {c.name: c for c in parts["hydraulics"].connectors}
    assert connectors["P1"].type.unit.name == "Pa"
    assert connectors["P1"].kind == "output"
    assert connectors["oil.nu0"].kind == "parameter"


def test_constant_viscosity_scenario(built, tmp_path):
    s = read(built / "deepsea_11km_constant_viscosity.ssp", tmp_path)
    (values,) = s.system.bindings
    assert {p.name: p.value for p in values.parameters}["hydraulics.line.variable_viscosity"] is False


def test_bindings_inline_external_prefix_and_component(tmp_path):
    values = (
        '<ssv:ParameterSet xmlns:ssv="http://ssp-standard.org/SSP1/SystemStructureParameterValues" version="1.0" '
        'name="v"><ssv:Parameters><ssv:Parameter name="k"><ssv:Integer value="3"/></ssv:Parameter></ssv:Parameters>'
        "</ssv:ParameterSet>"
    )
    inline = values.replace('value="3"', 'value="4"')
    package = write(
        tmp_path / "p.ssp",
        '<ssd:System name="s"><ssd:ParameterBindings>'
        '<ssd:ParameterBinding prefix="a." source="resources/v.ssv"/></ssd:ParameterBindings>'
        '<ssd:Elements><ssd:Component name="a" source="resources/a.fmu"><ssd:ParameterBindings><ssd:ParameterBinding>'
        f"<ssd:ParameterValues>{inline}</ssd:ParameterValues></ssd:ParameterBinding></ssd:ParameterBindings>"
        "</ssd:Component></ssd:Elements></ssd:System>",
        a__fmu="x",
        v__ssv=values,
    )
    settings = flatten(read(package, tmp_path / "out")).bound_parameters
    assert [(s.component, s.variable, s.value) for s in settings] == [("a", "k", 4), ("a", "k", 3)]


@pytest.mark.parametrize(
    ("system", "message"),
    [
        ("", "no <System>"),
        (
            '<ssd:System name="s"><ssd:Elements><ssd:Component name="a" source="resources/b.fmu"/></ssd:Elements>'
            "</ssd:System>",
            "component 'a' needs 'resources/b.fmu', which is missing",
        ),
        (
            '<ssd:System name="s"><ssd:Elements><ssd:Component name="a" source="../../etc/passwd"/></ssd:Elements>'
            "</ssd:System>",
            "leaves the package",
        ),
        (
            f'<ssd:System name="s"><ssd:Elements>{COMPONENT}{COMPONENT}</ssd:Elements></ssd:System>',
            "two components are called 'a'",
        ),
        (
            '<ssd:System name="s"/><ssd:DefaultExperiment stopTime="soon"/>',
            'stopTime="soon" is not a number',
        ),
        (
            f'<ssd:System name="s"><ssd:Elements>{COMPONENT}</ssd:Elements><ssd:Connections><ssd:Connection '
            'startElement="a" startConnector="y" endElement="a" endConnector="u"><ssd:LinearTransformation factor="2"/>'
            "</ssd:Connection></ssd:Connections></ssd:System>",
            "it belongs to the namespace http://ssp-standard.org/SSP1/SystemStructureCommon",
        ),
    ],
)
def test_what_is_wrong_or_not_supported_is_refused_by_name(tmp_path, system, message):
    package = write(tmp_path / "p.ssp", system, a__fmu="x")
    with pytest.raises(PackageError) as error:
        read(package, tmp_path / "out")
    assert message in str(error.value)
    assert "\n" not in str(error.value)
    assert "SystemStructure.ssd, line" in str(error.value)


def test_comments_are_no_elements(tmp_path):
    package = write(
        tmp_path / "p.ssp",
        '<ssd:System name="s"><ssd:Elements><ssd:Component name="a" source="resources/a%62.fmu"><ssd:Connectors>'
        '<ssd:Connector name="x" kind="input"><!-- note --><ssc:Real/></ssd:Connector></ssd:Connectors>'
        "</ssd:Component></ssd:Elements></ssd:System>",
        ab__fmu="x",
    )
    (component,) = read(package, tmp_path / "out").system.elements
    assert component.connectors[0].type.kind == "Real"


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ("<x/>", "not a ParameterSet"),
        (
            '<ssv:ParameterSet xmlns:ssv="http://ssp-standard.org/SSP1/SystemStructureParameterValues"><ssv:Parameters>'
            + '<ssv:Parameter name="k"><ssv:Real value="1"/></ssv:Parameter>' * 2
            + "</ssv:Parameters></ssv:ParameterSet>",
            "'k' is given twice",
        ),
    ],
)
def test_wrong_parameter_sets(tmp_path, values, message):
    package = write(
        tmp_path / "p.ssp",
        '<ssd:System name="s"><ssd:ParameterBindings><ssd:ParameterBinding source="resources/v.ssv"/>'
        "</ssd:ParameterBindings></ssd:System>",
        v__ssv=values,
    )
    with pytest.raises(PackageError, match=message):
        read(package, tmp_path / "out")


def test_damaged_contents_are_one_line(tmp_path):
    with zipfile.ZipFile(tmp_path / "p.ssp", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("SystemStructure.ssd", "x" * 10_000 + "abc" * 3000)
    data = bytearray((tmp_path / "p.ssp").read_bytes())
    data[60:70] = b"\xff" * 10
    (tmp_path / "p.ssp").write_bytes(data)
    with pytest.raises(PackageError, match=r"damaged|unpacked"):
        extract(tmp_path / "p.ssp", tmp_path / "out")


def test_entities_are_not_expanded(tmp_path):
    secret = tmp_path / "secret"
    secret.write_text("s3cret")
    with zipfile.ZipFile(tmp_path / "p.ssp", "w") as archive:
        archive.writestr(
            "SystemStructure.ssd",
            f'<!DOCTYPE x [<!ENTITY e SYSTEM "file://{secret}">]>{HEAD}<ssd:System name="&e;"/>'
            "</ssd:SystemStructureDescription>",
        )
    try:
        assert "s3cret" not in read(tmp_path / "p.ssp", tmp_path / "out").name
    except PackageError as error:
        assert "s3cret" not in str(error)  # noqa: PT017


@pytest.mark.parametrize("name", ["../evil", "/evil", "a/../../evil", "a\\..\\evil"])
def test_no_path_leaves_the_folder(tmp_path, name):
    with zipfile.ZipFile(tmp_path / "p.ssp", "w") as archive:
        archive.writestr(name, "x")
    target = tmp_path / "deep" / "out"
    with pytest.raises(PackageError, match=r"would leave the package|has a backslash"):
        extract(tmp_path / "p.ssp", target)
    assert not list(tmp_path.rglob("evil*"))


def test_bombs_are_refused(tmp_path, monkeypatch):
    monkeypatch.setenv("DEEPSEA_COSIM_MAX_GB", "1e-6")
    with zipfile.ZipFile(tmp_path / "p.ssp", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("zeros", b"\0" * 10_000)
    with pytest.raises(PackageError, match="would unpack to") as refused:
        extract(tmp_path / "p.ssp", tmp_path / "out")
    raised = str(refused.value).partition("DEEPSEA_COSIM_MAX_GB=")[2].split()[0]
    monkeypatch.setenv("DEEPSEA_COSIM_MAX_GB", raised)
    assert extract(tmp_path / "p.ssp", tmp_path / "again")


def test_more_entries_and_components_than_are_taken(tmp_path, monkeypatch):
    with zipfile.ZipFile(tmp_path / "p.ssp", "w") as archive:
        for k in range(5):
            archive.writestr(f"entry{k}", b"")
    monkeypatch.setenv("DEEPSEA_COSIM_MAX_ENTRIES", "4")
    with pytest.raises(PackageError, match=r"5 entries, more than 4; DEEPSEA_COSIM_MAX_ENTRIES=5 in the environment"):
        extract(tmp_path / "p.ssp", tmp_path / "out")
    monkeypatch.setenv("DEEPSEA_COSIM_MAX_COMPONENTS", "1")
    limits = UnpackLimits()
    limits.element("here")
    with pytest.raises(PackageError, match="here: more than 1 components and systems; DEEPSEA_COSIM_MAX_COMPONENTS"):
        limits.element("here")


@pytest.mark.parametrize("value", ["much", "0", "-1", "inf", ""])
def test_a_limit_that_is_none_is_refused(monkeypatch, value):
    monkeypatch.setenv("DEEPSEA_COSIM_MAX_GB", value)
    with pytest.raises(UsageError, match="DEEPSEA_COSIM_MAX_GB"):
        UnpackLimits()
