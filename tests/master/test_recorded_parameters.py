"""Parameters in force become columns of the results on request, in every format."""

from __future__ import annotations

import json

import numpy as np
import pytest
from deepsea_cosim.core.errors import UsageError
from deepsea_cosim.master.cli import main
from deepsea_cosim.master.results.frame import frame
from deepsea_cosim.master.simulation.run import Options, run

from benchmarks import native

from ..packages import binding, bindings, component, connector, link, package, parameter, parameter_set, system
from .parts import constant, gain, redescribed, two, with_fmu

pytestmark = pytest.mark.skipif(native.compiler is None, reason="there is no C compiler here")


@pytest.mark.parametrize("name", ["r.csv", "r.parquet", "r.h5"])
def test_parameters_are_columns_of_one_value(fmus, tmp_path, name):
    for module in {"r.parquet": ("pyarrow",), "r.h5": ("h5py",)}.get(name, ()):
        pytest.importorskip(module)
    path = two(tmp_path / "p.ssp", fmus[2])
    patterns = ("b.D[1,1]", "a.x0*")
    result = run(path, tmp_path / "out", Options(
        results=name, record=("b.y1",), record_parameters=patterns, changes={"b.D[1,1]": 2.5}))  # fmt: skip
    made, plain = result.frame(), run(path, tmp_path / "plain", Options(results=name, record=("b.y1",))).frame()
    assert list(made) == ["time", "b.y1", *(f"a.x0[{k + 1}]" for k in range(6)), "b.D[1,1]"]
    assert len(made) == len(plain) == 101
    assert made["b.D[1,1]"].tolist() == [2.5] * 101
    assert made["a.x0[2]"].tolist() == [1.0] * 101
    assert made["a.x0[1]"].tolist() == [0.0] * 101
    assert made["b.y1"].iloc[-1] == pytest.approx(1.25 * plain["b.y1"].iloc[-1])
    assert result.summary["columns"] == list(made)
    assert frame(tmp_path / "out" / name)["b.D[1,1]"].iloc[0] == 2.5


def test_types_and_units_are_the_parameters_own(fmus, tmp_path):
    """A text, a whole number, a truth value, an item, and an array's size and starts."""
    given = [parameter("string_in", "String", "007"), parameter("integer_in", "Integer", -3),
             parameter("boolean_in", "Boolean", "true"), parameter("item_in", "Enumeration", "blue")]  # fmt: skip
    a = component("a", "resources/L.fmu", connector("y1", "output"), bindings=bindings(binding(parameter_set(*given))))
    path = package(tmp_path / "p.ssp", system("root", a), {"resources/L.fmu": native.linear(
        tmp_path, 3, units={"x0[1]": "mm"})})  # fmt: skip
    patterns = ("a.*_in", "a.x0[1]", "a.size")
    result = run(path, tmp_path / "out", Options(record=("a.y1",), record_parameters=patterns, record_every=4))
    made = result.frame()
    row = made.iloc[-1]
    assert (row["a.string_in"], row["a.integer_in"], row["a.item_in"], row["a.size"]) == ("007", -3, 3, 2)
    assert made["a.boolean_in"].dtype == bool
    assert made["a.boolean_in"].all()
    assert np.issubdtype(made["a.size"].dtype, np.integer)
    assert made.attrs["units"]["a.x0[1]"] == "mm"


def test_what_a_connection_brings_or_only_the_fmu_knows_is_there(fmus, tmp_path):
    tag = 'name="y2" valueReference="11" causality="output" variability="continuous"'
    calculates = redescribed(fmus[2], tmp_path / "C.fmu", (
        tag, 'name="y2" valueReference="11" causality="calculatedParameter" variability="fixed"'))  # fmt: skip
    a = component("a", "resources/C.fmu", connector("y2", "calculatedParameter"), bindings=bindings(
        binding(parameter_set(parameter("C[2,1]", "Real", 3.0), parameter("x0[1]", "Real", 2.0)))))  # fmt: skip
    b = component("b", "resources/L.fmu", connector("D[1,1]", "parameter"), connector("y1", "output"))
    root = system("root", a, b, links=(link("a.y2", "b.D[1,1]"),))
    path = package(tmp_path / "p.ssp", root, {"resources/C.fmu": calculates, "resources/L.fmu": fmus[2]})
    result = run(path, tmp_path / "out", Options(record_parameters=("b.D[1,1]",)))
    assert result.summary["parameters"]["b.D[1,1]"]["value"] == 6.0
    assert result.frame()["b.D[1,1]"].unique().tolist() == [6.0]


def test_a_pattern_without_a_parameter_is_refused_before_the_run(fmus, tmp_path, capsys):
    path = package(tmp_path / "p.ssp", system("root", constant("a", 1.0), gain("b", 2.0)), with_fmu(fmus))
    with pytest.raises(UsageError, match=r"'b\.D\[1,9\]' matches no parameter; did you mean 'b\.D\[1"):
        run(path, tmp_path / "out", Options(record_parameters=("b.D[1,9]",)))
    assert not (tmp_path / "out").exists()
    given = ["--record-parameters", "b.D[1,1]", "--record", "b.D[1,1]", "--record", "b.y1", "--quiet"]
    assert main([str(path), "--out", str(tmp_path / "out"), *given]) == 0
    head, row = (tmp_path / "out" / "results.csv").read_text().splitlines()[:2]
    assert head == 'time,b.y1,"b.D[1,1]"'  # once
    assert row.split(",")[-1] == "2.0"
    manifest = json.loads((tmp_path / "out" / "manifest.json").read_text())
    assert "--record-parameters 'b.D[1,1]'" in manifest["command"]
