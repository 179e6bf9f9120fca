"""Result files as pandas frames."""

from __future__ import annotations

from collections.abc import Collection
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from ...core.errors import UsageError, install
from . import check_readable, format_of


def frame(path: Path, texts: Collection[str] = (), truths: Collection[str] = ()) -> Any:
    """The record in a file, a column a signal; a file of a run that was killed can be read too.

    texts, truths: columns that hold texts, and such that hold true and false, which not every format tells of itself.
    """
    if find_spec("pandas") is None:
        raise UsageError(f"a frame needs pandas: {install('results')}")
    check_readable(path)
    return format_of(path).read(path, texts, truths)
