"""A run as it stands in its result folder: its record, and what summary.json tells of it."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from ...core.errors import UsageError
from ..results import by_suffix
from ..simulation.run_folder import PAGE, earlier, settle


@dataclass(frozen=True)
class RunRecord:
    """A result file with the summary of its run, which is empty where there is none (a file on its own)."""

    file: Path
    summary: Mapping[str, Any]
    folder: Path | None = None
    """The result folder; None for a file on its own."""

    @property
    def page(self) -> Path:
        """Where the page of the run stands."""
        return self.folder / PAGE if self.folder is not None else self.file.with_name(f"{self.file.name}.html")

    @property
    def name(self) -> str:
        """What a person calls it: its folder, or its file."""
        return str(self.folder if self.folder is not None else self.file)

    def table(self, key: str) -> Mapping[str, Any]:
        """A mapping of the summary; runs of before it was written there have none."""
        found = self.summary.get(key)
        return found if isinstance(found, Mapping) else {}

    def listed(self, key: str) -> list[Any]:
        """A list of the summary, likewise."""
        found = self.summary.get(key)
        return found if isinstance(found, list) else []

    @property
    def texts(self) -> list[str]:
        """Columns that hold texts, as far as the summary tells."""
        return [name for name, type in self.table("types").items() if type == "text"]

    @cached_property
    def components(self) -> list[str]:
        """Their names in the order in which they step."""
        return [str(name) for name in self.listed("order")]

    @cached_property
    def connections(self) -> list[tuple[str, str]]:
        """Names of the two ends of each connection."""
        found = self.listed("connections")
        return [(str(c[0]), str(c[1])) for c in found if isinstance(c, list) and len(c) == 2]

    def unit(self, name: str) -> str:
        """Unit of a column; '' where nothing tells it."""
        return str(self.table("units").get(name) or "")

    def component_of(self, name: str) -> str:
        """The component that a column or parameter belongs to; '' for the system's own.

        Names of components may have dots in them, so the longest that fits is meant.
        """
        if not self.components:
            return name.partition(".")[0] if "." in name else ""
        dot = name.rfind(".")
        while dot > 0 and name[:dot] not in self._known:
            dot = name.rfind(".", 0, dot)
        return name[:dot] if dot > 0 else ""

    @cached_property
    def _known(self) -> frozenset[str]:
        return frozenset(self.components)


def read_record(path: Path) -> RunRecord:
    """The run in a result folder, or of a result file. Raises `UsageError` in one line for anything else."""
    if path.is_dir() and path.suffix.lower() not in by_suffix():  # a folder of Parquet's parts is a file
        return _of_folder(path)
    if not path.exists():
        raise UsageError(f"{path}: no such file or folder")
    if path.suffix.lower() not in by_suffix():
        raise UsageError(f"{path}: no result file (these end in {', '.join(by_suffix())})")
    if earlier(path.parent, "results", tuple(by_suffix())) == path.name and (path.parent / "summary.json").exists():
        return RunRecord(path, _summary(path.parent), path.parent)
    return RunRecord(path, {})


def _of_folder(folder: Path) -> RunRecord:
    settle(folder)
    told = earlier(folder, "results", tuple(by_suffix()))
    names = dict.fromkeys([*([told] if told else []), *(f"results{suffix}" for suffix in by_suffix())])
    file = next((folder / name for name in names if (folder / name).exists()), None)
    has_summary = (folder / "summary.json").exists()
    if file is None:
        why = "its run kept no record" if has_summary else "it has neither summary.json nor results"
        raise UsageError(f"{folder}: no result folder ({why})")
    return RunRecord(file, _summary(folder) if has_summary else {}, folder)


def _summary(folder: Path) -> Mapping[str, Any]:
    path = folder / "summary.json"
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise UsageError(f"{path}: cannot be read ({error})") from None
    if not isinstance(found, dict):
        raise UsageError(f"{path}: no summary of a run")
    return found
