"""A name that nothing has: which one may be meant, and where it is."""

from __future__ import annotations

import re

import pytest
from deepsea_cosim.core.errors import CosimError
from deepsea_cosim.master.simulation.check import check
from deepsea_cosim.master.simulation.run import Options, run
from deepsea_cosim.master.simulation.session import Session

from benchmarks import native

from ..packages import binding, bindings, component, connector, link, package, system, values
from .parts import gain, redescribed

pytestmark = pytest.mark.skipif(native.compiler is None, reason="there is no C compiler here")


@pytest.fixture
def path(fmus, tmp_path):
    """'a' has square, trouble, u1 to u6; 'b' has a weight instead of square, and trouble; an input 'force' of the
    system."""
    other = redescribed(native.linear(tmp_path / "n", 2, plain=True), tmp_path / "W.fmu",
                        ('name="square"', 'name="load_weight"'))  # fmt: skip
    root = system("root", gain("a", 3.0), component("b", "resources/W.fmu"), made=(connector("force", "input"),),
                  links=(link("force", "a.u1"),))  # fmt: skip
    return package(tmp_path / "p.ssp", root, {"resources/L.fmu": fmus[2], "resources/W.fmu": other})


@pytest.mark.parametrize(
    ("address", "names"),
    [
        ("b.load_weight_kg", {"load_weight"}),  # with a unit behind
        ("b.load_weight [kg]", {"load_weight"}),
        ("a.u3_Nm_per_rad", {"u3"}),
        ("load_weight_kg", {"load_weight", "b"}),  # without a component
        ("a.load_weight", {"load_weight", "b"}),  # of another component
        ("a.load_wieght", {"load_weight", "b"}),
        ("a.load_weight_kg", {"load_weight", "b"}),
        ("bb.load_weight", {"b.load_weight"}),
        ("toruble", {"trouble", "a", "b"}),
        ("froce", {"force"}),  # an input of the system
        ("zzz", set()),
    ],
)
def test_a_name_in_set(path, tmp_path, address, names):
    with pytest.raises(CosimError) as error:
        run(path, tmp_path / "out", Options(changes=((address, "1"),)))
    hint = str(error.value).partition("parameter '")[2].partition("'; ")[2]
    assert set(re.findall(r"'([^']+)'", hint)) == names
    assert check(path, Options(changes=((address, "1"),))).errors == [str(error.value)]


def test_a_name_in_a_session(path):
    with Session(path) as session, pytest.raises(CosimError, match=r"'force'"):
        session.run(["a.y1"], 1.0, 0.1, {"froce": 1.0})


@pytest.mark.parametrize(("name", "meant"), [("bb.square", "b"), ("froce", "force"), ("a.load_weight", "'b'")])
def test_a_name_in_a_binding_of_the_system(fmus, tmp_path, name, meant):
    other = redescribed(native.linear(tmp_path / "n", 2, plain=True), tmp_path / "W.fmu",
                        ('name="square"', 'name="load_weight"'))  # fmt: skip
    root = system("root", gain("a", 3.0), component("b", "resources/W.fmu"), made=(connector("force", "input"),),
                  links=(link("force", "a.u1"),), bindings=bindings(binding(values({name: 1.0}))))  # fmt: skip
    path = package(tmp_path / "p.ssp", root, {"resources/L.fmu": fmus[2], "resources/W.fmu": other})
    told = next(text for text in check(path).warnings if "is ignored" in text)
    assert meant in told.partition("ignored; ")[2]
