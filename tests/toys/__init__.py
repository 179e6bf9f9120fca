"""Small FMUs made with plain pythonfmu, and SSP packages around them."""

from __future__ import annotations

import subprocess
import sys
import zipfile
from collections.abc import Iterable, Mapping
from pathlib import Path

HERE = Path(__file__).parent

SSD = "http://ssp-standard.org/SSP1/SystemStructureDescription"
SSV = "http://ssp-standard.org/SSP1/SystemStructureParameterValues"


def build(folder: Path) -> None:
    """Every toy into a folder; the oscillator, which diagnoses simulate by the thousand, in C where that can be."""
    for script in sorted(HERE.glob("toy_*.py")):
        command = [sys.executable, "-m", "pythonfmu", "build", "-f", str(script), "-d", str(folder)]
        subprocess.run(command, check=True, capture_output=True, cwd=folder)
    if sys.platform == "linux":
        _in_c(folder / "Oscillator.fmu", HERE / "oscillator.c", folder / "PythonOscillator.fmu")


def _in_c(fmu: Path, source: Path, kept: Path) -> None:
    """Put a library compiled from C in place of an FMU's Python, and keep the one in Python; nothing without a
    compiler."""
    from benchmarks import native  # not above: what measurements are made with must not depend on what is compared

    if native.compiler is None:
        return
    library = native.compiled(source, 2, fmu.with_suffix(".so"), "-ffp-contract=off")
    with zipfile.ZipFile(fmu.rename(kept)) as archive:
        description = archive.read("modelDescription.xml").decode()
    with zipfile.ZipFile(fmu, "w") as archive:
        archive.writestr("modelDescription.xml", description.replace(' needsExecutionTool="true"', ""))
        archive.write(library, f"{native.BINARIES[2]}/{library.name}")
    library.unlink()


def package(
    target: Path,
    fmus: Mapping[str, Path],
    connections: Iterable[str] = (),
    parameters: Mapping[str, float] | None = None,
    stop: float = 1.0,
    step: float | None = None,
) -> Path:
    """Write an SSP with components name -> FMU file, connections 'a.x -> b.y' and inline parameters."""
    components = "".join(
        f'<ssd:Component name="{name}" source="resources/{path.name}"/>' for name, path in fmus.items()
    )
    lines = []
    for connection in connections:
        start, end = (side.strip().partition(".") for side in connection.split("->"))
        lines.append(
            f'<ssd:Connection startElement="{start[0]}" startConnector="{start[2]}" '
            f'endElement="{end[0]}" endConnector="{end[2]}"/>'
        )
    values = "".join(
        f'<ssv:Parameter name="{name}"><ssv:Real value="{value!r}"/></ssv:Parameter>'
        for name, value in (parameters or {}).items()
    )
    annotation = ""
    if step is not None:
        annotation = (
            '<ssd:Annotations><ssc:Annotation xmlns:ssc="http://ssp-standard.org/SSP1/SystemStructureCommon" '
            f'type="org.deepsea-cosim.master"><Master stepSize="{step!r}"/></ssc:Annotation></ssd:Annotations>'
        )
    text = f"""<?xml version="1.0"?>
<ssd:SystemStructureDescription xmlns:ssd="{SSD}" xmlns:ssv="{SSV}" version="1.0" name="toy">
  <ssd:System name="toy">
    <ssd:ParameterBindings><ssd:ParameterBinding><ssd:ParameterValues><ssv:ParameterSet version="1.0" name="p">
      <ssv:Parameters>{values}</ssv:Parameters>
    </ssv:ParameterSet></ssd:ParameterValues></ssd:ParameterBinding></ssd:ParameterBindings>
    <ssd:Elements>{components}</ssd:Elements>
    <ssd:Connections>{"".join(lines)}</ssd:Connections>
  </ssd:System>
  <ssd:DefaultExperiment startTime="0" stopTime="{stop!r}">{annotation}</ssd:DefaultExperiment>
</ssd:SystemStructureDescription>
"""
    with zipfile.ZipFile(target, "w") as archive:
        archive.writestr("SystemStructure.ssd", text)
        for path in set(fmus.values()):
            archive.write(path, f"resources/{path.name}")
    return target
