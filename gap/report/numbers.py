"""Numbers and units as a person reads them."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from ...core.units import convert, unit
from ..campaign.campaign import si

_SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


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


def given(x: object) -> str:
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


def change(share: float) -> str:
    """A relative change, with its sign."""
    text = f"{100.0 * share:+.1f}"
    return "0%" if text in ("+0.0", "-0.0") else _minus(text) + "%"


def percent(share: float) -> str:
    """A share; never 0% or 100% unless it is."""
    if 0.0 < share < 0.01:
        return "<1%"
    if 0.99 < share < 1.0:
        return ">99%"
    return f"{share:.0%}".replace("-", "−")


def floors(x: float) -> str:
    """A gap in noise floors."""
    return f"{x:.0f}" if x >= 99.95 else f"{x:.1f}" if x >= 9.995 else f"{x:.2f}"


def duration(seconds: float) -> str:
    """A time span in words."""
    if seconds < 100.0:
        return f"{short(seconds, 2)} s"
    if seconds < 6000.0:
        return f"{seconds / 60.0:.1f} min"
    return f"{seconds / 3600.0:.1f} h"


def pretty(name: str) -> str:
    """A unit with signs instead of letters: m²/s for m2/s; empty for a plain number."""
    if name == "1":
        return ""
    name = {"degC": "°C", "deg": "°", "deg/s": "°/s"}.get(name, name)
    return re.sub(r"(?<=[A-Za-z])(\d+)", lambda m: m[1].translate(_SUPERSCRIPT), name).replace(".", "·")


class Shown:
    """Values of a quantity in the unit in which it was measured; own: the unit of the FMU's variable, if it has one."""

    def __init__(self, measured: str, own: str | None):
        self.unit = pretty(measured)
        self._from = own if own is not None else si(measured)
        self._to = measured

    def value(self, x: np.ndarray) -> np.ndarray:
        """Readings."""
        return convert(x, self._from, self._to)

    def difference(self, x):
        """Differences of readings."""
        return x * (unit(self._from).factor / unit(self._to).factor)


def _minus(text: str) -> str:
    if text.startswith("-") and not text.strip("-0."):
        text = text[1:]
    return text.replace("-", "−")
