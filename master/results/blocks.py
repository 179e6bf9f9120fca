"""Result files some thousand rows at a time, without pandas: what pages and comparisons read."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from ...core.errors import UsageError, install
from . import by_suffix, check_readable
from .format import Block


def blocks(path: Path, texts: Collection[str] = ()) -> Iterator[Block]:
    """Columns of the rows of a file, block by block; of a run that was killed, too.

    texts: columns that hold texts, which CSV does not tell of itself. Raises `UsageError` for what is no result file.
    """
    format = by_suffix().get(path.suffix.lower())
    if format is None:
        raise UsageError(f"{path}: no result file (these end in {', '.join(by_suffix())})")
    for module in format.needs:
        if find_spec(module) is None:
            raise UsageError(f"{path}: {path.suffix} files need {module}: {install('results')}")
    check_readable(path)
    try:
        if format.blocks is not None:
            yield from format.blocks(path, texts)
            return
        frame = format.read(path, texts, ())
    except OSError as error:
        raise UsageError(f"{path}: cannot be read ({error.strerror or error})") from None
    yield {str(name): _column(frame[name].to_numpy()) for name in frame}


def _column(values: np.ndarray) -> np.ndarray | list[str]:
    return [str(v) for v in values] if values.dtype == object else values


def whole(path: Path, texts: Collection[str] = ()) -> dict[str, np.ndarray | list[str]]:
    """All rows of a file; columns of numbers as float64 (n,). A column that is text anywhere is text everywhere."""
    parts: dict[str, list[np.ndarray | list[str]]] = {}
    for block in blocks(path, texts):
        for name, values in block.items():
            parts.setdefault(name, []).append(values)
    return {name: _joined(found) for name, found in parts.items()}


def _joined(found: list[np.ndarray | list[str]]) -> np.ndarray | list[str]:
    if any(isinstance(part, list) for part in found):
        return [str(v) for part in found for v in part]
    return np.concatenate([np.asarray(part, float) for part in found])
