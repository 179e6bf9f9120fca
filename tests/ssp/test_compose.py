"""Packages composed from FMUs and links: what they compute, and what cannot be."""

import zipfile

import pytest
from deepsea_cosim.core.errors import PackageError
from deepsea_cosim.master.simulation.check import check
from deepsea_cosim.master.simulation.run import Options, run
from deepsea_cosim.ssp.compose import compose
from deepsea_cosim.ssp.document import SSD
from lxml import etree

from benchmarks import native

from ..master.parts import redescribed

pytestmark = pytest.mark.skipif(native.compiler is None, reason="there is no C compiler here")


@pytest.fixture(scope="module")
def fmus(tmp_path_factory):
    folder = tmp_path_factory.mktemp("fmus")
    return {version: native.linear(folder, version) for version in (2, 3)}


CLOCK = {"clock.A[1,2]": 1.0, "clock.x0[2]": 1.0, "clock.C[1,1]": 1.0, "gain.D[1,1]": 3.0}
"""x1' = x2 = 1, y = x1 = t; and three times that."""


@pytest.mark.parametrize("versions", [(2, 2), (2, 3), (3, 3)])
def test_it_runs_and_has_nothing_wrong(fmus, tmp_path, versions):
    """Two components of one FMU have it once."""
    parts = dict(zip(("clock", "gain"), (fmus[v] for v in versions), strict=True))
    values = {**CLOCK, "clock.trouble": 0}
    path = compose(tmp_path / "p.ssp", parts, [("clock.y1", "gain.u1")], values, stop=1.0, step=0.25, method="jacobi")
    assert not check(path).errors
    result = run(path, tmp_path / "out", Options())
    assert result.summary["method"] == "jacobi"
    frame = result.frame()
    assert frame["clock.y1"].tolist() == pytest.approx([0.0, 0.25, 0.5, 0.75, 1.0])
    assert frame["gain.y1"].iloc[-1] == pytest.approx(3.0)


def test_fmus_of_one_name_from_two_folders_are_two(fmus, tmp_path):
    other = tmp_path / "other" / fmus[2].name
    other.parent.mkdir()
    other.write_bytes(fmus[2].read_bytes())
    path = compose(tmp_path / "p.ssp", {"clock": fmus[2], "gain": other}, [("clock.y1", "gain.u1")], CLOCK, step=0.5)
    assert not check(path).errors


def test_an_fmu_called_like_another_ones_component_is_not_lost(fmus, tmp_path):
    """The second has a file of the first one's name, and the name to evade to is that as well."""
    old, new = tmp_path / "old" / "gain.fmu", tmp_path / "new" / "gain.fmu"
    for path, version in ((old, 2), (new, 3)):
        path.parent.mkdir()
        path.write_bytes(fmus[version].read_bytes())
    path = compose(tmp_path / "p.ssp", {"clock": old, "gain": new, "gain_2": old}, [], step=0.5)
    with zipfile.ZipFile(path) as made:
        root = etree.fromstring(made.read("SystemStructure.ssd"))
        packed = {c.get("name"): made.read(c.get("source")) for c in root.iterfind(f".//{SSD}Component")}
    assert packed == {"clock": old.read_bytes(), "gain": new.read_bytes(), "gain_2": old.read_bytes()}


FOOT = '<BaseUnit m="1" factor="0.3048"/>'


@pytest.mark.parametrize("version", [2, 3])
def test_a_unit_that_an_fmu_does_not_define_is_what_its_name_says(tmp_path, version):
    """And no plain number, which could not become a pressure."""
    made = native.linear(tmp_path / "a", version, units={"y1": "ft"})
    feet = redescribed(made, tmp_path / "a.fmu", (f'<Unit name="ft">{FOOT}</Unit>', '<Unit name="ft"/>'))
    metres = native.linear(tmp_path / "b", version, units={"u1": "m"})
    values = {**CLOCK, "gain.D[1,1]": 1.0}
    path = compose(tmp_path / "p.ssp", {"clock": feet, "gain": metres}, [("clock.y1", "gain.u1")], values, 1.0, 0.5)
    assert run(path, tmp_path / "out", Options()).frame()["gain.y1"].iloc[-1] == pytest.approx(0.3048)


def test_a_unit_that_two_fmus_define_is_that_of_each(tmp_path):
    """The package says nothing of it, for what it says would count for both."""
    feet = native.linear(tmp_path / "a", 2, units={"y1": "ft"})
    own = redescribed(feet, tmp_path / "own.fmu", (FOOT, '<BaseUnit m="1" factor="0.5"/>'))
    same = redescribed(feet, tmp_path / "same.fmu", (FOOT, '<BaseUnit factor="3.048e-1" m="1" s="0"/>'))
    metres = native.linear(tmp_path / "b", 2, units={"u1": "m"})
    for other, length in ((own, 0.5), (same, 0.3048)):
        fmus = {"idle": feet, "clock": other, "gain": metres}
        values = {**CLOCK, "gain.D[1,1]": 1.0}
        path = compose(tmp_path / "p.ssp", fmus, [("clock.y1", "gain.u1")], values, 1.0, 0.5)
        assert run(path, tmp_path / "out", Options()).frame()["gain.y1"].iloc[-1] == pytest.approx(length)
        with zipfile.ZipFile(path) as made:
            assert ('name="ft"' in made.read("SystemStructure.ssd").decode()) == (other == same)


@pytest.mark.parametrize(
    ("links", "values", "words"),
    [([("clok.y1", "gain.u1")], {}, "no component of that name; did you mean 'clock'"),
     ([("clock.z9", "gain.u1")], {}, "has no variable 'z9'"),
     ([("gain.u1", "clock.u1")], {}, "'gain.u1' is of causality input; expected output or"),
     ([("clock.y1", "gain.y1")], {}, "'gain.y1' is of causality output; expected input or"),
     ([], {"clock.AA": 1.0}, "has no variable 'AA'"), ([], {"A": 1.0}, "expected component.variable")],
)  # fmt: skip
def test_what_is_not_there_is_named(fmus, tmp_path, links, values, words):
    with pytest.raises(PackageError) as caught:
        compose(tmp_path / "p.ssp", {"clock": fmus[2], "gain": fmus[2]}, links, values)
    assert words in str(caught.value)
    assert not (tmp_path / "p.ssp").exists()
