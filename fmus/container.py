"""A scenario of the deep-sea machine as one FMU, its parameters as start values.

FMPy has a container for any FMUs. It was not taken: it steps its components by Jacobi, which excites this machine's
oil column (docs/accuracy.md), and its interface is an experimental one of FMI 3.0.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from pathlib import Path

from ..core.errors import PackageError
from ..core.units import conversion, unit
from ..core.variables import VariableTable
from ..ssp.network import flatten
from ..ssp.reader import read
from .build import CONTAINER, Way, build_fmu
from .machine import PARTS, DeepseaMachine

SOURCES = {"hydraulics": "DeepseaHydraulics.fmu", "arm": "DeepseaArm.fmu"}


def starts_of(package: Path, table: VariableTable) -> dict[str, float]:
    """Start values by name that a scenario's package sets. Raises `PackageError` for what is no such scenario."""
    with tempfile.TemporaryDirectory() as scratch:
        network = flatten(read(package, Path(scratch) / "ssp"))
    found = {path: part.component.source.name for path, part in network.parts.items()}
    if found != SOURCES:
        parts = " and ".join(PARTS)
        raise PackageError(f"{package}: is no scenario of the deep-sea machine, which consists of {parts}")
    known = {v.name: v for v in table}
    made = {}
    for s in network.settings:
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


def container(
    package: Path, folder: Path, say: Callable[[str], None] = lambda text: None, way: Way | None = None
) -> Path:
    """Build the FMU of a scenario into `folder`, named like the package; returns its path."""
    starts = starts_of(package, DeepseaMachine.table)
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=folder) as scratch:
        made = build_fmu(CONTAINER, Path(scratch), say, way, starts)
        return made.replace(folder / f"{package.stem}.fmu")
