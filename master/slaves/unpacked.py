"""The folders that FMUs are unpacked into: one per process and content, removed as the process ends."""

from __future__ import annotations

import hashlib
import re
from pathlib import Path

from ...core.scratch import make_scratch, remove_scratch
from ...ssp.archive import extract

_unpacked: dict[str, Path] = {}
"""Where this process has unpacked FMUs, by the hash of their content."""


def unpack(fmu: Path) -> Path:
    """Unpack an FMU once per process and content, and return its folder.

    A library that is loaded from ever new places stays in memory each time (many libraries cannot be unloaded), so a
    process that runs a package a thousand times would grow. `core.scratch.remove_all` removes the folders.
    """
    content = hashlib.sha256(fmu.read_bytes()).hexdigest()
    if content not in _unpacked or not _unpacked[content].is_dir():
        folder = make_scratch(f"fmu-{_plain(fmu.stem)}")
        try:
            extract(fmu, folder)
        except BaseException:
            remove_scratch(folder)
            raise
        _unpacked[content] = folder
    return _unpacked[content]


def _plain(name: str) -> str:
    return re.sub(r"[^A-Za-z0-9]", "_", name)[:40]
