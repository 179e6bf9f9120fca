"""Parquet files of long runs: each row is written again a few times, whatever the length, and the parts stay few."""

from __future__ import annotations

import numpy as np
import pytest
from deepsea_cosim.master.results.columns import TIME, Column
from deepsea_cosim.master.results.frame import frame

parquet = pytest.importorskip("pyarrow.parquet")
pytest.importorskip("pandas")
COLUMNS = [TIME, Column("b.y", "float", "m"), Column("a.s", "text")]


def rows(n, first):
    t = np.arange(first, first + n, dtype=float)
    return [t, np.sin(t), [str(k) for k in range(first, first + n)]]


@pytest.mark.parametrize("linked", [True, False])
def test_rows_are_joined_tier_by_tier(tmp_path, monkeypatch, linked):
    from deepsea_cosim.master.results.formats import parquet as format

    monkeypatch.setattr(format, "MAX_PARTS", 4)
    monkeypatch.setattr(format, "ROWS", 100)
    if not linked:
        monkeypatch.setattr(format.Path, "hardlink_to", lambda *_: (_ for _ in ()).throw(OSError()))
    joined, most = [], 0
    own = format.ParquetWriter._together

    def counted(self, *given):
        own(self, *given)
        joined.append(parquet.read_metadata(given[-1]).num_rows)

    monkeypatch.setattr(format.ParquetWriter, "_together", counted)
    writer = format.ParquetWriter(tmp_path / "r.parquet", COLUMNS)
    blocks, size = 256, 10
    for k in range(blocks):
        writer.write(rows(size, size * k))
        most = max(most, len(list((tmp_path / "r.parquet").iterdir())))
    assert frame(tmp_path / "r.parquet")["time"].tolist() == list(range(blocks * size))
    writer.close(True)
    assert sum(joined) <= (4 + 1) * blocks * size  # 256 = 4^4, and the file at the end
    assert most <= 4 * 3 + 4 + 1
    read = frame(tmp_path / "r.parquet")
    assert read["time"].tolist() == list(range(blocks * size))
    assert read["b.y"].tolist() == np.sin(np.arange(blocks * size)).tolist()
    assert read["a.s"].tolist() == [str(k) for k in range(blocks * size)]
    assert parquet.read_metadata(tmp_path / "r.parquet").num_row_groups < 2 * 26  # not 256
    assert [p.name for p in tmp_path.iterdir()] == ["r.parquet"]


def test_a_large_part_is_never_in_memory_as_a_whole(tmp_path, monkeypatch):
    """Of 48 MB in one part that is copied, less than the half is held: a few row groups of 1.6 MB."""
    import pyarrow
    from deepsea_cosim.master.results.formats import parquet as format

    writer = format.ParquetWriter(tmp_path / "r.parquet", COLUMNS[:2])
    group = pyarrow.table([np.random.default_rng(0).normal(size=format.ROWS)] * 2, schema=writer._schema)
    with parquet.ParquetWriter(writer.path / "part-000000001.parquet", writer._schema) as part:
        for _ in range(30):
            part.write_table(group)
    del group
    held, before = [], pyarrow.total_allocated_bytes()
    own = parquet.ParquetWriter.write_table
    monkeypatch.setattr(
        parquet.ParquetWriter, "write_table",
        lambda self, *a, **k: held.append(pyarrow.total_allocated_bytes() - before) or own(self, *a, **k),
    )  # fmt: skip
    writer.close(True)
    assert parquet.read_metadata(tmp_path / "r.parquet").num_rows == 30 * format.ROWS
    assert max(held) < 24e6
