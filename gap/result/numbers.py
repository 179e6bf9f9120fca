"""Numbers, units and names as a person reads them."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Sequence
from typing import Any

import numpy as np

_SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
NBSP = "\u00a0"


def short(x: float, digits: int = 3) -> str:
    """A number with that many significant digits."""
    if not np.isfinite(x):
        return "–"
    if x == 0.0:
        return "0"
    x = float(f"{x:.{digits - 1}e}")
    size = int(np.floor(np.log10(abs(x)) + 1e-12))
    if -4 < size < 5:
        return _minus(f"{x:.{max(0, digits - 1 - size)}f}")
    return _minus(f"{x / 10.0**size:.{digits - 1}f}") + f" × 10{str(size).translate(_SUPERSCRIPT)}"


def stated_value(x: object) -> str:
    """A value as somebody stated it, without digits that nobody wrote."""
    if isinstance(x, bool) or not isinstance(x, (int, float)):
        return str(x).lower() if isinstance(x, bool) else str(x)
    text = f"{x:.6g}"
    if "e" in text:
        mantissa, _, power = text.partition("e")
        return _minus(mantissa) + f" × 10{str(int(power)).translate(_SUPERSCRIPT)}"
    return _minus(text)


def with_interval(value: float, ends: Sequence[float]) -> tuple[str, str, str]:
    """A value, its interval "a to b", both with the decimals that the interval deserves, and a factor " × 10ⁿ"."""
    low, high = ends
    most = max(abs(value), abs(low), abs(high))
    if most == 0.0:
        return "0", "0 to 0", ""
    size = int(np.floor(np.log10(most)))
    power = 0 if -4 < size < 5 else size
    width = max(0.5 * (high - low), 1e-12 * most) / 10.0**power
    decimals = int(np.clip(1 - np.floor(np.log10(width)), 0, max(0, 4 - size + power)))
    a, b, c = (_minus(f"{x / 10.0**power:.{decimals}f}") for x in (value, low, high))
    return a, f"{b} to {c}", f" × 10{str(power).translate(_SUPERSCRIPT)}" if power else ""


def quantity(x: float, unit: str, digits: int = 3) -> str:
    """A number with its unit."""
    return f"{short(x, digits)}{NBSP}{pretty(unit)}".rstrip(NBSP)


def change(share: float) -> str:
    """A relative change, with its sign."""
    text = f"{100.0 * share:+.1f}"
    return f"0{NBSP}%" if text in ("+0.0", "-0.0") else f"{_minus(text)}{NBSP}%"


def percent(share: float) -> str:
    """A share; never 0 % or 100 % unless it is."""
    if 0.0 < share < 0.005:
        return f"<1{NBSP}%"
    if 0.995 < share < 1.0:
        return f">99{NBSP}%"
    return _minus(f"{100.0 * share:.0f}") + f"{NBSP}%"


def percents(ends: Sequence[float]) -> str:
    """An interval of shares; one that is narrower than can be written is within a percent."""
    low, high = (_minus(f"{100.0 * x:.0f}") for x in ends)
    return f"±1{NBSP}%" if low == high else f"{low} to {high}{NBSP}%"


def multiple(x: float) -> str:
    """A deviation as a multiple of the noise."""
    return f"{x:.0f}" if x >= 99.95 else f"{x:.1f}" if x >= 9.995 else f"{x:.2f}"


def duration(seconds: float) -> str:
    """A time span in words."""
    if seconds < 100.0:
        return f"{short(seconds, 2)}{NBSP}s"
    if seconds < 6000.0:
        return f"{seconds / 60.0:.1f}{NBSP}min"
    return f"{seconds / 3600.0:.1f}{NBSP}h"


def pretty(unit: str) -> str:
    """A unit with signs instead of letters: m²/s for m2/s; empty for a plain number."""
    if unit == "1":
        return ""
    unit = {"degC": "°C", "deg": "°", "deg/s": "°/s"}.get(unit, unit)
    return re.sub(r"(?<=[A-Za-z])(\d+)", lambda m: m[1].translate(_SUPERSCRIPT), unit).replace(".", "·")


def listed(names: Sequence[str], most: int = 4, word: str = "and") -> str:
    """Names as a sentence has them: a, b and c; the rest only counted."""
    if len(names) > most:
        return f"{', '.join(names[:most])} {word} {len(names) - most} more"
    return f" {word} ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)


_DIRECTION = frozenset("\u061c\u200e\u200f\u202a\u202b\u202c\u202d\u202e\u2066\u2067\u2068\u2069")
"""Characters that turn the direction of what follows them."""


def printable(text: str) -> str:
    """A text without control characters and marks of direction, which can forge what a terminal or a page shows."""
    bad = ("Cc", "Cs", "Zl", "Zp")
    text = " ".join(text.split()) if any(c in text for c in "\n\r\t") else text
    return "".join("\ufffd" if unicodedata.category(c) in bad or c in _DIRECTION else c for c in text)


def cleaned(value: Any) -> Any:
    """JSON values with all their texts, keys too, made printable."""
    if isinstance(value, str):
        return printable(value)
    if isinstance(value, dict):
        return {printable(str(k)): cleaned(v) for k, v in value.items()}
    return [cleaned(v) for v in value] if isinstance(value, (list, tuple)) else value


def _minus(text: str) -> str:
    if text.startswith("-") and not text.strip("-0."):
        text = text[1:]
    return text.replace("-", "−")
