"""Which connections make a power bond: by units, by names where there are several, or as the package says."""

from __future__ import annotations

import numpy as np
import pytest
from deepsea_cosim.master.coupling.power_bonds import _apart, find_bonds
from deepsea_cosim.master.simulation.run import Options, run
from deepsea_cosim.master.simulation.session import Session
from deepsea_cosim.master.simulation.session_warnings import SessionWarnings

from benchmarks import native

from ..packages import (
    component,
    connector,
    description,
    link,
    pack,
    package,
    system,
)
from .parts import redescribed

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


def test_a_declared_bond_counts_beside_what_the_units_say(tmp_path, fmus):
    """Two forces and two speeds are paired by name, unless the package says which of them belong together."""
    ports = [connector(u, "input") for u in PORTS[0]] + [connector(y, "output") for y in PORTS[1]]
    parts = (component(name, f"resources/{name}.fmu", *ports) for name in ("mass", "spring"))
    links = [link(f"{a}.y{k}", f"{b}.u{k}") for a, b in (("mass", "spring"), ("spring", "mass")) for k in (1, 2)]
    text = description(system("root", *parts, links=links), stop=1.0, step=0.1)
    said = text.replace('stepSize="0.1"/>', 'stepSize="0.1"><Bond a="mass.y1" b="spring.y2"/></Master>')
    assert said != text
    path = pack(tmp_path / "p.ssp", {"SystemStructure.ssd": said, **fmus})
    with Session(path) as session:
        assert sorted(b.name for b in find_bonds(session.system)) == ["mass.y1 x spring.y2", "mass.y2 x spring.y1"]


def test_a_declared_bond_needs_no_units(tmp_path, fmus):
    links = [link("mass.y1", "none.u1"), link("none.y1", "mass.u1")]
    parts = (
        component(name, f"resources/{file}.fmu", connector("u1", "input"), connector("y1", "output"))
        for name, file in (("mass", "mass"), ("none", "none"))
    )
    text = description(system("root", *parts, links=links), stop=1.0, step=0.1)
    files = {**fmus, "resources/none.fmu": native.linear(tmp_path, 2, "none", through=False)}
    for said, found in (("/>", []), ('><Bond a="mass.y1" b="none.y1"/></Master>', ["mass.y1 x none.y1"])):
        whole = text.replace('stepSize="0.1"/>', f'stepSize="0.1"{said}')
        with Session(pack(tmp_path / "p.ssp", {"SystemStructure.ssd": whole, **files})) as session:
            assert [b.name for b in find_bonds(session.system)] == found


@pytest.mark.parametrize("method", ["gauss-seidel", "jacobi"])
def test_arrays_make_a_bond_with_each_element(tmp_path, method):
    """Three forces for three speeds, as arrays of FMI 3.0; the energies are those of the record."""
    native.linear(tmp_path, 3, "L", through=False, units={"u1": "N", "u2": "m/s"})
    units = {"mass": ("N", "m/s"), "spring": ("m/s", "N")}

    def with_units(name, given, made):
        said = ("in", given), ("out", made)
        changes = ((f'name="array_{way}"', f'name="array_{way}" unit="{unit}"') for way, unit in said)
        begin = 'start="0 0 0"', 'start="1 2 3"'
        return redescribed(tmp_path / "L3.fmu", tmp_path / f"{name}.fmu", *changes, begin)

    files = {f"resources/{name}.fmu": with_units(name, *both) for name, both in units.items()}
    ports = connector("array_in", "input", None), connector("array_out", "output", None)
    parts = (component(name, f"resources/{name}.fmu", *ports) for name in units)
    halved = '<ssc:LinearTransformation factor="0.5" offset="1"/>'
    links = link("mass.array_out", "spring.array_in", halved), link("spring.array_out", "mass.array_in")
    path = package(tmp_path / "p.ssp", system("root", *parts, links=links), files, stop=1.0, step=0.1)
    result = run(path, tmp_path / "out", Options(method=method))
    told = result.summary["coupling"]
    assert [b["bond"] for b in told] == [f"mass.array_out[{k}] x spring.array_out[{k}]" for k in (1, 2, 3)]
    for k, bond in enumerate(told, 1):
        v, f = (result.frame()[f"{name}.array_out[{k}]"].to_numpy() for name in units)
        held_f, held_v = (result.frame()[f"{name}.array_in[{k}]"].to_numpy()[:-1] for name in units)
        left, right = (v[1:] + v[:-1]) / 2.0 * held_f, (f[1:] + f[:-1]) / 2.0 * (held_v - 1.0) / 0.5
        assert bond["residual_energy_J"] == pytest.approx(0.1 * np.abs(left - right).sum())
        assert bond["exchanged_energy_J"] == pytest.approx(0.1 * np.abs(left + right).sum() / 2.0)
    with Session(path) as session:
        assert len(find_bonds(session.system)) == 3
        assert SessionWarnings(session).record == []


@pytest.mark.parametrize(
    ("names", "apart"),
    [(["Fx", "Fy"], ["x", "y"]), (["torque_x", "torque_y"], ["x", "y"]), (["xdot", "ydot"], ["x", "y"]),
     (["FX", "fy"], ["x", "y"]), (["v"], ["v"]), (["tau1", "tau12"], ["", "2"]), (["a", "a"], ["a", "a"])],
)  # fmt: skip
def test_what_tells_names_apart(names, apart):
    assert _apart(names) == apart
