"""Parquet: a folder of parts while the run goes on, for a part has to be closed to be readable; one file at its end.

Many small parts are joined into a larger one, and many of these into a still larger one: each row is written again only
once for every tier, and few files are there, however long the run.
"""

from __future__ import annotations

import shutil
from collections.abc import Collection, Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from ....core.errors import OutputError, UsageError
from ....core.files import exchange, writing
from ..columns import Column
from ..format import Block, Format

ROWS = 100_000
"""Rows of a row group."""

MAX_PARTS = 256
"""Parts of one tier that are joined into one of the next when there are as many."""


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
        self._most, self._parts = MAX_PARTS, 0
        self._tiers: list[list[str]] = [[]]
        """Names of the parts, those of written blocks first, then of what they have been joined into."""
        with writing(path):
            if path.is_dir():
                shutil.rmtree(path)
            path.unlink(missing_ok=True)
            path.mkdir(parents=True)
        self._write([[] for _ in columns])  # a reader finds the columns, however early the process dies
        self._tiers = [[]]  # and that part stays

    def write(self, table: Sequence[np.ndarray | list[object]]) -> None:
        """Append rows as a part of its own."""
        if table and len(table[0]):
            self._write(table)
            tier = 0
            while len(self._tiers[tier]) >= self._most and self._join(tier):
                tier += 1

    def _write(self, table: Sequence[np.ndarray | list[object]]) -> None:
        import pyarrow
        from pyarrow import parquet

        columns = [[v.hex() if isinstance(v, bytes) else v for v in c] if isinstance(c, list) else c for c in table]
        made = pyarrow.table([pyarrow.array(c) for c in columns], schema=self._schema)
        self._put(lambda part: parquet.write_table(made, part))

    def _put(self, write: Any) -> None:
        name = f"part-{self._parts:09d}.parquet"
        part = self.path / f".{name}"  # readers of folders leave what begins with a dot
        try:
            write(part)
            part.replace(self.path / name)
        except OSError as error:
            part.unlink(missing_ok=True)
            raise OutputError(f"{self.path}: cannot be written ({error.strerror or error})") from None
        self._parts += 1
        self._tiers[0].append(name)

    def _together(self, names: Sequence[str], target: Path) -> None:
        """Parts as one file."""
        import pyarrow
        from pyarrow import parquet

        with parquet.ParquetWriter(target, self._schema) as writer:
            waiting: list[Any] = []

            def write() -> None:
                writer.write_table(pyarrow.concat_tables([self._schema.empty_table(), *waiting]), row_group_size=ROWS)
                waiting.clear()

            for name in names:
                with parquet.ParquetFile(self.path / name) as part:
                    for k in range(part.num_row_groups):  # in batches it would keep the whole of a large part
                        waiting.append(part.read_row_group(k))
                        if sum(table.num_rows for table in waiting) >= ROWS:
                            write()
            write()

    def _join(self, tier: int) -> bool:
        """One part in place of all of a tier, from one moment to the next; whether there was room for it."""
        names = self._tiers[tier]
        new = self.path.with_name(f".{self.path.name}.joined")
        shutil.rmtree(new, ignore_errors=True)
        try:
            new.mkdir()
            self._together(names, new / names[0])
            for part in self.path.glob("part-*.parquet"):
                if part.name not in names:
                    _same(part, new / part.name)
            exchange(new, self.path)
        except OSError:  # no room for both: go on with many
            shutil.rmtree(new, ignore_errors=True)
            self._most *= 2
            return False
        shutil.rmtree(new, ignore_errors=True)
        if tier + 1 == len(self._tiers):
            self._tiers.append([])
        self._tiers[tier + 1].append(names[0])
        self._tiers[tier] = []
        return True

    def close(self, finished: bool) -> None:
        """Make one file of the parts."""
        if not self.path.is_dir():
            return
        whole = self.path.with_name(f".{self.path.name}.whole")
        try:
            _remove(whole)  # a run that was killed may have left its parts there
            self._together(sorted(part.name for part in self.path.glob("part-*.parquet")), whole)
            exchange(whole, self.path)
            _remove(whole)
        except OSError as error:  # the parts are left, and can be read as they are
            with suppress(OSError):
                _remove(whole)
            if finished:
                raise OutputError(f"{self.path}: cannot be written ({error.strerror or error})") from None


def _same(part: Path, place: Path) -> None:
    """A part in another folder, too."""
    try:
        place.hardlink_to(part)
    except OSError:  # not every file system can
        shutil.copyfile(part, place)


def _remove(place: Path) -> None:
    """Remove a file, or a folder with all that is in it."""
    if place.is_dir() and not place.is_symlink():
        shutil.rmtree(place)
    place.unlink(missing_ok=True)


def read(path: Path, texts: Collection[str], truths: Collection[str]) -> Any:
    """A frame; the file knows its types."""
    import pandas

    return pandas.read_parquet(path)


def blocks(path: Path, texts: Collection[str]) -> Iterator[Block]:
    """Blocks of rows; the file, or the folder of parts that a killed run has left, knows its types."""
    import pyarrow
    from pyarrow import parquet

    words = {pyarrow.string(), pyarrow.large_string()}
    try:
        for part in sorted(path.glob("part-*.parquet")) if path.is_dir() else [path]:
            with parquet.ParquetFile(part) as file:
                for k in range(file.num_row_groups):  # in batches it would keep the whole of a large part
                    table = file.read_row_group(k)
                    yield {
                        name: [str(v) for v in column.to_pylist()] if column.type in words else column.to_numpy()
                        for name, column in zip(table.column_names, table.columns, strict=True)
                    }
    except pyarrow.ArrowException as error:
        raise UsageError(f"{path}: no result file ({str(error).splitlines()[0]})") from None


FORMAT = Format((".parquet",), ParquetWriter, read, needs=("pyarrow",), blocks=blocks)
