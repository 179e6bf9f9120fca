"""The macro step that a package and its FMUs suggest: taken where the user gives none, told where another one is."""

from __future__ import annotations

import pytest
from deepsea_cosim.master.cli import main
from deepsea_cosim.master.simulation.check import check
from deepsea_cosim.master.simulation.run import Options, run
from deepsea_cosim.master.simulation.session import Session

from benchmarks import native

from ..packages import component, description, pack, package, system
from .parts import redescribed

pytestmark = pytest.mark.skipif(native.compiler is None, reason="there is no C compiler here")


def suggesting(fmu, target, **times):
    """The FMU with a DefaultExperiment."""
    given = " ".join(f'{name}="{value}"' for name, value in times.items())
    place = "<ModelStructure>"
    return redescribed(fmu, target, (place, f"<DefaultExperiment {given}/>{place}"))


@pytest.fixture
def files(fmus, tmp_path):
    """Three FMUs: two that suggest 0.05 s and 0.2 s, and one that says no number."""
    steps = {"A": "0.05", "B": "0.2", "C": "auto"}
    return {
        f"resources/{name}.fmu": suggesting(fmus[v], tmp_path / f"{name}.fmu", stepSize=step)
        for (name, step), v in zip(steps.items(), (2, 3, 2), strict=True)
    }


ROOT = system("root", *(component(name.lower(), f"resources/{name}.fmu") for name in "ABC"))


def without_step(path, files, root=ROOT, **experiment):
    """A package whose DefaultExperiment has these attributes and no annotation."""
    given = " ".join(f'{name}="{value}"' for name, value in {"startTime": 0, "stopTime": 1, **experiment}.items())
    told = description(root, stop=None).replace(
        "</ssd:SystemStructureDescription>", f"<ssd:DefaultExperiment {given}/></ssd:SystemStructureDescription>"
    )
    return pack(path, {"SystemStructure.ssd": told, **files})


def step_of(tmp_path, path, **options):
    """The step of a run, and whether its warnings name another."""
    summary = run(path, tmp_path / "out", Options(**options)).summary
    return summary["step_s"], [text for text in summary["warnings"] if "suggest" in text]


def test_the_smallest_step_of_the_fmus_is_taken_where_nobody_else_says_one(files, tmp_path, capsys):
    path = without_step(tmp_path / "p.ssp", files)
    for isolate in (False, True):
        assert step_of(tmp_path, path, isolate=isolate) == (0.05, [])
    with Session(path) as session:
        assert session.structure.step_size == 0.05
    assert not check(path).warnings
    assert main([str(path), "--info"]) == 0
    assert "step 0.05 s" in capsys.readouterr().out


def test_another_step_is_told(files, tmp_path):
    path = without_step(tmp_path / "p.ssp", files)
    for step in (0.1, 0.025):
        taken, told = step_of(tmp_path, path, step=step)
        assert taken == step
        assert "0.05 s" in told[0]
        assert any("suggest" in text for text in check(path, Options(step=step)).warnings)
    mine = package(tmp_path / "q.ssp", ROOT, files, step=0.1)
    taken, told = step_of(tmp_path, mine)
    assert (taken, len(told)) == (0.1, 1)
    assert "0.05 s" in told[0]


def test_substeps_of_the_suggested_length_are_no_other_step(files, tmp_path):
    path = without_step(tmp_path / "p.ssp", files)
    for given in ({}, {"step": 0.2}):
        assert step_of(tmp_path, path, substeps=(("a", 4),), **given) == (0.2, [])
        assert not check(path, Options(substeps=(("a", 4),), **given)).warnings


def test_a_run_shorter_than_the_suggested_step_is_one_step(files, tmp_path):
    root = system("root", component("b", "resources/B.fmu"))
    path = without_step(tmp_path / "p.ssp", files, root)
    assert step_of(tmp_path, path, stop_time=0.1)[0] == 0.1


def test_the_step_of_the_description_is_taken_before_that_of_the_fmus(files, tmp_path):
    path = without_step(tmp_path / "p.ssp", files, stepSize="0.1")
    assert step_of(tmp_path, path)[0] == 0.1
    assert any("stepSize" in error for error in check(path).errors)  # the schema has no such attribute


def test_an_fmu_on_its_own(files, tmp_path):
    fmu = files["resources/A.fmu"]
    assert step_of(tmp_path, fmu, stop_time=1.0) == (0.05, [])
    assert step_of(tmp_path, files["resources/C.fmu"], stop_time=1.0) == (0.001, [])
