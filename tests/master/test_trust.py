"""What the record of a run says of its coupling is the same in whatever units the two sides speak.

A unit of both sides: a mass (velocity for force) and a spring (force for velocity), Jacobi. Between the points the
products are exact, so the energy that the coupling creates is the growth of m v^2 / 2 + F^2 / (2 k).
"""

from __future__ import annotations

from math import pi

import numpy as np
import pytest
from deepsea_cosim import simulate
from deepsea_cosim.core.unit_names import named

from benchmarks import native

from ..packages import binding, bindings, component, connector, link, package, system, values

pytestmark = pytest.mark.skipif(native.compiler is None, reason="there is no C compiler here")

MASS, STIFFNESS, H = 2.0, 50.0, 0.02
OMEGA_H = np.sqrt(STIFFNESS / MASS) * H


def side(name, file, of_input, of_output, rate, start, given):
    """y' = rate u, both in SI units; what the FMU speaks are `of_input` and `of_output`."""
    into, out = named(of_input).factor, named(of_output).factor
    matrices = native.values("", A=[[0.0]], B=[[rate * into / out]], C=[[1.0]], x0=[start / out])
    ports = connector("u1", "input", unit=of_input if given else None), connector("y1", "output")
    inside = binding(values({k.removeprefix("."): v for k, v in matrices.items()}))
    return component(name, f"resources/{file}.fmu", *ports, bindings=bindings(inside))


@pytest.fixture(scope="module")
def build(tmp_path_factory):
    folder, made = tmp_path_factory.mktemp("fmus"), {}

    def fmu(of_input, of_output):
        key = of_input, of_output
        if key not in made:
            name = f"part{len(made)}"
            made[key] = native.linear(folder, 2, name, through=False, units={"u1": of_input, "y1": of_output})
        return made[key]

    return fmu


def coupled(build, path, mass=("N", "m/s"), spring=("m/s", "N"), turned=False, forth=None, back=None, given=False):
    """The only bond of a run, and v, F in SI units."""
    factors = [f or 1.0 for f in (forth, back)]
    parts = (
        side("mass", "mass", *mass, 1.0 / (MASS * factors[1]), 1.0, given),
        side("spring", "spring", *spring, -STIFFNESS / factors[0], 0.0, given),
    )
    ends = ("mass.y1", "spring.u1", forth), ("spring.y1", "mass.u1", back)
    ways = [link(a, b, f'<ssc:LinearTransformation factor="{by}"/>' if by else "") for a, b, by in ends]
    root = system("root", *parts, links=ways[::-1] if turned else ways)
    fmus = {"resources/mass.fmu": build(*mass), "resources/spring.fmu": build(*spring)}
    made = package(path / "p.ssp", root, fmus, stop=5.0, step=H)
    result = simulate(made, path / "out", method="jacobi")
    v = result.frame()["mass.y1"].to_numpy() * named(mass[1]).factor
    F = result.frame()["spring.y1"].to_numpy() * named(spring[1]).factor
    return result.summary["coupling"][0], v, F, result.summary["warnings"]


def check(told, v, F, warnings, energy=1.0):
    grown = np.diff((0.5 * MASS * v**2 + 0.5 * F**2 / STIFFNESS)[[0, -1]])[0]
    assert abs(told["net_residual_energy_J"]) == pytest.approx(energy * grown, rel=1e-9)
    assert told["exchanged_energy_J"] == pytest.approx(energy * 71.46647476152316, rel=1e-9)
    assert told["omega_h"] == pytest.approx(OMEGA_H, rel=1e-9)
    assert told["numerical_damping"] == pytest.approx(-0.5 * OMEGA_H, rel=0.02)
    assert any("grows" in w for w in warnings)


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("given", [False, True])
@pytest.mark.parametrize(
    ("mass", "spring"),
    [
        (("N", "m/s"), ("m/s", "N")),
        (("N", "m/s"), ("m/s", "kN")),
        (("N", "m/s"), ("mm/s", "N")),
        (("kN", "mm/s"), ("m/s", "N")),
        (("N", "mm/s"), ("m/s", "kN")),
        (("Pa", "L/min"), ("m3/s", "bar")),
        (("N.m", "deg/s"), ("rad/s", "N.m")),
    ],
)
def test_units_at_the_two_ends_do_not_matter(build, tmp_path, mass, spring, turned, given):
    check(*coupled(build, tmp_path, mass, spring, turned, given=given))


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("unit", ["rpm", "1/min"])
def test_an_angle_in_turns_at_one_end(build, tmp_path, unit, turned):
    """rev/min against N.m: a turn is 2 pi, and the product of the units alone is no power."""
    told, v, F, warnings = coupled(build, tmp_path, ("N.m", unit), (unit, "N.m"), turned)
    check(told, v, F, warnings, 2.0 * pi)


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize(("forth", "back", "energy"), [(3.0, 3.0, 3.0), (-3.0, -3.0, 3.0), (-1.0, None, 1.0),
                                                       (None, -1.0, 1.0), (4.0, None, 1.0)])  # fmt: skip
def test_what_the_connections_multiply_by(build, tmp_path, forth, back, energy, turned):
    """A gear passes on the power behind it; one that is in one direction only counts for neither."""
    check(*coupled(build, tmp_path, turned=turned, forth=forth, back=back), energy)
