"""Numbers as people write them: Python would also take 1_0 for ten, and the digits of other scripts."""

from __future__ import annotations

import re
from math import isinf

_NUMBER = re.compile(r"[+-]?(?:(?:\d+\.?\d*|\.\d+)(?:e[+-]?\d+)?|inf|infinity|nan)", re.ASCII | re.IGNORECASE)
_WHOLE = re.compile(r"[+-]?\d+", re.ASCII)

TOO_LARGE = "is larger than a number can be"
"""What is said of 1e400, which would be infinite."""

LONGEST = 400
"""Digits of a number; one with more is a mistake, or an attack."""


def plain_number(text: str) -> float:
    """The number in a text; `ValueError` for anything else."""
    stripped = text.strip()
    if len(stripped) > LONGEST or _NUMBER.fullmatch(stripped) is None:
        raise ValueError(f"{shown(text)} is not a number")
    value = float(stripped)
    if isinf(value) and "inf" not in stripped.lower():
        raise ValueError(f"{shown(text)} {TOO_LARGE}")
    return value


def plain_whole(text: str) -> int:
    """The whole number in a text; `ValueError` for anything else."""
    stripped = text.strip()
    if len(stripped) > LONGEST or _WHOLE.fullmatch(stripped) is None:
        raise ValueError(f"{shown(text)} is not a whole number")
    return int(stripped)


def shown(text: str) -> str:
    """A text for a message."""
    return repr(text if len(text) <= 60 else f"{text[:57]}...")
