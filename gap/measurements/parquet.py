"""Apache Parquet files (pyarrow); a column's unit is its field's metadata `unit`."""

from __future__ import annotations

from pathlib import Path

from .binary import library, table_of_arrays, translate_errors
from .table import MeasurementTable


def read(path: Path) -> MeasurementTable:
    """The columns of a Parquet file, one of which is `time` or of dates; nulls are NaN."""
    parquet = library(path, "pyarrow.parquet", "pyarrow")
    arrays, units = {}, {}
    with translate_errors(path, "Parquet"):
        table = parquet.read_table(path)
        for field, column in zip(table.schema, table.columns, strict=True):
            arrays[field.name] = column.to_numpy(zero_copy_only=False) if hasattr(column, "to_numpy") else column
            if field.metadata and b"unit" in field.metadata:
                units[field.name] = field.metadata[b"unit"].decode()
    return table_of_arrays(path, arrays, units)
