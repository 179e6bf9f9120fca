"""A scenario of the deep-sea machine as one FMU, its parameters as start values.

FMPy has a container for any FMUs. It was not taken: it steps its components by Jacobi, which excites this machine's
oil column (docs/accuracy.md), and its interface is an experimental one of FMI 3.0.
"""

from __future__ import annotations

import io
import shutil
import zipfile
from collections.abc import Callable
from pathlib import Path

from ..core.errors import PackageError
from ..core.files import make_folder, replacing
from ..core.scratch import scratch
from ..core.units import conversion, unit
from ..core.variables import VariableTable
from ..ssp.flat_system import FlatSystem
from ..ssp.flatten import flatten
from ..ssp.reader import read
from .build import CONTAINER, MODELS, Model, Way, build_fmu, sources_of
from .machine import CONNECTED, PARTS, DeepseaMachine

SOURCES = {"hydraulics": "DeepseaHydraulics.fmu", "arm": "DeepseaArm.fmu"}


def starts_of(package: Path, table: VariableTable) -> dict[str, float]:
    """Start values by name that a scenario's package sets. Raises `PackageError` for what is no such scenario."""
    with scratch("container") as place:
        network = flatten(read(package, place / "ssp"))
        found = {path: flat_component.component.source for path, flat_component in network.components.items()}
        if {path: source.name for path, source in found.items()} != SOURCES:
            parts = " and ".join(PARTS)
            raise PackageError(f"{package}: is no scenario of the deep-sea machine, which consists of {parts}")
        for model in (m for m in MODELS if m.modules[0] in PARTS):
            if not is_ours(found[model.modules[0]], model):
                raise PackageError(
                    f"{package}: {model.name}.fmu has not the code that is installed here, which a container gets; "
                    "make the package anew with cosim-fmus build"
                )
    _check_connections(package, network)
    known = {v.name: v for v in table}
    made = {}
    for s in network.bound_parameters:
        name = f"{s.component}.{s.variable}"
        if name not in known:
            raise PackageError(f"{s.where}: the machine has no parameter '{name}'")
        if any(hop.transformation is not None for hop in s.hops):
            raise PackageError(f"{s.where}: '{name}' is set through a mapping, which a container does not support")
        variable, value = known[name], float(s.value)  # type: ignore[arg-type]
        if s.type.unit is not None and variable.unit is not None:
            factor, offset = conversion(s.type.unit, unit(variable.unit))
            value = factor * value + offset
        made[name] = variable.check(value)
    return made


def is_ours(fmu: Path, model: Model) -> bool:
    """Whether an FMU computes with the model's code as it is installed."""
    try:
        with zipfile.ZipFile(fmu) as archive, zipfile.ZipFile(io.BytesIO(archive.read("resources/code.zip"))) as code:
            packed = {name.partition("/")[2]: name for name in code.namelist()}
            return all(
                name in packed and code.read(packed[name]) == content for name, content in sources_of(model).items()
            )
    except (OSError, KeyError, zipfile.BadZipFile):
        return False


def _check_connections(package: Path, network: FlatSystem) -> None:
    """The parts have to be connected as those in the container are, and nothing else."""
    wanted = {(part, x): start for part, connected in CONNECTED.items() for x, start in connected.items()}
    found = {flat_connection.end: flat_connection for flat_connection in network.flat_connections}
    for end, start in wanted.items():
        if end not in found or found[end].start != start:
            raise PackageError(f"{package}: '{'.'.join(end)}' is not driven by '{'.'.join(start)}' as in a container")
    for end, flat_connection in found.items():
        if end not in wanted:
            raise PackageError(
                f"{flat_connection.where}: '{'.'.join(end)}' is driven, which a container does not support"
            )
        if any(hop.transformation is not None or hop.suppress_unit_conversion for hop in flat_connection.hops):
            raise PackageError(
                f"{flat_connection.where}: '{'.'.join(end)}' is transformed, which a container does not support"
            )


def container(
    package: Path, folder: Path, say: Callable[[str], None] = lambda text: None, way: Way | None = None
) -> Path:
    """Build the FMU of a scenario into `folder`, named like the package; returns its path."""
    starts = starts_of(package, DeepseaMachine.table)
    make_folder(folder)
    with scratch("container") as place, replacing(folder / f"{package.stem}.fmu") as part:
        own = {"fmus/starts.py": f"STARTS = {starts!r}\n".encode()} if starts else {}
        shutil.copyfile(build_fmu(CONTAINER, place, say, way, own), part)
    return folder / f"{package.stem}.fmu"
