"""The folders that FMUs are unpacked into: one per process and content, removed as the process ends."""

from __future__ import annotations

import atexit
import hashlib
import re
import shutil
import tempfile
from collections.abc import Callable
from pathlib import Path

from ...ssp.archive import extract

_unpacked: dict[str, Path] = {}
"""Where this process has unpacked FMUs, by the hash of their content."""


def unpack(fmu: Path) -> Path:
    """Unpack an FMU once per process and content, and return its folder.

    A library that is loaded from ever new places stays in memory each time (many libraries cannot be unloaded), so a
    process that runs a package a thousand times would grow. `remove_unpacked` removes the folders.
    """
    content = hashlib.sha256(fmu.read_bytes()).hexdigest()
    if content not in _unpacked or not _unpacked[content].is_dir():
        folder = Path(tempfile.mkdtemp(prefix=f"fmu_{_plain(fmu.stem)}_"))
        try:
            extract(fmu, folder)
        except BaseException:
            shutil.rmtree(folder, ignore_errors=True)
            raise
        _unpacked[content] = folder
    return _unpacked[content]


def remove_at_exit(folder: Path) -> Callable[[], object]:
    """Have `remove_unpacked` remove this folder too, if the process ends before its owner; a call takes that back."""
    _unpacked[str(folder)] = folder
    return lambda: _unpacked.pop(str(folder), None)


@atexit.register
def remove_unpacked() -> None:
    """Remove the folders of unpacked FMUs; called when Python shuts down, and by whoever ends the process sooner."""
    while _unpacked:
        shutil.rmtree(_unpacked.popitem()[1], ignore_errors=True)


def _plain(name: str) -> str:
    return re.sub(r"[^A-Za-z0-9]", "_", name)[:40]
