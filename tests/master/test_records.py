"""What a package tells beside what is simulated is not lost: traceability, meta data, signal dictionaries."""

from __future__ import annotations

import pytest
from deepsea_cosim.master.cli import main
from deepsea_cosim.master.simulation.check import check

from benchmarks import native

from ..packages import SPACES, component, connector, description, link, pack, system
from .parts import gain, last

pytestmark = pytest.mark.skipif(native.compiler is None, reason="there is no C compiler here")

COMMON = 'xmlns:stc="http://apps.pmsf.net/SSPTraceability/SSPTraceabilityCommon"'
TASK = f"""<stmd:SimulationTaskMetaData xmlns:stmd="http://apps.pmsf.net/STMD/SimulationTaskMetaData" {COMMON}
  version="1.0" name="Pump trial"><stc:GeneralInformation/>
  <stmd:AnalysisPhase>
    <stmd:AnalyzeSimulationTaskAndObjectives>
      <stc:Input><stc:Resource kind="requirement" type="text/plain" source="wanted.txt"/>
      <stc:Resource kind="requirement" type="text/html" source="https://example.org/rules.html"/></stc:Input>
    </stmd:AnalyzeSimulationTaskAndObjectives><stmd:VerifyAnalysis/>
  </stmd:AnalysisPhase>
  <stmd:DesignPhase><stmd:DefineModelDesignSpecification>
    <stc:Output><stc:Resource kind="model" type="application/x-fmu-sharedlibrary" source="../gone.fmu"/></stc:Output>
  </stmd:DefineModelDesignSpecification></stmd:DesignPhase></stmd:SimulationTaskMetaData>"""
SRMD = 'xmlns:srmd="http://apps.pmsf.net/SRMD/SimulationResourceMetaData"'
RESOURCE = f"""<srmd:SimulationResourceMetaData {SRMD} {COMMON}
  version="1.0" name="pump"><stc:Classification type="org.example">
  <stc:ClassificationEntry keyword="validated">by test 12</stc:ClassificationEntry></stc:Classification>
  </srmd:SimulationResourceMetaData>"""
META = '<ssc:MetaData kind="quality" type="application/x-srmd-meta-data" source="extra/pump.srmd"/>'


def entries(*made):
    inside = "".join(f'<ssb:DictionaryEntry name="{n}"><ssc:Real unit="{u}"/></ssb:DictionaryEntry>' for n, u in made)
    return f'<ssb:SignalDictionary {SPACES} version="1.0">{inside}</ssb:SignalDictionary>'


def traced(tmp_path, fmus, **more):
    """A component c and a gain of 3 over a dictionary, with all that may be told beside it."""
    source = component("c", "resources/L.fmu", connector("u1", "input"), connector("y1", "output"), bindings=META)
    bus = ('<ssd:SignalDictionaryReference name="bus" dictionary="B"><ssd:Connectors>'
           f'{connector("s", "inout")}</ssd:Connectors></ssd:SignalDictionaryReference>')  # fmt: skip
    used = '<ssd:SignalDictionaries><ssd:SignalDictionary name="B" source="used.ssb"/></ssd:SignalDictionaries>'
    root = system("root", source, gain("g", 3.0), bus, links=(link("c.y1", "bus.s"), link("bus.s", "g.u1")),
                  dictionaries=used)  # fmt: skip
    files = {
        "SystemStructure.ssd": description(root, version="2.0"),
        "resources/L.fmu": fmus[2], "used.ssb": entries(("s", "m"), ("t", "kg")),
        "left.ssb": entries(("p", "bar")), "extra/task.stmd": TASK, "extra/pump.srmd": RESOURCE,
        "extra/wanted.txt": "fast", "extra/broken.stmd": "<not", **more,
    }  # fmt: skip
    return pack(tmp_path / "p.ssp", files)


def test_they_are_read_and_do_no_harm(fmus, tmp_path):
    path = traced(tmp_path, fmus)
    found = check(path)
    assert not found.errors
    told = {r.place: r for r in found.network.structure.metadata}
    assert told["extra/task.stmd"].title == "Pump trial"
    analysis, design = told["extra/task.stmd"].lines
    assert analysis.startswith("AnalysisPhase: AnalyzeSimulationTaskAndObjectives (wanted.txt, https://example.org")
    assert "missing" not in analysis
    assert "../gone.fmu, which is missing" in design
    assert told["extra/pump.srmd"].lines == ("validated: by test 12",)
    assert "not well-formed" in told["extra/broken.stmd"].lines[0]
    assert told["left.ssb"].lines == ("entries: p",)
    assert "used.ssb" not in told
    meta = next(r for place, r in told.items() if place.startswith("SystemStructure.ssd, line"))
    assert "quality" in meta.kind
    assert "'c'" in meta.kind
    assert "missing" not in meta.lines[0]
    assert last(tmp_path, path, "g.y1", changes=(("c.D[1,1]", "1"), ("c.u1", "2"))) == pytest.approx(6.0)


def test_info_names_them(fmus, tmp_path, capsys):
    assert main([str(traced(tmp_path, fmus)), "--info"]) == 0
    shown = capsys.readouterr().out
    for text in (
        "dictionary B: s [m], t [kg]", "extra/task.stmd: simulation task 'Pump trial'", "DesignPhase",
        "extra/pump.srmd: simulation resource 'pump'", "left.ssb: signal dictionary that nothing names",
    ):  # fmt: skip
        assert text in shown


def test_a_dictionary_in_use_that_is_damaged_is_still_an_error(fmus, tmp_path, capsys):
    assert main([str(traced(tmp_path, fmus, **{"used.ssb": "<not"})), "--check"]) == 2
    assert "used.ssb" in capsys.readouterr().err
