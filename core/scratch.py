"""Folders for what a process needs for a while. Each is locked by its process: what one that was killed has left is
removed by the next command that starts, and nothing of one that is running."""

from __future__ import annotations

import atexit
import os
import shutil
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

PREFIX = "deepsea-cosim-"

YOUNG = 5.0
"""Age of a folder [s] below which it is left, for its process may not have locked it yet."""

_own: dict[Path, int | None] = {}
"""The folders of this process, and the descriptors that hold their locks."""


def make_scratch(kind: str, inside: Path | None = None) -> Path:
    """A new folder in the system's place for such, or inside another; it goes as the process ends, if not before."""
    made = Path(tempfile.mkdtemp(prefix=f"{PREFIX}{kind}-", dir=inside))
    _own[made] = _locked(made)
    return made


def remove_scratch(folder: Path) -> None:
    """Remove a folder with all that is in it."""
    shutil.rmtree(folder, ignore_errors=True)
    if (lock := _own.pop(folder, None)) is not None:
        with suppress(OSError):
            os.close(lock)


@contextmanager
def scratch(kind: str) -> Iterator[Path]:
    """A folder for as long as something lasts."""
    made = make_scratch(kind)
    try:
        yield made
    finally:
        remove_scratch(made)


@atexit.register
def remove_all() -> None:
    """Remove the folders of this process; called when Python shuts down, and by whoever ends the process sooner."""
    for folder in list(_own):
        remove_scratch(folder)


def sweep() -> None:
    """Remove what processes that were killed have left. Where folders cannot be locked (Windows) nothing is."""
    with suppress(OSError):
        for entry in os.scandir(tempfile.gettempdir()):
            if entry.name.startswith(PREFIX):
                with suppress(OSError):
                    if entry.is_dir(follow_symlinks=False) and time.time() - entry.stat().st_mtime > YOUNG:
                        _remove_if_left(Path(entry.path))


def _remove_if_left(folder: Path) -> None:
    lock = _locked(folder)
    if lock is not None:  # neither another process nor this one holds it
        try:
            shutil.rmtree(folder, ignore_errors=True)
        finally:
            os.close(lock)


def _locked(folder: Path) -> int | None:
    """A descriptor that locks a folder; None where another one does, or where that is not possible."""
    try:
        import fcntl

        file = os.open(folder, os.O_RDONLY)
    except (ImportError, OSError):
        return None
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        os.close(file)
        return None
    return file
