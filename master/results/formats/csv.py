"""CSV: doubles in the shortest form that reads back as the same number, true and false as 1 and 0."""

from __future__ import annotations

import csv
import io
import warnings
from collections.abc import Collection, Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import orjson

from ....core.errors import OutputError, UsageError
from ....core.files import writing
from ....core.owned import read_object
from ....core.repeated import repeated
from ..columns import Column
from ..format import Block, Format

BLOCK = 1 << 22
"""Bytes that are read at once, and the rest of their last line."""


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

    whole = _whole_rows(path.read_bytes()) if _is_of_a_broken_run(path) else b""

    def source() -> Path | io.BytesIO:
        return io.BytesIO(whole) if whole else path

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the exact reading of decimals is the default of some versions only
        names = pandas.read_csv(source(), nrows=0).columns
        made = pandas.read_csv(
            source(), float_precision="round_trip", dtype={name: str for name in names if name in texts},
            keep_default_na=False, na_values={name: ["nan"] for name in names if name not in texts},
        )  # fmt: skip
    return made.astype(dict.fromkeys(truths, bool))


def blocks(path: Path, texts: Collection[str]) -> Iterator[Block]:
    """Blocks of rows; a column whose fields are no numbers is one of texts, an empty field among numbers is none.

    A last row that a run has not finished is left out: it may have all its fields, the last of which is cut off.
    """
    try:
        with path.open("rb") as file:
            names = next(csv.reader([file.readline().decode("utf-8-sig")]), [])
            if not names:
                raise UsageError(f"{path}: empty; a result file begins with the names of its columns")
            if (twice := repeated(names)) is not None:
                raise UsageError(f"{path}: has two columns '{twice}'")
            yield {name: np.empty(0) for name in names}
            while data := file.read(BLOCK) + file.readline():
                while data.count(b'"') % 2 and (more := file.readline()):  # a text goes on in the next line
                    data += more
                if len(whole := _whole_rows(data)) < len(data) and _is_of_a_broken_run(path):
                    data = whole
                yield _block(path, names, data, texts)
    except UnicodeDecodeError:
        raise UsageError(f"{path}: no result file (it is no text)") from None


def _whole_rows(data: bytes) -> bytes:
    """The rows that end; a line that ends within quotes is no row."""
    end = len(data)
    while end and (data[end - 1 : end] != b"\n" or data.count(b'"', 0, end) % 2):
        end = data.rfind(b"\n", 0, end - 1) + 1
    return data[:end]


def _is_of_a_broken_run(path: Path) -> bool:
    """Whether a run has written the file that has not come to its end; its rows end with the line, as a row of another
    tool need not."""
    for folder in path.absolute().parents:
        options = read_object(folder / "manifest.json").get("options")
        if isinstance(options, dict) and (folder / str(options.get("results"))) == path.absolute():
            return read_object(folder / "summary.json").get("status") not in ("ok", "ended")
    return False


def _block(path: Path, names: Sequence[str], data: bytes, texts: Collection[str]) -> Block:
    """Columns of some whole lines."""
    if set(texts).isdisjoint(names):
        with suppress(ValueError):  # as almost all are: nothing but finite numbers, which read like JSON
            lines = data.replace(b"\r\n", b"\n").rstrip(b"\n").replace(b"\n", b"],[")
            table = np.array(orjson.loads(b"[[" + lines + b"]]"), float)
            if table.ndim == 2 and table.shape[1] == len(names):
                return dict(zip(names, table.T, strict=True))
    rows = [row for row in csv.reader(io.StringIO(data.decode(), newline="")) if row]
    if rows and len(rows[-1]) < len(names) and not data.endswith(b"\n"):
        rows.pop()
    for row in rows:
        if len(row) != len(names):
            raise UsageError(f"{path}: a row has {len(row)} fields ({','.join(row)[:40]}...), the head {len(names)}")
    columns = zip(*rows, strict=True) if rows else ([] for _ in names)
    return {name: _values(list(column), name in texts) for name, column in zip(names, columns, strict=True)}


def _values(column: list[str], is_text: bool) -> np.ndarray | list[str]:
    if not is_text:
        with suppress(ValueError):
            return np.array([float(v) if v else np.nan for v in column])
    return column


FORMAT = Format((".csv",), CsvWriter, read, blocks=blocks)
