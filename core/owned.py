"""Whose results a folder holds: a command replaces what it has made itself, and nothing else."""

from __future__ import annotations

import json
from collections.abc import Collection
from pathlib import Path
from typing import Any

from .errors import OutputError
from .regular import require_regular


def read_object(file: Path) -> dict[str, Any]:
    """The object in a file of JSON; an empty one where there is none, whatever stands there."""
    try:
        require_regular(file, OutputError)
        content = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, OutputError, ValueError, RecursionError):
        return {}
    return content if isinstance(content, dict) else {}


def refuse_others(folder: Path, names: Collection[str], maker: str) -> None:
    """Raise `OutputError` where one of the files is in the folder, which `maker` ("a run") has not made."""
    for name in names:
        if (folder / name).exists() or (folder / name).is_symlink():
            raise OutputError(f"{folder}: holds '{name}', which {maker} has not left there; --out names another folder")
