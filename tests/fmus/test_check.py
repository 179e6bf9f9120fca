"""`cosim-fmus check` on FMUs of anybody: all versions and types, their states and suggested steps."""

from __future__ import annotations

import pytest
from deepsea_cosim.fmus.check import faults

from benchmarks import native

from ..master.parts import redescribed, rewritten

pytestmark = pytest.mark.skipif(native.compiler is None, reason="there is no C compiler here")


@pytest.mark.parametrize("version", [1, 2, 3])
def test_all_types_are_read_by_their_own_functions(tmp_path, version):
    assert faults(native.linear(tmp_path, version)) == []


@pytest.mark.parametrize(("version", "kind", "name"), [
    (1, "String", "string_out"), (2, "Integer", "integer_out"), (2, "Boolean", "boolean_out"),
    (3, "String", "string_out"),
])  # fmt: skip
def test_a_type_that_cannot_be_read_is_named(tmp_path, version, kind, name):
    head = "int INTEGER(Get)" if kind == "Integer" else f"int EXPORT(Get{kind})"
    text = (native.HERE / "fmus" / "linear.c").read_text()
    begin = text[text.index(head) : text.index("{", text.index(head)) + 1]
    (told,) = faults(rewritten(tmp_path, version, (begin, f"{begin} return 3;")))
    assert f"reading '{name}'" in told


@pytest.mark.parametrize("version", [2, 3])
def test_a_state_that_cannot_be_put_back_is_told(tmp_path, version):
    state = "State" if version == 3 else "state"
    head = f"int fmi{version}SetFMU{state}(Model *m, Model *s) {{"
    (told,) = faults(rewritten(tmp_path, version, (head, f"{head} return 3;")))
    assert f"fmi{version}SetFMU{state}" in told


@pytest.mark.parametrize("suggested", [True, False])
def test_the_suggested_step_is_taken(tmp_path, suggested):
    """An FMU that takes steps of 0.25 s only."""
    begin = "int EXPORT(DoStep)(Model *m, double t, double h, Bool keep) {"
    fmu = rewritten(tmp_path, 2, (begin, f"{begin} if (h != 0.25) return 3;"))
    if suggested:
        told = '<DefaultExperiment stepSize="0.25"/><ModelVariables>'
        fmu = redescribed(fmu, tmp_path / "s.fmu", ("<ModelVariables>", told))
    assert (faults(fmu) == []) == suggested


def test_an_fmu_that_does_no_co_simulation_is_told_in_these_words(tmp_path):
    """As Clocks of the Reference FMUs, which can be scheduled only."""
    clocks = '<CoSimulation modelIdentifier="Linear"', '<ScheduledExecution modelIdentifier="Linear"'
    fmu = native.linear(tmp_path, 3)
    assert faults(redescribed(fmu, tmp_path / "s.fmu", clocks)) == ["no FMU for co-simulation"]
