"""What is kept of a run: blocks of rows on their way to the result file, a thinned sample, extremes, energies."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from ...core.errors import OutputError
from ..accuracy.held_inputs import HeldInputs
from ..coupling.residual_energy import ResidualEnergy
from ..results import open_writer
from ..results.columns import RecordLayout
from ..results.constants import Constant
from ..results.format import Writer
from ..system.system import System

BLOCK, BLOCK_BYTES = 1000, 1 << 26
"""Rows that are held in memory at most, and their size: those of thousands of columns are fewer."""


def rows_in_memory(width: int) -> int:
    """How many rows of so many numbers are held at a time."""
    return min(BLOCK, max(1, BLOCK_BYTES // (8 * max(1, width))))


SAMPLE, SAMPLE_BYTES = 4000, 1 << 26
"""Points of the thinned sample, and their size likewise; it may have twice as many."""


def sample_stride(steps: int, columns: int) -> int:
    """Distance of the sampled points [steps] in a run of so many."""
    return max(1, steps // min(SAMPLE, max(2, SAMPLE_BYTES // (8 * columns))))


FLUSH_AFTER, FLUSH_SHARE = 0.5, 0.1
"""Wall time after which rows are written though the block is not full [s], and the most of it that writing may take."""


class Recording:
    """Records a run. Rows come from the engine by `rows` and `add_rows`."""

    def __init__(
        self, system: System, layout: RecordLayout, recorded_columns: Sequence[int], file: Path | None, every: int,
        energy: ResidualEnergy, held: HeldInputs, stride: int, constants: Sequence[Constant] = (), begin: int = 0,
        on_first_rows: Callable[[], object] = lambda: None,
    ):  # fmt: skip
        """every: of the rows that are written, the first being number `begin` of the run that it goes on with;
        on_first_rows: called once there are rows in the file."""
        self.system, self.layout, self.recorded_columns, self.every = system, layout, recorded_columns, every
        self.energy, self.held = energy, held
        self._constants, self._begin, self._on_first_rows = constants, begin, on_first_rows
        self.columns = [*(layout.columns[i] for i in recorded_columns), *(c.column for c in constants)]
        """Of the result file."""
        self._writer: Writer | None = open_writer(file, self.columns) if file else None
        width = len(layout.outputs) + len(layout.inputs)
        self._block = rows_in_memory(width)
        self._rows = np.zeros((self._block + 1, width))
        self._times = np.zeros(self._block + 1)
        self._filled = 0
        self._flushed = 0
        self.written_to: float | None = None
        """Time of the last row that stands in the result file [s]."""
        self._rest: list[np.ndarray | list[object]] | None = None
        self._written, self._taken = perf_counter(), 0.0
        self._texts: list[tuple[list[object], list[object]]] = []
        self._sample: list[np.ndarray] = []
        self._stride = stride
        self._extremes: np.ndarray | None = None

    def described(self) -> dict[str, Any]:
        """The columns of the result file for summary.json: names, units, types of those that are no floats, texts."""
        return {
            "columns": [c.name for c in self.columns],
            "units": {c.name: c.unit for c in self.columns if c.unit},
            "types": {c.name: c.type for c in self.columns if c.type != "float"},
            "descriptions": {c.name: c.text for c in self.columns if c.text},
        }

    def free_rows(self) -> int:
        """Steps that may be taken until the block is full."""
        return self._block - self._filled

    def rows(self, count: int) -> np.ndarray:
        """Where the engine puts its rows."""
        return self._rows[self._filled : self._filled + count]

    def add_rows(self, start: float, h: float, first: int, count: int) -> None:
        """So many rows have been filled, of the steps first, first + 1, ..."""
        self._times[self._filled : self._filled + count] = start + (first + np.arange(count)) * h
        self._filled += count

    def add_final_row(self, time: float) -> None:
        """The point at the end, from the buffer."""
        reals = self.system.buffer.reals
        self._rows[self._filled] = reals[[*self.layout.outputs, *self.layout.inputs]]
        self._times[self._filled] = time
        self._filled += 1
        if self.layout.keeps_texts:
            texts: list[object] = list(self.system.buffer.texts)
            self._texts.append((texts, texts))

    def take_texts(self, program: Any) -> None:
        """Have the program keep the strings at the start and the end of each step."""
        buffer = self.system.buffer
        self._before: list[object] = list(buffer.texts)

        def take(_t: float, _h: float) -> int:
            # strings at the end of a step are those at the start of the next one
            self._texts.append((list(self._before), list(buffer.texts)))
            self._before = list(buffer.texts)
            return 0

        program.python(take)

    def due(self) -> bool:
        """Whether it is time to write."""
        return self._filled >= self._block or perf_counter() - self._written > max(
            FLUSH_AFTER, self._taken / FLUSH_SHARE
        )

    def flush(self) -> None:
        """Hand on the rows of the block that are complete."""
        n, begin = self._filled, perf_counter()
        if n == 0:
            return
        rows, times = self._rows[:n], self._times[:n]
        self.energy.add(times, rows)
        self.held.add(rows)
        if self.layout.keeps_texts and len(self._texts) < n:  # a step that failed has not come to its texts
            self._texts.append((list(self._before), list(self.system.buffer.texts)))
        texts = self._texts[:n]
        self._filled = 0
        self._texts = self._texts[n:]
        first, self._flushed = self._flushed, self._flushed + n
        self._keep(first, times, rows)
        if self._writer is not None:
            kept = slice(-(self._begin + first) % self.every, None, self.every)
            self._writer.write(self._table(times[kept], rows[kept], texts[kept]))
            self.written_to = float(times[kept][-1]) if len(times[kept]) else self.written_to
            self._rest = None
            if (self._begin + self._flushed - 1) % self.every:
                self._rest = self._table(times[-1:].copy(), rows[-1:].copy(), texts[-1:])
        if first == 0:
            self._on_first_rows()
        self._written = perf_counter()
        self._taken = self._written - begin

    def _table(
        self, times: np.ndarray, rows: np.ndarray, texts: list[tuple[list[object], list[object]]]
    ) -> list[np.ndarray | list[object]]:
        """The columns of the file."""
        return [
            *self.layout.cut(self.recorded_columns, times, rows, texts),
            *(c.rows(len(times)) for c in self._constants),
        ]

    def _keep(self, first: int, times: np.ndarray, rows: np.ndarray) -> None:
        """The sample and the extremes of a block."""
        table = self._numbers(times, rows)
        if len(points := table[-first % self._stride :: self._stride]):
            self._sample.append(points.copy())
        if self._extremes is None:
            self._extremes = np.stack([table[0]] * 4)
        self._extremes[1] = np.minimum(self._extremes[1], table.min(axis=0))
        self._extremes[2] = np.maximum(self._extremes[2], table.max(axis=0))
        self._extremes[3] = table[-1]

    def _numbers(self, times: np.ndarray, rows: np.ndarray) -> np.ndarray:
        """All columns as floats (n, columns); strings are NaN."""
        everything = self.layout.cut(range(len(self.layout.columns)), times, rows, [])
        made = np.empty((len(times), len(everything)))
        for j, column in enumerate(everything):
            made[:, j] = np.nan if isinstance(column, list) else column
        return made

    def sampled(self) -> np.ndarray:
        """The thinned sample (n, columns), the last point included."""
        made = np.concatenate(self._sample)
        assert self._extremes is not None
        return made if made[-1, 0] == self._extremes[3, 0] else np.concatenate([made, self._extremes[3:]])

    def extremes(self) -> np.ndarray | None:
        """First, least, greatest and last value of each column (4, columns)."""
        return self._extremes

    def moved_to(self, file: Path) -> None:
        """The file has been put somewhere else."""
        if self._writer is not None:
            self._writer.path = file

    def finish(self) -> None:
        """The run came to its end, which is kept whatever `every` is."""
        if self._writer is not None:
            if self._rest is not None:
                self._writer.write(self._rest)
            writer, self._writer = self._writer, None
            writer.close(True)

    def close(self) -> None:
        """Close the file, whatever became of the run."""
        if self._writer is not None:
            with suppress(OutputError):
                self._writer.close(False)
            self._writer = None
