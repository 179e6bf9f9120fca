"""Result files: what they hold, and the formats in which they are written and read."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

from ...core.errors import UsageError, install
from ...core.regular import require_regular
from .columns import Column
from .format import Format, Writer


@cache
def by_suffix() -> dict[str, Format]:
    """Formats by file name suffix: what the modules of `formats` offer, CSV first."""
    files = sorted(Path(__file__).parent.glob("formats/[a-z]*.py"), key=lambda path: (path.stem != "csv", path.stem))
    found: list[Format] = [import_module(f".formats.{path.stem}", __package__).FORMAT for path in files]
    return {suffix: format for format in found for suffix in format.suffixes}


def format_of(path: Path) -> Format:
    """The format of a result file, by its suffix; raises `UsageError` where there is none."""
    found = by_suffix().get(path.suffix.lower())
    if found is None:
        raise UsageError(f"{path}: results can be written as {', '.join(by_suffix())}")
    return found


def check_writable(path: Path) -> None:
    """Raise `UsageError` where a file of that name cannot be written: no format has its suffix, or a library is
    missing."""
    for module in format_of(path).needs:
        if find_spec(module) is None:
            raise UsageError(f"{path}: {path.suffix} files need {module}: {install('results')}")


def check_readable(path: Path) -> None:
    """Raise `UsageError` for a pipe or a device in the place of a file; a folder may be one of Parquet's parts."""
    if path.exists() and not path.is_dir():
        require_regular(path, UsageError)


def open_writer(path: Path, columns: Sequence[Column]) -> Writer:
    """The writer of a result file; see `check_writable`."""
    check_writable(path)
    return format_of(path).writer(path, columns)
