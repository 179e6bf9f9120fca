"""Result files as pandas frames."""

from __future__ import annotations

import warnings
from collections.abc import Collection
from pathlib import Path
from typing import Any

from ...core.errors import UsageError, install
from . import SUFFIXES


def frame(path: Path, texts: Collection[str] = (), truths: Collection[str] = ()) -> Any:
    """The record in a file, a column a signal; a file of a run that was killed can be read too.

    texts, truths: columns that hold texts, and such that hold true and false. A table in CSV does not tell that of
    itself: 007 would be read as a number, and what is true stands there as 1.
    """
    try:
        import pandas
    except ImportError:
        raise UsageError(f"a frame needs pandas: {install('results')}") from None
    kind = SUFFIXES.get(path.suffix.lower())
    if kind == "parquet":
        return pandas.read_parquet(path)
    if kind == "hdf5":
        import h5py

        with h5py.File(path, "r", locking=False) as file:
            columns = {
                name.replace("\\", "/"): (d if h5py.check_string_dtype(d.dtype) is None else d.asstr())[()]
                for name, d in file.items()
            }
        length = min(len(c) for c in columns.values())
        return pandas.DataFrame({name: c[:length] for name, c in columns.items()})
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the exact reading of decimals is the default of some versions only
        names = pandas.read_csv(path, nrows=0).columns
        made = pandas.read_csv(
            path, float_precision="round_trip", dtype={name: str for name in names if name in texts},
            keep_default_na=False, na_values={name: ["nan"] for name in names if name not in texts},
        )  # fmt: skip
    return made.astype(dict.fromkeys(truths, bool))
