"""From an FMU script, a catalogue and measured runs to a folder for cosim-gap: FMU, package, campaign, run files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from deepsea_cosim.ssp import packer

HERE = Path(__file__).parent

SYSTEM = """<?xml version="1.0" encoding="UTF-8"?>
<ssd:SystemStructureDescription xmlns:ssd="http://ssp-standard.org/SSP1/SystemStructureDescription"
    xmlns:ssc="http://ssp-standard.org/SSP1/SystemStructureCommon" version="1.0" name="{name}">
  <ssd:System name="{name}">
    <ssd:ParameterBindings>
      <ssd:ParameterBinding type="application/x-ssp-parameter-set" source="resources/parameters.ssv"/>
    </ssd:ParameterBindings>
    <ssd:Elements>
      <ssd:Component name="{component}" type="application/x-fmu-sharedlibrary" source="resources/{fmu}"
          implementation="CoSimulation"/>
    </ssd:Elements>
  </ssd:System>
  <ssd:DefaultExperiment startTime="0" stopTime="{stop!r}">
    <ssd:Annotations>
      <ssc:Annotation type="org.deepsea-cosim.master"><Master stepSize="{step!r}"/></ssc:Annotation>
    </ssd:Annotations>
  </ssd:DefaultExperiment>
</ssd:SystemStructureDescription>
"""

NO_PARAMETERS = """<?xml version="1.0" encoding="UTF-8"?>
<ssv:ParameterSet xmlns:ssv="http://ssp-standard.org/SSP1/SystemStructureParameterValues" version="1.0" name="none">
  <ssv:Parameters/>
</ssv:ParameterSet>
"""


@dataclass(frozen=True)
class Channel:
    """A column of the runs, the connector it belongs to, its unit, and, if known, its noise in that unit and how far
    its times may be off [s]."""

    column: str
    connector: str
    unit: str
    role: str = "output"
    noise_std: float | None = None
    clock_jitter: float | None = None


@dataclass
class Run:
    """A run: columns by name, `time` [s] first; NaN = not measured. Parameters by SSP address."""

    name: str
    columns: Mapping[str, np.ndarray]
    parameters: Mapping[str, float] = field(default_factory=dict)
    use: str = "fit"


@dataclass
class Measured:
    """A system: its model (fmus/<name>_fmu.py, effects/<name>.toml), macro step [s], channels and runs."""

    name: str
    component: str
    step: float
    channels: Sequence[Channel]
    runs: Sequence[Run]


def build_fmu(name: str, folder: Path) -> Path:
    """The FMU of fmus/<name>_fmu.py in `folder`."""
    from pythonfmu.builder import FmuBuilder

    return Path(FmuBuilder.build_FMU(HERE / "fmus" / f"{name}_fmu.py", dest=folder))


def build_package(measured: Measured, target: Path) -> Path:
    """Write the SSP package: the FMU alone, with the catalogue of its effects."""
    stop = max(float(run.columns["time"][-1]) for run in measured.runs)
    with TemporaryDirectory() as scratch_name:
        scratch = Path(scratch_name)
        fmu = build_fmu(measured.name, scratch)
        (scratch / "system.ssd").write_text(
            SYSTEM.format(name=measured.name, component=measured.component, fmu=fmu.name, stop=stop, step=measured.step)
        )
        (scratch / "none.ssv").write_text(NO_PARAMETERS)
        catalogue = HERE / "effects" / f"{measured.name}.toml"
        return packer.pack(
            scratch / "system.ssd",
            scratch / "none.ssv",
            {f"resources/{fmu.name}": fmu},
            target,
            {"resources/effects.toml": catalogue},
        )


def _cell(value: float) -> str:
    return "" if np.isnan(value) else f"{value:.9g}"


def write(measured: Measured, folder: Path) -> Path:
    """Write package, run files and campaign.toml into `folder`; returns the campaign."""
    folder.mkdir(parents=True, exist_ok=True)
    build_package(measured, folder / f"{measured.name}.ssp")
    lines = [f'name = "{measured.name}"', f'system = "{measured.name}.ssp"']
    for c in measured.channels:
        lines += ["[[channel]]", f'column = "{c.column}"', f'connector = "{c.connector}"', f'unit = "{c.unit}"']
        known = {"noise_std": c.noise_std, "clock_jitter": c.clock_jitter}
        lines += [f'role = "{c.role}"', *(f"{k} = {v:.3g}" for k, v in known.items() if v is not None)]
    for run in measured.runs:
        rows = np.column_stack(list(run.columns.values())).tolist()
        text = "\n".join([",".join(run.columns), *(",".join(map(_cell, row)) for row in rows)])
        (folder / f"{run.name}.csv").write_text(text + "\n")
        values = ", ".join(f'"{k}" = {float(v)!r}' for k, v in run.parameters.items())
        lines += ["[[run]]", f'file = "{run.name}.csv"', f"parameters = {{ {values} }}", f'use = "{run.use}"']
    target = folder / "campaign.toml"
    target.write_text("\n".join(lines) + "\n")
    return target
