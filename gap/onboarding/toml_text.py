"""Values as TOML writes them."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any


def quoted(text: str) -> str:
    """A text in quotes; TOML's basic strings escape as JSON does."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def value(x: Any) -> str:
    """A boolean, number, text, list or table."""
    if isinstance(x, bool):
        return str(x).lower()
    if isinstance(x, str):
        return quoted(x)
    if isinstance(x, Mapping):
        return "{ " + ", ".join(f"{quoted(k)} = {value(v)}" for k, v in x.items()) + " }"
    if isinstance(x, (list, tuple)):
        return "[" + ", ".join(value(v) for v in x) + "]"
    return str(x) if hasattr(x, "isoformat") else repr(x)


def with_comment(line: str, comment: str) -> str:
    """A line with a comment behind it, where others have theirs."""
    return f"{line:<39} # {comment}" if comment else line
