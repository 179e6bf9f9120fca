"""Numbers as people write them: Python would also take 1_0 for ten, and the digits of other scripts."""

from __future__ import annotations

import re
from math import isinf
from typing import Any

_NUMBER = re.compile(r"[+-]?(?:(?:\d+\.?\d*|\.\d+)(?:e[+-]?\d+)?|inf|infinity|nan)", re.ASCII | re.IGNORECASE)
_WHOLE = re.compile(r"[+-]?\d+", re.ASCII)

TOO_LARGE = "is larger than a number can be"
"""What is said of 1e400, which would be infinite."""

SHOWN = 60
"""Characters of a value in a message."""

LONGEST = 400
"""Digits of a number; one with more is a mistake, or an attack."""


def plain_number(text: str) -> float:
    """The number in a text; `ValueError` for anything else."""
    stripped = text.strip()
    if len(stripped) > LONGEST or _NUMBER.fullmatch(stripped) is None:
        raise ValueError(f"{shown_value(text)} is not a number")
    value = float(stripped)
    if isinf(value) and "inf" not in stripped.lower():
        raise ValueError(f"{shown_value(text)} {TOO_LARGE}")
    return value


def plain_whole(text: str) -> int:
    """The whole number in a text; `ValueError` for anything else."""
    stripped = text.strip()
    if len(stripped) > LONGEST or _WHOLE.fullmatch(stripped) is None:
        raise ValueError(f"{shown_value(text)} is not a whole number")
    return int(stripped)


def shown_value(value: Any) -> str:
    """A value for a message, however long it is."""
    if isinstance(value, str):
        return repr(value if len(value) <= SHOWN else f"{value[: SHOWN - 3]}...")
    try:
        text = repr(value)
    except ValueError:  # a whole number of thousands of digits
        return "a number of thousands of digits"
    return text if len(text) <= SHOWN else f"{text[: SHOWN - 3]}..."
