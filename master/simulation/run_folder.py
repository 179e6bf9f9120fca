"""Around a run: the result folder and summary.json."""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from ...core.console import plain
from ...core.errors import OutputError
from ...core.files import held, make_folder, writing
from ..results import by_suffix
from .saved_state import STATE_FILE

PAGE = "results.html"
FILES = ("results.csv", "summary.json", "manifest.json", "overview.png", PAGE, STATE_FILE)
LOG_SUFFIXES = (".log", ".txt", ".tsv")
"""Of names of message logs."""


def write_summary(folder: Path, summary: Mapping[str, Any]) -> None:
    """Write summary.json, all or nothing; numbers that are none become null."""
    path = folder / "summary.json"
    with writing(path):
        part = path.with_suffix(".part")
        part.write_text(json.dumps(plain(summary), indent=2, allow_nan=False) + "\n")
        part.replace(path)


@contextmanager
def result_folder(folder: Path, results: str = "", log: str = "") -> Iterator[None]:
    """Make the result folder and those of the result file and message log in it and hold it, or say why that is not
    possible.

    What an earlier run left, which would pass for this one's, is removed.
    """
    make_folder(folder)
    with held(folder, "another run"):
        for name in filter(None, (results, log)):
            make_folder((folder / name).parent)
        left = earlier(folder, "results", tuple(by_suffix())), earlier(folder, "log", LOG_SUFFIXES)
        with writing(folder):
            for name in FILES:
                (folder / name).unlink(missing_ok=True)
        for name in dict.fromkeys(filter(None, (*left, results, log))):
            _forget(folder / name)
        yield


def earlier(folder: Path, option: str, suffixes: Sequence[str]) -> str | None:
    """Name of a file of the run before in the folder, by its manifest; None for what cannot be one."""
    try:
        name = json.loads((folder / "manifest.json").read_text())["options"][option]
        fits = len(name) < 200 and name.isprintable() and Path(name).suffix.lower() in suffixes
        return name if fits and (folder / name).resolve().is_relative_to(folder.resolve()) else None
    except Exception:  # whatever stands there
        return None


def _forget(file: Path) -> None:
    """Remove a result file of an earlier run; a folder of Parquet's parts is one too, any other is not ours."""
    try:
        if file.is_dir() and not file.is_symlink():
            if any(not p.name.startswith((".part-", "part-")) for p in file.iterdir()):
                raise OutputError(f"{file}: cannot be replaced (a folder that holds other things than results)")
            shutil.rmtree(file)
        file.unlink(missing_ok=True)
    except OSError as error:
        raise OutputError(f"{file}: cannot be replaced ({error.strerror})") from None
