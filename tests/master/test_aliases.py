"""Variables that have several names: what an FMU says of one of them counts for all."""

from __future__ import annotations

import pytest
from deepsea_cosim.master.algorithms import NAMES
from deepsea_cosim.master.simulation.run import Options, run
from deepsea_cosim.master.simulation.session import Session
from deepsea_cosim.master.slaves.fmu import describe

from benchmarks import native

from ..packages import binding, bindings, component, connector, link, package, system, values
from .parts import linear, redescribed

pytestmark = pytest.mark.skipif(native.compiler is None, reason="there is no C compiler here")


def renamed(folder, version, *changes):
    """An FMU whose u1 is called u9, too, and its y1 y9; it says what its outputs depend on."""
    fmu, target = native.linear(folder / "n", version, direct=True), folder / "A.fmu"
    if version == 3:
        for old, new in (("u1", "u9"), ("y1", "y9")):
            start = ' start="0"' if old == "u1" else ""
            reference, causality = (0, "input") if old == "u1" else (10, "output")
            head = f'<Float64 name="{old}" valueReference="{reference}" causality="{causality}" '
            head += f'variability="continuous"{start}>'
            changes = (*changes, (head, f'{head}<Alias name="{new}"/>'))
        return redescribed(fmu, target, *changes)
    more = "".join(
        f'<ScalarVariable name="{name}" valueReference="{reference}" causality="{causality}" variability="continuous">'
        f"<Real{start}/></ScalarVariable>"
        for name, reference, causality, start in (("u9", 0, "input", ' start="0"'), ("y9", 10, "output", ""))
    )
    return redescribed(fmu, target, *changes, ("</ModelVariables>", f"{more}</ModelVariables>"))


@pytest.mark.parametrize("version", [1, 2, 3])
def test_dependencies_are_known_by_all_names(tmp_path, version):
    fmu = describe("a", renamed(tmp_path, version))
    assert {"u1", "u2", "u9"} <= {*fmu.direct_feedthrough("y1")}
    assert {*fmu.direct_feedthrough("y9")} == {*fmu.direct_feedthrough("y1")}
    assert {*fmu.dependencies(fmu.description.initialUnknowns).get("y9", ["u9"])} >= {"u9"}


def gain(name, u, y, g):
    return component(name, "resources/A.fmu", connector(u, "input"), connector("u2", "input"), connector(y, "output"),
                     bindings=bindings(binding(values({"D[1,1]": g, "D[1,2]": 1.0}))))  # fmt: skip


@pytest.mark.parametrize("version", [1, 2, 3])
@pytest.mark.parametrize(("u", "y"), [("u9", "y1"), ("u1", "y9"), ("u9", "y9")])
def test_an_output_follows_an_input_by_another_name_at_once(tmp_path, version, u, y):
    """A state that is t, and three times that; the package lists them the other way round."""
    clock = linear("clock", A=[[0, 1], [0, 0]], C=[[1, 0]], x0=[0, 1])
    files = {"resources/L.fmu": native.linear(tmp_path, 2), "resources/A.fmu": renamed(tmp_path, version)}
    root = system("root", gain("a", u, y, 3.0), clock, links=(link("clock.y1", f"a.{u}"),))
    frame = run(package(tmp_path / "p.ssp", root, files), tmp_path / "out", Options(method="jacobi")).frame()
    assert frame[f"a.{y}"].tolist() == pytest.approx((3.0 * frame["time"]).tolist())


@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize("method", NAMES)
def test_a_loop_through_other_names_is_solved(tmp_path, version, method):
    """y_a = -3 y_b, y_b = y_a + 1."""
    one = linear("one", C=[[1]], x0=[1.0])
    files = {"resources/L.fmu": native.linear(tmp_path, 2), "resources/A.fmu": renamed(tmp_path, version)}
    links = (link("b.y1", "a.u9"), link("a.y9", "b.u1"), link("one.y1", "b.u2"))
    root = system("root", one, gain("a", "u9", "y9", -3.0), linear("b", D=[[1.0, 1.0]]), links=links)
    frame = run(package(tmp_path / "p.ssp", root, files), tmp_path / "out", Options(method=method)).frame()
    assert frame["a.y9"].tolist() == pytest.approx([-0.75] * len(frame))


@pytest.mark.parametrize("declared", [True, None])
def test_what_was_found_counts_for_all_names(tmp_path, declared):
    """Both names of an output are connected, and the FMU does not say what it depends on."""
    said = () if declared else ((' dependencies="1 2 3 4 5 6"', ""),)
    files = {"resources/L.fmu": native.linear(tmp_path, 2), "resources/A.fmu": renamed(tmp_path, 2, *said)}
    both = gain("a", "u1", "y1", -3.0).replace("</ssd:Connectors>", connector("y9", "output") + "</ssd:Connectors>")
    links = (link("a.y1", "b.u1"), link("a.y9", "b.u2"), link("b.y1", "a.u1"))
    path = package(tmp_path / "p.ssp", system("root", both, linear("b", D=[[0.5, 0.5]]), links=links), files)
    with Session(path) as session:
        session.run(["a.y1"], 0.1, 0.1)
        assert "u1" in session.system.instances["a"].direct_feedthrough("y1")
        assert "u1" in session.system.instances["a"].direct_feedthrough("y9")


@pytest.mark.parametrize("of", ["u1", "u9"])
def test_the_rate_of_an_input_is_known_by_all_names(tmp_path, of):
    """u2 is the derivative of u1, which is connected by either name: that one is no mean."""
    old = '<ScalarVariable name="u2" valueReference="1" causality="input" variability="continuous"><Real start="0"/>'
    fmu = renamed(tmp_path, 2, (old, old.replace("<Real", '<Real derivative="1"')))
    files = {"resources/L.fmu": native.linear(tmp_path, 2), "resources/A.fmu": fmu}
    clock = linear("clock", A=[[0, 1], [0, 0]], C=[[1, 0]], x0=[0, 1])
    links = (link("clock.y1", f"a.{of}"), link("clock.y1", "a.u2"))
    root = system("root", clock, gain("a", of, "y1", 3.0), links=links)
    with Session(package(tmp_path / "p.ssp", root, files)) as session:
        writer = session.system.writer
        assert {li.target.name: writer.is_averaged(li) for li in session.system.links} == {of: False, "u2": True}
