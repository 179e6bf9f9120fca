"""Connectors of parameters that an FMU lacks: they count only where something is connected to them or set by them."""

from __future__ import annotations

import pytest
from deepsea_cosim.core.errors import CosimError
from deepsea_cosim.master.cli import main
from deepsea_cosim.master.simulation.check import check
from deepsea_cosim.master.simulation.run import Options, run

from benchmarks import native

from ..packages import binding, bindings, component, connector, link, package, system, values
from .parts import gain, last, with_fmu

pytestmark = pytest.mark.skipif(native.compiler is None, reason="there is no C compiler here")


def tripled(*more):
    """y1 = 3 u1 = 6, with connectors that the FMU does not have; two of them are bound."""
    own = bindings(binding(values({"D[1,1]": 3.0, "u1": 2.0, "fmi_StartTime": 0.0, "fmi_rTol": 1e-4})))
    return component(
        "a", "resources/L.fmu", connector("fmi_StartTime", "parameter"), connector("fmi_rTol", "calculatedParameter"),
        connector("y1", "output"), *more, bindings=own,
    )  # fmt: skip


def test_one_that_is_bound_and_connected_to_nothing_is_a_warning(fmus, tmp_path):
    path = package(tmp_path / "p.ssp", system("root", tripled()), with_fmu(fmus))
    assert last(tmp_path, path, "a.y1") == 6.0
    told = run(path, tmp_path / "out").summary["warnings"]
    for name in ("fmi_StartTime", "fmi_rTol"):
        assert any(f"'{name}'" in text for text in told)
    assert not check(path).errors
    assert main([str(path), "--check", "--quiet"]) == 0


@pytest.mark.parametrize(
    ("links", "made"),
    [
        ((link("a.fmi_rTol", "b.D[1,1]"),), ()),
        ((link("b.y1", "a.fmi_StartTime"),), ()),
        ((link("tolerance", "a.fmi_StartTime"),), (connector("tolerance", "parameter"),)),
    ],
)
def test_one_that_is_connected_is_refused_once(fmus, tmp_path, links, made):
    root = system("root", tripled(), gain("b", 1.0, connector("D[1,1]", "parameter")), links=links, made=made)
    path = package(tmp_path / "p.ssp", root, with_fmu(fmus))
    with pytest.raises(CosimError, match="component 'a' has a connector 'fmi_"):
        run(path, tmp_path / "out")
    assert len(check(path).errors) == 1


def test_one_that_the_user_sets_is_refused(fmus, tmp_path):
    path = package(tmp_path / "p.ssp", system("root", tripled()), with_fmu(fmus))
    with pytest.raises(CosimError, match="component 'a' has no parameter 'fmi_rTol'"):
        run(path, tmp_path / "out", Options(changes=(("a.fmi_rTol", "1"),)))


@pytest.mark.parametrize("kind", ["input", "output"])
def test_a_signal_that_the_fmu_lacks_is_refused(fmus, tmp_path, kind):
    path = package(tmp_path / "p.ssp", system("root", tripled(connector("u99", kind))), with_fmu(fmus))
    with pytest.raises(CosimError, match="component 'a' has a connector 'u99'"):
        run(path, tmp_path / "out")
