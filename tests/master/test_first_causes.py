"""A check tells the cause of what is wrong with a package, once, and not what follows from it."""

from __future__ import annotations

import pytest
from deepsea_cosim.master.cli import main
from deepsea_cosim.master.simulation.check import check
from deepsea_cosim.master.simulation.run import Options

from benchmarks import native

from ..packages import (
    binding,
    bindings,
    component,
    connector,
    description,
    link,
    pack,
    parameter,
    parameter_set,
    system,
    values,
)
from .parts import gain, redescribed

pytestmark = pytest.mark.skipif(native.compiler is None, reason="there is no C compiler here")

BOTH = (link("a.y1", "b.u1"),)


def wrong(tmp_path, root, files, version="1.0", **options):
    """Errors and notes of a package whose description has an element a line."""
    text = description(root, version).replace("><", ">\n<")
    found = check(pack(tmp_path / "p.ssp", {"SystemStructure.ssd": text, **files}), Options(**options))
    return found.errors, found.notes


def arrays(name, size, bound):
    """A component whose connectors state the size of arrays that a structural parameter gives the FMU."""
    sizes = bindings(binding(parameter_set(parameter("size", "UInt64", bound), version="2.0")))
    return component(name, "resources/L.fmu", connector("many_in", "input", "Float64", sizes=(size,)),
                     connector("many_out", "output", "Float64", sizes=(size,)), bindings=sizes)  # fmt: skip


@pytest.mark.parametrize(("bound", "count"), [(3, 0), (-3, 1), ("x", 1), (4, 2)])
def test_a_wrong_size_is_not_told_of_what_has_it(fmus, tmp_path, bound, count):
    root = system("root", arrays("a", 3, bound), arrays("b", 3, 3), links=(link("a.many_out", "b.many_in"),))
    errors = wrong(tmp_path, root, {"resources/L.fmu": fmus[3]}, "2.0")[0]
    assert len(errors) == count
    assert not any("b." in text for text in errors)


def test_a_size_that_cannot_be_set_is_one_error(fmus, tmp_path):
    root = system("root", arrays("a", 3, 3), arrays("b", 3, 3), links=(link("a.many_out", "b.many_in"),))
    errors = wrong(tmp_path, root, {"resources/L.fmu": fmus[3]}, "2.0", changes=(("a.size", "-3"),))[0]
    assert len(errors) == 1
    assert errors[0].startswith("--set a.size=-3")


def test_an_fmu_that_many_components_lack_is_told_once_with_all_places(fmus, tmp_path):
    parts = [gain(name, 2.0, source="resources/M.fmu") for name in "abc"]
    lacking = redescribed(fmus[2], tmp_path / "M.fmu", ('modelIdentifier="Linear"', 'modelIdentifier="Other"'))
    for files in ({}, {"resources/M.fmu": b"no archive"}, {"resources/M.fmu": lacking}):
        errors = wrong(tmp_path, system("root", *parts, links=BOTH), {"resources/L.fmu": fmus[2], **files})[0]
        assert len(errors) == 1
        assert errors[0].count("line ") == 3


def test_a_name_that_many_connections_have_wrong_is_told_once(fmus, tmp_path):
    links = (link("a.y1", "bb.u1"), link("bb.y1", "a.u1"), link("inn", "b.u1"), link("inn", "b.u2"))
    root = system("root", gain("a", 1.0), gain("b", 1.0), made=(connector("in", "input"),), links=links)
    errors = wrong(tmp_path, root, {"resources/L.fmu": fmus[2]})[0]
    assert len(errors) == 2
    assert all(text.count("line ") == 2 for text in errors)


def test_different_faults_stay_apart(fmus, tmp_path):
    root = system("root", gain("a", 1.0, unit_out="m"), gain("b", 1.0, unit_in="kg"), gain("c", 1.0, unit_in="s"),
                  links=(link("a.y1", "b.u1"), link("a.y1", "c.u1")))  # fmt: skip
    errors, notes = wrong(tmp_path, root, {"resources/L.fmu": fmus[2]})
    assert len(errors) == 2
    assert not any("'b.u1'" in text or "'c.u1'" in text for text in notes)  # they are connected, if wrongly


def test_a_component_without_a_name_is_not_missed(fmus, tmp_path):
    root = system("root", gain("a", 1.0), gain("b", 1.0), links=BOTH).replace('name="b"', "", 1)
    assert len(wrong(tmp_path, root, {"resources/L.fmu": fmus[2]})[0]) == 1


def test_a_column_of_what_was_refused_is_not_missed(fmus, tmp_path):
    root = system("root", gain("a", 2.0, connector("zz", "output")), made=(connector("o", "output"),),
                  links=(link("a.zz", "o"),))  # fmt: skip
    errors = wrong(tmp_path, root, {"resources/L.fmu": fmus[2]}, record=("o",))[0]
    assert len(errors) == 1


def test_the_count_is_that_of_the_lines(fmus, tmp_path, capsys):
    sets = bindings(binding(source="x.ssv"))
    root = system("root", *(component(name, "resources/L.fmu", bindings=sets) for name in "ab"))
    files = {"resources/L.fmu": fmus[2], "x.ssv": values({"u1": "1,5"})}
    path = pack(tmp_path / "p.ssp", {"SystemStructure.ssd": description(root), **files})
    assert main([str(path), "--check"]) == 2
    said = capsys.readouterr()
    assert len(said.err.splitlines()) == 1
    assert "1 error," in said.out
