"""Scenarios of a user's own machine: a data sheet -> packages with the FMUs, its parameters and its catalogue."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from pathlib import Path
from xml.sax.saxutils import quoteattr

from ..core.files import make_folder
from ..core.scratch import scratch
from ..core.variables import VariableTable
from ..hydraulics_fmu.variables import HYDRAULICS
from ..mechanics.variables import ARM
from ..ssp import packer
from .build import MODELS, Way, build_fmus, system_folder
from .data_sheet import Machine, kilometres, read, scaled_catalogue, scales

HEAD = """<?xml version="1.0" encoding="UTF-8"?>
<ssv:ParameterSet xmlns:ssv="http://ssp-standard.org/SSP1/SystemStructureParameterValues" version="1.0" name={name}>
  <ssv:Parameters>
"""
TAIL = "  </ssv:Parameters>\n</ssv:ParameterSet>\n"


def parameter_set(name: str, depth: float, machine: Machine) -> str:
    """The .ssv of a machine at a depth [m]."""

    def entries(component: str, table: VariableTable, values: Mapping[str, float]) -> list[str]:
        made = []
        for key, value in {**values, "depth": depth}.items():
            own = f' unit="{table[key].unit}"' if table[key].unit not in (None, "1") else ""
            real = f'<ssv:Real value="{float(value)!r}"{own}/>'
            made.append(f'    <ssv:Parameter name="{component}.{key}">{real}</ssv:Parameter>\n')
        return made

    lines = [*entries("hydraulics", HYDRAULICS, machine.hydraulics), *entries("arm", ARM, machine.arm)]
    return HEAD.format(name=quoteattr(name)) + "".join(lines) + TAIL


def build_machine(
    sheet: Path, folder: Path, say: Callable[[str], None] = lambda text: None, way: Way | None = None
) -> list[Path]:
    """Build the packages of a sheet into `folder`, one a depth; returns them. FMUs that are there and have the code
    that is installed are used."""
    from .container import is_ours

    machine = read(sheet)
    make_folder(folder)
    system = system_folder("deepsea")
    with scratch("machine") as place:
        needed = {folder / f"{model.name}.fmu": model for model in MODELS if model.name != "DeepseaSupply"}
        fmus = {f"resources/{path.name}": path for path in needed}
        old = [m for path, m in needed.items() if way is not None or not (path.is_file() and is_ours(path, m))]
        for path in build_fmus(old, folder, say, way):
            say(str(path))
        catalogue = place / "effects.toml"
        shipped = (system / "effects.toml").read_text(encoding="utf-8")
        catalogue.write_text(scaled_catalogue(shipped, scales(machine)), encoding="utf-8")
        structure = place / "SystemStructure.ssd"
        text = (system / structure.name).read_text(encoding="utf-8")
        structure.write_text(re.sub(r'stopTime="[^"]*"', f'stopTime="{machine.stop:.4g}"', text), encoding="utf-8")
        made = []
        for depth in machine.depths:
            name = machine.name if len(machine.depths) == 1 else f"{machine.name}_{kilometres(depth)}"
            values = place / f"{name}.ssv"
            values.write_text(parameter_set(name, depth, machine), encoding="utf-8")
            target = folder / f"{name}.ssp"
            packer.pack(structure, values, fmus, target, {"resources/effects.toml": catalogue})
            made.append(target)
            say(str(target))
    for remark in machine.remarks:
        say(f"note: {remark}")
    return made
