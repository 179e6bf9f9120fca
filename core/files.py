"""Writing where the user said."""

from __future__ import annotations

import ctypes
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from .errors import OutputError


@contextmanager
def writing(path: Path) -> Iterator[None]:
    """Around what writes to the path: raises `OutputError` in one line when the disk or the rights do not allow it."""
    try:
        yield
    except OSError as error:
        raise OutputError(f"{path}: cannot be written ({error.strerror or error})") from None


def exchange(one: Path, other: Path) -> None:
    """Swap two files or folders at once: nobody, however it ends, sees one of them missing.

    Where the system cannot (Linux alone can), one is away for a moment, as `.<name>.away...` beside it.
    """
    with suppress(OSError, AttributeError):
        here, swap = -100, 2  # AT_FDCWD, RENAME_EXCHANGE
        if ctypes.CDLL(None).renameat2(here, os.fsencode(one), here, os.fsencode(other), swap) == 0:
            return
    away = other.with_name(f".{other.name}.away{os.getpid()}")
    other.rename(away)
    one.rename(other)
    away.rename(one)


def make_folder(path: Path) -> None:
    """Make the folder and those above it; raises `OutputError` where that, or a file in it, is not possible."""
    with writing(path):
        path.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=path):
            pass
