"""A run as its result folder tells it: signals over time, parameters, and where its package is."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ...core.errors import PackageError, UsageError
from ..page.record import read_record
from ..results.blocks import whole
from ..simulation.manifest import digest


@dataclass(frozen=True)
class RecordedRun:
    """A run; `times` (n,) [s], `signals` (n,) by address in the units of the FMUs, numbers of parameters likewise."""

    folder: Path
    package: Path
    variant: str | None
    times: np.ndarray
    signals: Mapping[str, np.ndarray]
    parameters: Mapping[str, float]
    remarks: tuple[str, ...] = ()

    def of(self, component: str) -> dict[str, np.ndarray | float | None]:
        """What is known of a component, by the names that its variables have in the FMU."""
        front = f"{component}."
        known: dict[str, np.ndarray | float | None] = {}
        for values in (self.parameters, self.signals):
            known |= {name.removeprefix(front): x for name, x in values.items() if name.startswith(front)}
        return known

    def everything(self) -> dict[str, np.ndarray | float | None]:
        """What is known of all of them, by address."""
        return {**self.parameters, **self.signals}


def recorded(folder: Path, package: Path | None = None) -> RecordedRun:
    """The run in a result folder; `package` where that has been moved since. Raises `UsageError` or `PackageError` in
    one line where the folder holds no run, or its record or its package is gone."""
    record = read_record(folder)
    if record.folder is None or not record.summary:
        raise UsageError(f"{folder}: holds no run (summary.json is missing); give the result folder of a run")
    summary, manifest = record.summary, _manifest(record.folder)
    options = manifest.get("options", {})
    columns = whole(record.file, record.texts)
    signals = {name: column for name, column in columns.items() if isinstance(column, np.ndarray)}
    times = signals.pop("time", np.empty(0))
    if not len(times):
        raise UsageError(f"{record.file}: holds no row")
    values = {address: told.get("value") for address, told in summary.get("parameters", {}).items()}
    parameters = {a: float(v) for a, v in values.items() if isinstance(v, (bool, int, float))}
    found = _package(folder, Path(summary.get("package", "")), package)
    stated = manifest.get("sha256", {}).get(summary.get("package"))
    changed = package is None and found.is_file() and stated is not None and digest(found) != stated
    remarks = (f"{found} is not the package any more that {folder} was run with",) if changed else ()
    return RecordedRun(folder, found, options.get("variant"), times, signals, parameters, remarks)


def _manifest(folder: Path) -> dict[str, Any]:
    """What the run was made of; empty where that cannot be read, for only the package's variant and hash are in it."""
    try:
        found = json.loads((folder / "manifest.json").read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return found if isinstance(found, dict) else {}


def _package(folder: Path, told: Path, given: Path | None) -> Path:
    """Where the package is; a relative path was one from where the run was started, often above its results."""
    if given is not None:
        if not given.exists():
            raise PackageError(f"{given}: no such file")
        return given
    places = [told, *(above / told for above in folder.resolve().parents)]
    found = next((place for place in places if place.is_file() or place.is_dir()), None)
    if found is None or not told.name:
        raise PackageError(f"{folder}: the package of its run, {told}, is gone; --package says where it is now")
    return found
