"""Annotations of other tools: steps are used, and whatever is not used is named by --info."""

from __future__ import annotations

import pytest
from deepsea_cosim.master.cli import main
from deepsea_cosim.master.simulation.check import check
from deepsea_cosim.master.simulation.run import Options, run

from benchmarks import native

from ..packages import binding, bindings, component, description, pack, system, values
from .parts import constant, redescribed

pytestmark = pytest.mark.skipif(native.compiler is None, reason="there is no C compiler here")

OSP = 'xmlns:osp="http://opensimulationplatform.com/SSP/OSPAnnotations"'


def noted(*elements, type="com.opensimulationplatform"):
    """An annotation for each element."""
    made = (f'<ssc:Annotation type="{type}">{element}</ssc:Annotation>' for element in elements)
    return f"<ssd:Annotations>{''.join(made)}</ssd:Annotations>"


def hinted(name, step, fmu="L"):
    """A component whose own step OSP hints at."""
    hint = noted(f'<osp:StepSizeHint {OSP} value="{step}"/>')
    return component(name, f"resources/{fmu}.fmu").replace("</ssd:Component>", f"{hint}</ssd:Component>")


def packed(path, fmus, root, experiment="", files=()):
    told = description(root, stop=None).replace(
        "</ssd:SystemStructureDescription>",
        f'<ssd:DefaultExperiment startTime="0" stopTime="1">{experiment}</ssd:DefaultExperiment>'
        "</ssd:SystemStructureDescription>",
    )
    return pack(path, {"SystemStructure.ssd": told, "resources/L.fmu": fmus[2], **dict(files)})


def step_of(tmp_path, path, **options):
    summary = run(path, tmp_path / "out", Options(**options)).summary
    return summary["step_s"], [text for text in summary["warnings"] if "suggest" in text]


def test_the_smallest_step_that_osp_hints_at_is_taken(fmus, tmp_path):
    """The hint of a component counts before what its FMU suggests; one of 0 is none."""
    own = '<DefaultExperiment stepSize="0.01"/><ModelStructure>'
    fmu = redescribed(fmus[2], tmp_path / "S.fmu", ("<ModelStructure>", own))
    root = system("root", hinted("a", 0.2), hinted("b", 0.05, "S"), hinted("c", 0))
    path = packed(tmp_path / "p.ssp", fmus, root, files={"resources/S.fmu": fmu}.items())
    assert step_of(tmp_path, path) == (0.05, [])
    taken, told = step_of(tmp_path, path, step=0.1)
    assert taken == 0.1
    assert "0.05 s" in told[0]


def test_the_base_step_of_osp_counts_before_its_hints(fmus, tmp_path):
    base = noted(f'<osp:Algorithm {OSP}><osp:FixedStepAlgorithm baseStepSize="0.05"/></osp:Algorithm>')
    path = packed(tmp_path / "p.ssp", fmus, system("root", hinted("a", 0.2), hinted("b", 0.1)), base)
    assert step_of(tmp_path, path) == (0.05, [])  # both are multiples of it, as is meant
    short = packed(tmp_path / "q.ssp", fmus, system("root", hinted("a", 0.02)), base)
    taken, told = step_of(tmp_path, short)
    assert taken == 0.05
    assert "0.02 s" in told[0]


def shown(path, capsys):
    assert main([str(path), "--info"]) == 0
    lines = capsys.readouterr().out.splitlines()
    title = "annotations that are not used"
    return [line.strip() for line in lines[lines.index(title) + 1 :]] if title in lines else []


def test_what_is_not_used_is_named(fmus, tmp_path, capsys):
    """Of the system, of components (twice), of a parameter set; in what OSP writes, only what is no step."""
    scenario = noted('<e:Scenario xmlns:e="e"><e:Action t="1"/></e:Scenario>', type="com.example.ecos")
    colour = noted('<t:Colour xmlns:t="t"/>', type="com.example.tool")
    osp = noted(f'<osp:StepSizeHint {OSP} value="0.1"/>', f'<osp:Plug {OSP}/>')
    end = "</ssv:ParameterSet>"
    mark = '<ssv:Annotations><ssc:Annotation type="com.example.set"/></ssv:Annotations>'
    sets = values({"u1": 3.0}).replace(end, f"{mark}{end}")
    parts = [component(n, "resources/L.fmu", bindings=bindings(binding(source="x.ssv"))).replace(
        "</ssd:Component>", f"{colour}</ssd:Component>") for n in "ab"]  # fmt: skip
    parts.append(component("c", "resources/L.fmu").replace("</ssd:Component>", f"{osp}</ssd:Component>"))
    root = system("root", *parts).replace("</ssd:Elements>", f"</ssd:Elements>{scenario}")
    path = packed(tmp_path / "p.ssp", fmus, root, files={"x.ssv": sets}.items())
    told = shown(path, capsys)
    kinds = sorted(line.partition(": ")[0] for line in told)
    assert kinds == [
        "com.example.ecos (Scenario)", "com.example.set", "com.example.tool (Colour)",
        "com.opensimulationplatform (Plug)",
    ]  # fmt: skip
    assert any("x.ssv, line 1" in line for line in told)
    assert not check(path).errors


def test_ours_are_used(fmus, tmp_path, capsys):
    path = pack(tmp_path / "p.ssp", {"SystemStructure.ssd": description(system("root", constant("c", 1.0))),
                                     "resources/L.fmu": fmus[2]})  # fmt: skip
    assert shown(path, capsys) == []
