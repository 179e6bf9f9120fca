"""Which connections make a power bond: by units, by names where there are several, or as the package says."""

from __future__ import annotations

import pytest
from deepsea_cosim.master.bonds import _apart
from deepsea_cosim.master.session import Session
from deepsea_cosim.master.trust import find_bonds

from benchmarks import native

from ..packages import component, connector, link, package, system

pytestmark = pytest.mark.skipif(native.compiler is None, reason="there is no C compiler here")

PORTS = [f"u{k}" for k in range(1, 4)], [f"y{k}" for k in range(1, 4)]


@pytest.fixture(scope="module")
def fmus(tmp_path_factory):
    """A mass that gives speeds for forces, and a spring the other way round."""
    folder = tmp_path_factory.mktemp("fmus")
    force, speed = ({f"{letter}{k}": unit for k in range(1, 4)} for letter, unit in (("u", "N"), ("y", "m/s")))
    back, forth = ({f"{letter}{k}": unit for k in range(1, 4)} for letter, unit in (("y", "N"), ("u", "m/s")))
    return {
        "resources/mass.fmu": native.linear(folder, 2, "mass", through=False, units=force | speed),
        "resources/spring.fmu": native.linear(folder, 2, "spring", through=False, units=back | forth),
    }


def bonds(tmp_path, fmus, *links):
    ports = [connector(u, "input") for u in PORTS[0]] + [connector(y, "output") for y in PORTS[1]]
    parts = (component(name, f"resources/{name}.fmu", *ports) for name in ("mass", "spring"))
    path = package(tmp_path / "p.ssp", system("root", *parts, links=links), fmus, stop=1.0, step=0.1)
    with Session(path) as session:
        return [bond.name for bond in find_bonds(session.system)]


def test_forces_and_speeds_of_several_directions_are_paired_by_name(tmp_path, fmus):
    """Not each force with each speed; the order in which they stand does not matter."""
    speeds = [link(f"mass.y{k}", f"spring.u{k}") for k in (1, 2, 3)]
    forces = [link(f"spring.y{k}", f"mass.u{k}") for k in (3, 1, 2)]
    assert sorted(bonds(tmp_path, fmus, *speeds, *forces)) == [f"mass.y{k} x spring.y{k}" for k in (1, 2, 3)]


def test_two_forces_that_act_at_one_speed_are_two_bonds(tmp_path, fmus):
    """The speed of one point, and the two forces that work there."""
    found = bonds(tmp_path, fmus, link("mass.y1", "spring.u1"), *(link(f"spring.y{k}", f"mass.u{k}") for k in (1, 2)))
    assert found == ["mass.y1 x spring.y1", "mass.y1 x spring.y2"]


@pytest.mark.parametrize(
    ("names", "apart"),
    [(["Fx", "Fy"], ["x", "y"]), (["torque_x", "torque_y"], ["x", "y"]), (["xdot", "ydot"], ["x", "y"]),
     (["FX", "fy"], ["x", "y"]), (["v"], ["v"]), (["tau1", "tau12"], ["", "2"]), (["a", "a"], ["a", "a"])],
)  # fmt: skip
def test_what_tells_names_apart(names, apart):
    assert _apart(names) == apart
