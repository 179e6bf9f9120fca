"""Parquet: a folder of parts while the run goes on, for a part has to be closed to be readable; one file at its end."""

from __future__ import annotations

import shutil
from collections.abc import Collection, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from ....core.errors import OutputError
from ....core.files import exchange, writing
from ..columns import Column
from ..format import Format

ROWS = 100_000
"""Rows of a row group."""

MOST_PARTS = 256
"""Parts that are joined into one when there are as many."""


class ParquetWriter:
    """Streams columns to a Parquet file."""

    def __init__(self, path: Path, columns: Sequence[Column]):
        import pyarrow

        self.path = path
        kinds = {
            "float": pyarrow.float64(), "integer": pyarrow.int64(), "unsigned": pyarrow.uint64(),
            "boolean": pyarrow.bool_(),
        }  # fmt: skip
        self._schema = pyarrow.schema(
            [
                pyarrow.field(c.name, kinds.get(c.type, pyarrow.string()), metadata={"unit": c.unit or ""})
                for c in columns
            ]
        )
        self._parts, self._most = 0, MOST_PARTS + 1  # and one of the columns alone
        with writing(path):
            if path.is_dir():
                shutil.rmtree(path)
            path.unlink(missing_ok=True)
            path.mkdir(parents=True)
        self._write([[] for _ in columns])  # a reader finds the columns, however early the process dies

    def write(self, table: Sequence[np.ndarray | list[object]]) -> None:
        """Append rows as a part of its own."""
        if table and len(table[0]):
            self._write(table)
            if self._parts >= self._most:
                self._join()

    def _write(self, table: Sequence[np.ndarray | list[object]]) -> None:
        import pyarrow
        from pyarrow import parquet

        columns = [[v.hex() if isinstance(v, bytes) else v for v in c] if isinstance(c, list) else c for c in table]
        made = pyarrow.table([pyarrow.array(c) for c in columns], schema=self._schema)
        self._put(lambda part: parquet.write_table(made, part))

    def _put(self, write: Any) -> None:
        part = self.path / f".part-{self._parts:06d}"  # readers of folders leave what begins with a dot
        try:
            write(part)
            part.replace(self.path / f"part-{self._parts:06d}.parquet")
        except OSError as error:
            part.unlink(missing_ok=True)
            raise OutputError(f"{self.path}: cannot be written ({error.strerror or error})") from None
        self._parts += 1

    def _together(self, target: Path) -> None:
        """All parts as one file."""
        from pyarrow import parquet

        with parquet.ParquetWriter(target, self._schema) as writer:
            for part in sorted(self.path.glob("part-*.parquet")):
                for batch in parquet.ParquetFile(part).iter_batches(ROWS):
                    writer.write_batch(batch)

    def _join(self) -> None:
        """One part in place of many, from one moment to the next."""
        new = self.path.with_name(f".{self.path.name}.joined")
        shutil.rmtree(new, ignore_errors=True)
        try:
            new.mkdir()
            self._together(new / "part-000000.parquet")
            exchange(new, self.path)
        except OSError:  # no room for both: go on with many
            shutil.rmtree(new, ignore_errors=True)
            self._most *= 2
            return
        shutil.rmtree(new, ignore_errors=True)
        self._parts = 1

    def close(self, finished: bool) -> None:
        """Make one file of the parts."""
        if not self.path.is_dir():
            return
        whole = self.path.with_name(f".{self.path.name}.whole")
        try:
            _remove(whole)  # a run that was killed may have left its parts there
            self._together(whole)
            exchange(whole, self.path)
            _remove(whole)
        except OSError as error:  # the parts are left, and can be read as they are
            with suppress(OSError):
                _remove(whole)
            if finished:
                raise OutputError(f"{self.path}: cannot be written ({error.strerror or error})") from None


def _remove(place: Path) -> None:
    """Remove a file, or a folder with all that is in it."""
    if place.is_dir() and not place.is_symlink():
        shutil.rmtree(place)
    place.unlink(missing_ok=True)


def read(path: Path, texts: Collection[str], truths: Collection[str]) -> Any:
    """A frame; the file knows its types."""
    import pandas

    return pandas.read_parquet(path)


FORMAT = Format((".parquet",), ParquetWriter, read, needs=("pyarrow",))
