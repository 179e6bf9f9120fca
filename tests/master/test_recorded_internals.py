"""Variables that are neither inputs nor outputs are recorded where a connector leads to them or somebody asks."""

from __future__ import annotations

import re

import pytest
from deepsea_cosim.core.errors import CosimError
from deepsea_cosim.master.cli import main
from deepsea_cosim.master.simulation.check import check
from deepsea_cosim.master.simulation.run import Options, run
from deepsea_cosim.master.simulation.session import Session

from benchmarks import native

from ..packages import binding, bindings, component, connector, link, package, system, values
from .parts import constant, redescribed

pytestmark = pytest.mark.skipif(native.compiler is None, reason="there is no C compiler here")


def with_locals(folder, version, fmu):
    """The linear FMU with y2 and y3 as internal variables."""
    local = "internal" if version == 1 else "local"
    changes = []
    for name in ("y2", "y3"):
        tag = re.search(rf'<\w+ name="{name}"[^>]*>', native.description(version)).group()
        changes.append((tag, tag.replace('"output"', f'"{local}"')))
    return redescribed(fmu, folder / "I.fmu", *changes)


def driven(path, fmu, *made):
    """a.y1 = 2 t, a.y2 = 5 t, a.y3 = 7 t, of an input that rises."""
    gains = bindings(binding(values({"D[1,1]": 2.0, "D[2,1]": 5.0, "D[3,1]": 7.0})))
    ramp = component("r", "resources/I.fmu", connector("y1", "output"),
                     bindings=bindings(binding(values({"A[1,2]": 1.0, "x0[2]": 1.0, "C[1,1]": 1.0}))))  # fmt: skip
    a = component("a", "resources/I.fmu", connector("u1", "input"), *made, bindings=gains)
    return package(path, system("root", ramp, a, links=(link("r.y1", "a.u1"),)), {"resources/I.fmu": fmu})


@pytest.mark.parametrize("version", [1, 2, 3])
@pytest.mark.parametrize("method", ["gauss-seidel", "jacobi", "nepce"])
def test_a_connector_of_kind_output_is_recorded(fmus, tmp_path, version, method):
    fmu = with_locals(tmp_path, version, fmus[version])
    path = driven(tmp_path / "p.ssp", fmu, connector("y1", "output"), connector("y2", "output"))
    frame = run(path, tmp_path / "out", Options(method=method)).frame()
    assert "a.y3" not in frame
    assert frame["a.y1"].iloc[-1] > 1.7
    assert frame["a.y2"].tolist() == pytest.approx((2.5 * frame["a.y1"]).tolist(), abs=1e-12)
    assert not check(path).errors


@pytest.mark.parametrize("isolate", [False, True])
def test_what_is_asked_for_by_name_is_recorded(fmus, tmp_path, isolate):
    path = driven(tmp_path / "p.ssp", with_locals(tmp_path, 2, fmus[2]))
    frame = run(path, tmp_path / "out", Options(record=("a.y3", "a.D[2,1]", "a.y1"), isolate=isolate)).frame()
    assert set(frame) == {"time", "a.y1", "a.y3", "a.D[2,1]"}
    assert frame["a.y3"].tolist() == pytest.approx((3.5 * frame["a.y1"]).tolist(), abs=1e-12)
    assert (frame["a.D[2,1]"] == 5.0).all()
    assert not check(path, Options(record=("a.y3",))).errors


def test_a_pattern_brings_internals_only_where_it_means_nothing_else(fmus, tmp_path):
    path = driven(tmp_path / "p.ssp", with_locals(tmp_path, 2, fmus[2]))
    assert "a.y2" not in run(path, tmp_path / "out", Options(record=("a.*",))).frame()
    assert {"a.y2", "r.y2"} < set(run(path, tmp_path / "out", Options(record=("*.y2",))).frame())
    with pytest.raises(CosimError, match=r"'a\.y99' matches nothing"):
        run(path, tmp_path / "out", Options(record=("a.y99",)))


def test_an_internal_array_is_recorded_whole_or_in_parts(fmus, tmp_path):
    tag = '<Float64 name="array_out" valueReference="701" causality="output" variability="continuous">'
    fmu = redescribed(fmus[3], tmp_path / "A.fmu", (tag, tag.replace('"output"', '"local"')))
    files = {"resources/A.fmu": fmu, "resources/L.fmu": fmus[3]}
    a = component("a", "resources/A.fmu", bindings=bindings(binding(values({"array_in": 4.0}))))
    path = package(tmp_path / "p.ssp", system("root", a, constant("c", 1.0)), files)
    whole = run(path, tmp_path / "out", Options(record=("a.array_out",))).frame()
    assert list(whole) == ["time", "a.array_out[1]", "a.array_out[2]", "a.array_out[3]"]
    part = run(path, tmp_path / "out", Options(record=("a.array_out[2]",))).frame()
    assert list(part) == ["time", "a.array_out[2]"]
    assert part["a.array_out[2]"].iloc[-1] == whole["a.array_out[2]"].iloc[-1]


def test_a_plot_may_show_what_is_not_recorded_otherwise(fmus, tmp_path):
    path = driven(tmp_path / "p.ssp", with_locals(tmp_path, 2, fmus[2]))
    assert main([str(path), "--plot", "a.y2", "--quiet", "--out", str(tmp_path / "out")]) == 0
    assert (tmp_path / "out" / "overview.png").is_file()


def test_a_session_records_what_it_was_opened_for(fmus, tmp_path):
    path = driven(tmp_path / "p.ssp", with_locals(tmp_path, 2, fmus[2]))
    with Session(path, internals=["a.y2"]) as session:
        rows = session.run(["a.y1", "a.y2"], 1.0, 0.1)[1]
    assert rows[:, 1].tolist() == pytest.approx((2.5 * rows[:, 0]).tolist(), abs=1e-12)
