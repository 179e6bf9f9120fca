"""HDF5: a dataset a column, with its unit as an attribute; flushed after each block."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

import numpy as np

from ...core.errors import OutputError, UsageError
from .columns import Column

CHUNK = 4096


class Hdf5Writer:
    """Streams columns to an HDF5 file."""

    def __init__(self, path: Path, columns: Sequence[Column]):
        try:
            import h5py
        except ImportError:
            raise UsageError(f"{path}: HDF5 needs h5py: pip install 'deepsea-cosim[results]'") from None
        self.path = path
        kinds = {
            "float": np.float64, "integer": np.int64, "unsigned": np.uint64, "boolean": np.bool_,
            "text": h5py.string_dtype(),
        }  # fmt: skip
        self._sets = []
        self._rows = 0
        try:
            self._file = h5py.File(path, "w")
            for c in columns:
                made = self._file.create_dataset(
                    c.name.replace("/", "\\"), (0,), kinds[c.type], maxshape=(None,), chunks=(CHUNK,)
                )
                made.attrs["unit"] = c.unit or ""
                self._sets.append(made)
            self._file.flush()
        except OSError as error:
            raise OutputError(f"{path}: cannot be written ({error})") from None

    def write(self, table: Sequence[np.ndarray | list[object]]) -> None:
        """Append rows."""
        if not table or len(table[0]) == 0:
            return
        n = len(table[0])
        try:
            for dataset, column in zip(self._sets, table, strict=True):
                texts = isinstance(column, list)
                dataset.resize((self._rows + n,))
                dataset[self._rows :] = [v.hex() if isinstance(v, bytes) else v for v in column] if texts else column
            self._file.flush()
        except (OSError, RuntimeError) as error:
            raise OutputError(f"{self.path}: cannot be written ({error})") from None
        self._rows += n

    def close(self, finished: bool) -> None:
        """Close the file."""
        with suppress(OSError, RuntimeError, ValueError):
            self._file.close()
