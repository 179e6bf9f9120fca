"""The table of a sweep: a row a case, on disk as Parquet where pyarrow is installed, else as CSV."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from ...core.files import replacing
from .cases import Case

FILES = ("sweep.parquet", "sweep.csv")
"""What `write` may have written."""


def rows(cases: Sequence[Case], entries: Sequence[Mapping[str, Any]], labels: Sequence[str]) -> list[dict[str, Any]]:
    """Number, values, metrics (None where one does not exist or the case failed), why it failed, what warns of it."""
    made = []
    for k, (case, entry) in enumerate(zip(cases, entries, strict=True)):
        found = entry.get("values", {})
        said = {"failed": entry.get("failed"), "warnings": "; ".join(entry.get("warnings", ())) or None}
        made.append({"case": k, **case, **{label: found.get(label) for label in labels}, **said})
    return made


def write(table: Sequence[Mapping[str, Any]], folder: Path, units: Mapping[str, str] | None = None) -> Path:
    """Write sweep.parquet, which knows the columns' units, or sweep.csv; returns its path.

    The same rows give the same bytes.
    """
    if find_spec("pyarrow"):
        import pyarrow
        from pyarrow import parquet

        path = folder / FILES[0]
        columns = {name: _column([row[name] for row in table]) for name in table[0]}
        fields = [
            pyarrow.field(name, c.type, metadata={"unit": (units or {}).get(name, "")}) for name, c in columns.items()
        ]
        with replacing(path) as part:
            parquet.write_table(pyarrow.table(list(columns.values()), schema=pyarrow.schema(fields)), part)
        return path
    path = folder / FILES[1]
    with replacing(path) as part, part.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, list(table[0]))
        writer.writeheader()
        writer.writerows(table)
    return path


def _column(values: list[Any]) -> Any:
    """Of one type: a column with numbers of both kinds is one of floats, one of mixed things one of texts."""
    import pyarrow

    kinds = {type(v) for v in values if v is not None}
    if kinds <= {int, float} and float in kinds:
        return pyarrow.array([None if v is None else float(v) for v in values], pyarrow.float64())
    if len(kinds) > 1:
        return pyarrow.array([None if v is None else str(v) for v in values])
    if not kinds:
        return pyarrow.array(values, pyarrow.string())
    return pyarrow.array(values)
