"""What the command says with --json: the same as its text, for programs."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from ..core.display_units import DisplayUnits
from ..ssp.flat_system import FlatConnection, indices_text
from .simulation.check import Checked
from .simulation.result import Result
from .simulation.trust import trust
from .system.parameters import parameters_in_force


def run_content(result: Result, files: Iterable[str], display: DisplayUnits) -> dict[str, Any]:
    """A run: summary.json, and beside it the folder, its files, and what the text says first."""
    told = result.answers.texts(display) if result.answers is not None else []
    return {
        "folder": result.folder, "files": list(files), "answers": told,
        "trust": trust(result.summary, bool(result.connected), "in `warnings`"), "summary": result.summary,
    }  # fmt: skip


def look_content(report: Checked, info: bool, parameters: bool) -> dict[str, Any]:
    """--check and --info: what is wrong, and where it is asked for the system and its parameters in force."""
    content: dict[str, Any] = {"errors": report.errors, "warnings": report.warnings, "notes": report.notes}
    if info and report.network is not None:
        content["system"] = _system(report)
    if parameters and report.system is not None:
        found = parameters_in_force(report.system, report.values)
        content["parameters"] = {p.address: p.summary() for p in found}
    return content


def _system(report: Checked) -> dict[str, Any]:
    network = report.network
    assert network is not None
    structure = network.structure
    instances = report.system.instances if report.system is not None else {}
    components = []
    for path, flat in network.components.items():
        variables = instances[path].variables.items() if path in instances else ()
        components.append({
            "name": path, "source": flat.component.source.name if flat.component.function is None else None,
            "fmi": instances[path].version if path in instances else None,
            "inputs": [name for name, v in variables if v.causality == "input"],
            "outputs": [name for name, v in variables if v.causality == "output"],
        })  # fmt: skip
    links = (*network.parameter_connections, *network.flat_connections, *network.outputs)
    return {
        "name": structure.name, "ssp": structure.version or None, "file": structure.file.name,
        "variants": list(structure.variants), "start_time_s": structure.start_time,
        "stop_time_s": structure.stop_time, "step_s": structure.step_size, "components": components,
        "connections": [_link(link) for link in links],
    }  # fmt: skip


def _link(link: FlatConnection) -> dict[str, str]:
    start, end = (".".join(filter(None, side)) for side in (link.start, link.end))
    return {"from": f"{start}{indices_text(link.start_indices)}", "to": f"{end}{indices_text(link.end_indices)}"}
