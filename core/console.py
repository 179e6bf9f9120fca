"""What a command says in the end: lines for people or, with --json, one object for programs."""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Iterable, Mapping
from math import isfinite
from pathlib import Path
from typing import Any


def add_output(p: argparse.ArgumentParser, quiet: bool = True) -> None:
    """The options that say how much of what a command has to say is printed, and in which form."""
    if quiet:
        p.add_argument("--quiet", action="store_true", help="print nothing but errors")
    p.add_argument(
        "--json", action="store_true",
        help="print one JSON object instead of text, also where it failed: {\"error\": ..., \"exit_code\": ...}",
    )  # fmt: skip


def conclude(
    options: argparse.Namespace, content: Callable[[], Mapping[str, Any]], lines: Callable[[], Iterable[str]]
) -> None:
    """Print what came of a command: `content` with --json, else `lines`, nothing with --quiet."""
    if options.json:
        print(json_text(content()))
    elif not getattr(options, "quiet", False):
        for line in lines():
            print(line)


def on_the_way(options: argparse.Namespace) -> Callable[[str], None]:
    """What prints a line while a command works, on standard output: nothing with --quiet or --json."""
    if options.json or getattr(options, "quiet", False):
        return lambda text: None
    return lambda text: print(f"  {text}", flush=True)


def json_text(value: Any) -> str:
    """Strict JSON of a value of mappings, lists, paths and numbers."""
    return json.dumps(plain(value), indent=1, allow_nan=False)


def plain(value: Any) -> Any:
    """For JSON: numbers that are none become null, paths texts, arrays and numbers of numpy Python's."""
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    if isinstance(value, Path):
        return str(value)
    if hasattr(value, "tolist"):
        return plain(value.tolist())
    return None if isinstance(value, float) and not isfinite(value) else value
