"""What a format of result files offers.

What a run gives is written while it goes on, so memory stays constant; and a file can be read whenever the process
dies: at most what came after the last `write` is lost.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from .columns import Column


class Writer(Protocol):
    """A file that is being written."""

    path: Path

    def write(self, table: Sequence[np.ndarray | list[object]]) -> None:
        """Append rows, given column by column."""

    def close(self, finished: bool) -> None:
        """Close the file; `finished` when the run came to its end."""


Block = Mapping[str, np.ndarray | list[str]]
"""Columns of some rows by name, the time first: numbers (n,), or texts."""


@dataclass(frozen=True)
class Format:
    """A format of result files."""

    suffixes: tuple[str, ...]
    """Of the names of its files, in small letters."""
    writer: Callable[[Path, Sequence[Column]], Writer]
    read: Callable[[Path, Collection[str], Collection[str]], Any]
    """A pandas frame of a file; also given are the columns that hold texts, and such that hold true and false."""
    needs: tuple[str, ...] = ()
    """Modules of optional libraries without which nothing can be written."""
    blocks: Callable[[Path, Collection[str]], Iterator[Block]] | None = None
    """The file some thousand rows at a time, in little memory; also given are the columns that hold texts. Raises
    `UsageError` for what is no such file. Without it `read` gives all at once."""
