"""Writes results.csv while the run goes on: a block of communication points at a time, so memory stays constant.

Row k holds, at t_k, the outputs and the inputs that the FMUs hold from t_k on. Doubles are written in the shortest form
that reads back as the same number.
"""

from __future__ import annotations

import csv
import io
from contextlib import suppress
from pathlib import Path

import numpy as np
import orjson

from ..core.errors import OutputError
from .system import System

BLOCK = 1000


class CsvRecorder:
    """Streams the signals of a system to a CSV file; a context manager."""

    def __init__(self, path: Path, system: System):
        self.path = path
        pairs = []
        for name, slave in system.slaves.items():
            pairs += [(f"{name}.{s.name}", 1 + s.place) for s in slave.outputs]
            pairs += [(f"{name}.{s.name}", 1 + len(system.read) + s.place) for s in slave.inputs]
        self.names = ["time"] + [name for name, _ in pairs]
        self._columns = np.array([0] + [place for _, place in pairs])
        try:
            self._file = path.open("wb", buffering=0)
            head = io.StringIO()
            csv.writer(head, lineterminator="\n").writerow(self.names)
            self._whole = 0
            self._append(head.getvalue().encode())
        except OSError as error:
            raise OutputError(f"{path}: cannot be written ({error.strerror})") from None

    def _append(self, data: bytes) -> None:
        """Write all of the data or, when that fails, leave the file as it was."""
        view = memoryview(data)
        try:
            while view:
                view = view[self._file.write(view) :]
        except OSError as error:
            with suppress(OSError):
                self._file.truncate(self._whole)
            raise OutputError(f"{self.path}: cannot be written ({error.strerror})") from None
        self._whole += len(data)

    def write(self, rows: np.ndarray) -> None:
        """Append rows (n, 1 + outputs + inputs)."""
        if len(rows) == 0:
            return
        text = orjson.dumps(self.in_order(rows), option=orjson.OPT_SERIALIZE_NUMPY)
        text = text[2:-2].replace(b"],[", b"\n").replace(b"null", b"nan")
        self._append(text + b"\n")

    def in_order(self, rows: np.ndarray) -> np.ndarray:
        """Rows with their columns as in `names`."""
        return np.ascontiguousarray(rows[:, self._columns])

    def close(self) -> None:
        """Close the file."""
        with suppress(OSError):
            self._file.close()
