"""Around a run: the result folder, summary.json, versions, and Ctrl-C."""

from __future__ import annotations

import json
import platform
import shutil
import signal
import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from importlib import metadata
from math import isfinite
from pathlib import Path
from typing import Any

from ..core.errors import OutputError
from ..core.files import make_folder, writing

FILES = ("results.csv", "summary.json", "manifest.json", "overview.png")


@contextmanager
def interrupts() -> Iterator[list[int]]:
    """A list that Ctrl-C makes non-empty. An exception instead would end up in an FMU that is written in Python."""
    asked: list[int] = []
    if threading.current_thread() is not threading.main_thread():
        yield asked
        return
    before = signal.signal(signal.SIGINT, lambda number, _frame: asked.append(number))
    try:
        yield asked
    finally:
        signal.signal(signal.SIGINT, before)


def versions() -> dict[str, str]:
    """Versions of what a run depends on."""
    found = {"python": platform.python_version()}
    for package in ("deepsea-cosim", "fmpy", "numpy", "numba", "mujoco", "pythonfmu"):
        try:
            found[package] = metadata.version(package)
        except metadata.PackageNotFoundError:
            continue
    return found


def write_summary(folder: Path, summary: Mapping[str, Any]) -> None:
    """Write summary.json, all or nothing; numbers that are none become null."""
    path = folder / "summary.json"
    with writing(path):
        part = path.with_suffix(".part")
        part.write_text(json.dumps(_plain(summary), indent=2, allow_nan=False) + "\n")
        part.replace(path)


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    return None if isinstance(value, float) and not isfinite(value) else value


def prepare_folder(folder: Path) -> None:
    """Make the result folder, or say why that is not possible."""
    make_folder(folder)
    with writing(folder):
        for name in FILES:  # what an earlier run left would pass for this one's
            (folder / name).unlink(missing_ok=True)


def forget_earlier(file: Path) -> None:
    """Remove a result file of an earlier run; a folder of parts is one too."""
    try:
        if file.is_dir():
            shutil.rmtree(file)
        file.unlink(missing_ok=True)
    except OSError as error:
        raise OutputError(f"{file}: cannot be replaced ({error.strerror})") from None
