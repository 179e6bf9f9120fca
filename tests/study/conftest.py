"""A package of native FMUs that sweeps are tried on."""

from __future__ import annotations

import pytest

from benchmarks import native

from ..packages import binding, bindings, component, connector, link, package, system, values


@pytest.fixture(scope="session")
def doubled(tmp_path_factory):
    """A ramp, a.y1 = t, that component b multiplies by D; b makes trouble from a time on (3: a crash, 1: an error)."""
    if native.compiler is None:
        pytest.skip("there is no C compiler here")
    folder = tmp_path_factory.mktemp("doubled")
    ramp = component("a", "resources/L.fmu", connector("y1", "output"),
                     bindings=bindings(binding(values({"A[1,2]": 1.0, "x0[2]": 1.0, "C[1,1]": 1.0}))))  # fmt: skip
    twice = component("b", "resources/L.fmu", connector("u1", "input"), connector("y1", "output"), bindings=bindings(
        binding(values({"D[1,1]": 2.0, "trouble": 0.0, "when": 0.5}))))  # fmt: skip
    root = system("root", ramp, twice, links=(link("a.y1", "b.u1"),))
    return package(folder / "p.ssp", root, {"resources/L.fmu": native.linear(folder, 2)}, stop=1.0, step=0.01)
