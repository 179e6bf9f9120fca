"""CSV: doubles in the shortest form that reads back as the same number, true and false as 1 and 0."""

from __future__ import annotations

import csv
import io
import warnings
from collections.abc import Collection, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import orjson

from ....core.errors import OutputError
from ....core.files import writing
from ..columns import Column
from ..format import Format


class CsvWriter:
    """Streams columns to a CSV file."""

    def __init__(self, path: Path, columns: Sequence[Column]):
        self.path = path
        self._plain = all(c.type == "float" for c in columns)
        with writing(path):
            self._file = path.open("wb", buffering=0)
        head = io.StringIO()
        csv.writer(head, lineterminator="\n").writerow([c.name for c in columns])
        self._whole = 0
        self._append(head.getvalue().encode())

    def _append(self, data: bytes) -> None:
        """Write all of the data or, when that fails, leave the file as it was."""
        view = memoryview(data)
        try:
            with writing(self.path):
                while view:
                    view = view[self._file.write(view) :]
        except OutputError:
            with suppress(OSError):
                self._file.truncate(self._whole)
            raise
        self._whole += len(data)

    def write(self, table: Sequence[np.ndarray | list[object]]) -> None:
        """Append rows."""
        if not table or len(table[0]) == 0:
            return
        if self._plain and all(np.isfinite(np.asarray(c)).all() for c in table):
            rows = np.ascontiguousarray(np.stack([np.asarray(c) for c in table], axis=1))
            text = orjson.dumps(rows, option=orjson.OPT_SERIALIZE_NUMPY)
            self._append(text[2:-2].replace(b"],[", b"\n") + b"\n")
            return
        made = io.StringIO()
        writer = csv.writer(made, lineterminator="\n")
        arrays = [(c.astype(int) if c.dtype == bool else c) if isinstance(c, np.ndarray) else c for c in table]
        columns = [c.tolist() if isinstance(c, np.ndarray) else c for c in arrays]
        columns = [[v.hex() if isinstance(v, bytes) else v for v in c] for c in columns]
        writer.writerows(zip(*columns, strict=True))
        self._append(made.getvalue().encode())

    def close(self, finished: bool) -> None:
        """Close the file."""
        with suppress(OSError):
            self._file.close()


def read(path: Path, texts: Collection[str], truths: Collection[str]) -> Any:
    """A frame; 007 would be read as a number, and what is true stands there as 1, so these have to be told."""
    import pandas

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the exact reading of decimals is the default of some versions only
        names = pandas.read_csv(path, nrows=0).columns
        made = pandas.read_csv(
            path, float_precision="round_trip", dtype={name: str for name in names if name in texts},
            keep_default_na=False, na_values={name: ["nan"] for name in names if name not in texts},
        )  # fmt: skip
    return made.astype(dict.fromkeys(truths, bool))


FORMAT = Format((".csv",), CsvWriter, read)
