"""Rows of plain numbers, many at once: what a logger writes is read fifty times as fast so as cell by cell."""

from __future__ import annotations

import re

import numpy as np
import orjson

from ..settings import FILE_LIMITS
from .table import FloatArray

_PLAIN = re.compile(r"[0-9eE+\-., ;\t\r\n]*")


def plain_rows(lines: list[str], width: int, delimiter: str, decimal: str | None) -> FloatArray | None:
    """The numbers (n, width) in lines of a file, NaN in empty cells; None where they have to be read cell by cell.

    decimal: the mark before a fraction, None where none has been seen yet.
    """
    text = "".join(lines)
    if delimiter not in ",;\t" or _PLAIN.fullmatch(text) is None:
        return None
    if decimal == "," and (delimiter == "," or "." in text):
        return None
    if decimal != "," and delimiter != "," and "," in text:
        return None
    if decimal is None and "." in text:
        return None
    if decimal == ",":
        text = text.replace(",", ".")
    rows = text.replace(delimiter, ",").replace("\r\n", "\n").rstrip("\n").replace("\n", "],[")
    rows = f"[[{rows}]]".replace(",,", ",null,").replace(",,", ",null,").replace("[,", "[null,").replace(",]", ",null]")
    try:
        data = np.array(orjson.loads(rows), dtype=float)
    except (ValueError, TypeError):  # a number that JSON writes otherwise, or rows of several widths
        return None
    if data.ndim != 2 or data.shape[1] != width or len(data) != len(lines):
        return None
    return data if not np.any(np.abs(data) > FILE_LIMITS.largest_quantity) else None
