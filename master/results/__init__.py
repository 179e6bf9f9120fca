"""Result files, a format a file: what a run gives is written while it goes on, so memory stays constant.

A writer has `write(table)` for a block of rows, `close(finished)`, and leaves a file that can be read whenever the
process dies: at most what came after the last `write` is lost.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Protocol

import numpy as np

from ...core.errors import UsageError
from .columns import Column

SUFFIXES = {".csv": "csv", ".parquet": "parquet", ".h5": "hdf5", ".hdf5": "hdf5"}
"""Formats by file name suffix."""


class Writer(Protocol):
    """What a format offers."""

    path: Path

    def write(self, table: Sequence[np.ndarray | list[object]]) -> None:
        """Append rows, given column by column."""

    def close(self, finished: bool) -> None:
        """Close the file; `finished` when the run came to its end."""


def open_writer(path: Path, columns: Sequence[Column]) -> Writer:
    """The writer of a result file, by its suffix."""
    kind = SUFFIXES.get(path.suffix.lower())
    if kind == "csv":
        from .csv import CsvWriter

        return CsvWriter(path, columns)
    if kind == "parquet":
        from .parquet import ParquetWriter

        return ParquetWriter(path, columns)
    if kind == "hdf5":
        from .hdf5 import Hdf5Writer

        return Hdf5Writer(path, columns)
    raise UsageError(f"{path}: results can be written as {', '.join(SUFFIXES)}")
