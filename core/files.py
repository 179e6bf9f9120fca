"""Writing where the user said."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from .errors import OutputError


@contextmanager
def writing(path: Path) -> Iterator[None]:
    """Around what writes to the path: raises `OutputError` in one line when the disk or the rights do not allow it."""
    try:
        yield
    except OSError as error:
        raise OutputError(f"{path}: cannot be written ({error.strerror or error})") from None


def make_folder(path: Path) -> None:
    """Make the folder and those above it; raises `OutputError` where that, or a file in it, is not possible."""
    with writing(path):
        path.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=path):
            pass
