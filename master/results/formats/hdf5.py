"""HDF5: a dataset a column, with its unit as an attribute; flushed after each block.

The library loses the file, and may crash, when a write of its own fails: so room is made on the disk first, and a disk
that is full leaves the file as it was after the last block.
"""

from __future__ import annotations

import os
from collections.abc import Collection, Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from ....core.errors import OutputError, UsageError
from ..columns import Column
from ..format import Block, Format

CHUNK = 4096
"""Values that a column grows by in the file."""

SPARE, COLUMN = 1 << 18, 1 << 12
"""Bytes that the library may need beside the values: in all, and for each column."""


class Hdf5Writer:
    """Streams columns to an HDF5 file."""

    def __init__(self, path: Path, columns: Sequence[Column]):
        import h5py

        self.path = path
        kinds = {
            "float": np.float64, "integer": np.int64, "unsigned": np.uint64, "boolean": np.bool_,
            "text": h5py.string_dtype(),
        }  # fmt: skip
        self._sets = []
        self._rows = 0
        try:
            path.write_bytes(bytes(SPARE))  # before the library touches it
            self._file = h5py.File(path, "w", track_order=True, locking=False)
            self._make_room(len(columns) * COLUMN)
            for c in columns:
                made = self._file.create_dataset(
                    c.name.replace("/", "\\"), (0,), kinds[c.type], maxshape=(None,), chunks=(CHUNK,)
                )
                made.attrs["unit"] = c.unit or ""
                self._sets.append(made)
            self._file.flush()
        except OSError as error:
            path.unlink(missing_ok=True)
            raise OutputError(f"{path}: cannot be written ({error.strerror or error})") from None

    def write(self, table: Sequence[np.ndarray | list[object]]) -> None:
        """Append rows."""
        if not table or len(table[0]) == 0:
            return
        n = len(table[0])
        chunks = -(-(self._rows + n) // CHUNK) + -self._rows // CHUNK
        texts = sum(len(str(v)) + 64 for column in table if isinstance(column, list) for v in column)
        try:
            self._make_room(len(table) * (8 * CHUNK * chunks + COLUMN) + 2 * texts)
            for dataset, column in zip(self._sets, table, strict=True):
                texts = isinstance(column, list)
                dataset.resize((self._rows + n,))
                dataset[self._rows :] = [v.hex() if isinstance(v, bytes) else v for v in column] if texts else column
            self._file.flush()
        except (OSError, RuntimeError) as error:
            reason = getattr(error, "strerror", None) or error
            raise OutputError(f"{self.path}: cannot be written ({reason})") from None
        self._rows += n

    def _make_room(self, size: int) -> None:
        """Take so many bytes, and some to spare, behind the end of the file."""
        if not hasattr(os, "posix_fallocate"):
            return
        with self.path.open("r+b") as file:
            os.posix_fallocate(file.fileno(), self._file.id.get_filesize(), size + SPARE)

    def close(self, finished: bool) -> None:
        """Close the file."""
        with suppress(OSError, RuntimeError, ValueError):
            used = self._file.id.get_filesize()
            self._file.close()
            os.truncate(self.path, used)


def read(path: Path, texts: Collection[str], truths: Collection[str]) -> Any:
    """A frame, of a file that a killed run has left, too; the file knows its types."""
    import h5py
    import pandas

    with h5py.File(path, "r", locking=False) as file:
        columns = {
            name.replace("\\", "/"): (d if h5py.check_string_dtype(d.dtype) is None else d.asstr())[()]
            for name, d in file.items()
        }
    length = min(len(c) for c in columns.values())
    return pandas.DataFrame({name: c[:length] for name, c in columns.items()})


def blocks(path: Path, texts: Collection[str]) -> Iterator[Block]:
    """Blocks of rows; the file knows its types."""
    import h5py

    try:
        with h5py.File(path, "r", locking=False) as file:
            sets = {n.replace("\\", "/"): d for n, d in file.items() if isinstance(d, h5py.Dataset) and d.ndim == 1}
            told = {n: d if h5py.check_string_dtype(d.dtype) is None else d.asstr() for n, d in sets.items()}
            length = min((len(d) for d in sets.values()), default=0)
            for first in range(0, max(length, 1), 16 * CHUNK):
                rows = slice(first, min(first + 16 * CHUNK, length))
                yield {n: d[rows] if sets[n].dtype.kind != "O" else list(d[rows]) for n, d in told.items()}
    except (OSError, TypeError) as error:
        raise UsageError(f"{path}: no result file ({error})") from None


FORMAT = Format((".h5", ".hdf5"), Hdf5Writer, read, needs=("h5py",), blocks=blocks)
