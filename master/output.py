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
    """A list that Ctrl-C, or a request to end (SIGTERM), makes non-empty.

    An exception instead would end up in an FMU that is written in Python.
    """
    asked: list[int] = []
    if threading.current_thread() is not threading.main_thread():
        yield asked
        return
    kinds = (signal.SIGINT, signal.SIGTERM)
    before = [signal.signal(kind, lambda number, _frame: asked.append(number)) for kind in kinds]
    try:
        yield asked
    finally:
        for kind, handler in zip(kinds, before, strict=True):
            signal.signal(kind, handler)


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
        earlier = _earlier_results(folder)
        for name in FILES:  # what an earlier run left would pass for this one's
            (folder / name).unlink(missing_ok=True)
    if earlier is not None:
        forget_earlier(earlier)


def _earlier_results(folder: Path) -> Path | None:
    """The result file of the run before, by its manifest."""
    try:
        name = json.loads((folder / "manifest.json").read_text())["options"]["results"]
    except (OSError, ValueError, KeyError, TypeError):
        return None
    return folder / name if isinstance(name, str) and name and Path(name).name == name else None


def forget_earlier(file: Path) -> None:
    """Remove a result file of an earlier run; a folder of parts is one too."""
    try:
        if file.is_dir():
            shutil.rmtree(file)
        file.unlink(missing_ok=True)
    except OSError as error:
        raise OutputError(f"{file}: cannot be replaced ({error.strerror})") from None
