"""Finished cases on disk: a line of JSON each, named by what the case is, so that a killed sweep goes on.

The name is a digest of everything that the result depends on: the package's bytes, the case, the run's settings and the
metrics. What was cut by a kill at the end is written over; a line that is no entry is passed over.
"""

from __future__ import annotations

import hashlib
import json
import os
import sys
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from types import TracebackType
from typing import Any

from ...core.errors import OutputError
from ...core.files import held, make_folder, writing
from ...core.regular import require_regular

CASES_FILE = "cases.jsonl"

SAMPLE = 1 << 16
"""Bytes of the cases of which one has to be an entry of ours."""


def digest(content: Mapping[str, Any]) -> str:
    """The name of what is described by the mapping."""
    text = json.dumps(content, sort_keys=True, allow_nan=False)
    return hashlib.sha256(text.encode()).hexdigest()[:32]


class Store:
    """The finished cases of a folder; a context manager that no other process may hold at the same time."""

    def __init__(self, folder: Path):
        self.folder = folder
        self._known: dict[str, dict[str, Any]] = {}

    def __enter__(self) -> Store:
        make_folder(self.folder)
        self._lock = ExitStack()
        self._lock.enter_context(held(self.folder, "another sweep"))
        path = self.folder / CASES_FILE
        if path.exists() or path.is_symlink():
            require_regular(path, OutputError)
        whole = end = 0
        with writing(path):
            for line in path.read_bytes().splitlines(keepends=True) if path.exists() else ():
                if not line.endswith(b"\n"):
                    break
                end += len(line)
                entry = _entry(line)
                if entry is not None:
                    self._known[entry.pop("case")] = entry
                    whole = end
            self._file = path.open("ab")
            self._file.truncate(whole)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        with self._lock, writing(self.folder / CASES_FILE):  # what a full disk did not take is tried once more
            self._file.close()

    def get(self, name: str) -> dict[str, Any] | None:
        """What was kept under that name."""
        return self._known.get(name)

    def put(self, name: str, entry: Mapping[str, Any]) -> None:
        """Keep the entry; on disk when this returns."""
        self._known[name] = dict(entry)
        line = json.dumps({"case": name, **entry}, allow_nan=False)
        with writing(self.folder / CASES_FILE):
            self._file.write(line.encode() + b"\n")
            self._file.flush()
            os.fsync(self._file.fileno())


def beginning(file: Path) -> list[bytes]:
    """The first lines of a file, none where there is none."""
    if not file.is_file():
        return []
    with writing(file), file.open("rb") as opened:
        return opened.read(SAMPLE).splitlines()


def holds_cases(lines: Sequence[bytes]) -> bool:
    """Whether the beginning of a file is that of one of finished cases."""
    return bool(lines) and (lines[0].startswith(b'{"case"') or any(map(_entry, lines)))


def _entry(line: bytes) -> dict[str, Any] | None:
    try:
        entry = json.loads(line)
    except (ValueError, RecursionError):
        return None
    return entry if isinstance(entry, dict) and _is_of_a_case(entry) else None


def _is_of_a_case(entry: dict[str, Any]) -> bool:
    """Whether an entry is one that `put` has written: whoever edits the file by hand loses what does not fit."""
    warnings, values = entry.get("warnings", []), entry.get("values")
    if not isinstance(entry.get("case"), str) or not isinstance(entry.get("limit", 0.0), (int, float)):
        return False
    if not isinstance(warnings, list) or not all(isinstance(text, str) for text in warnings):
        return False
    if not isinstance(values, dict):
        return isinstance(entry.get("failed"), str)
    return all(x is None or (isinstance(x, (int, float)) and abs(x) <= sys.float_info.max) for x in values.values())
