"""Numbers by name in one row of float64: kernels read `c.valve.k_q` where Python and files have 'valve.k_q'.

A record is a numpy dtype of fields that are numbers, short arrays or records again; every number takes eight bytes, so
that a row of it is an array of float64, too, which C code, files and copies need.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import lru_cache

import numpy as np

WIDTH = 8
"""Bytes of a number."""


def record(names: Iterable[str]) -> np.dtype:
    """The record of numbers by dotted names; 'valve.curve[10]' is an array of ten.

    Raises `ValueError` for a field that Python would take for something of numpy's ('T', 'size').
    """
    rooms: dict[str, list[str]] = {}
    for name in names:
        room, _, rest = name.partition(".")
        rooms.setdefault(room, []).append(rest)
    fields: list[tuple[str, object] | tuple[str, str, tuple[int, ...]]] = []
    for room, inside in rooms.items():
        label, _, length = room.rstrip("]").partition("[")
        if hasattr(np.void, label):
            raise ValueError(f"field '{label}' of {sorted(rooms)}: numpy has something of that name")
        if inside != [""]:
            fields.append((room, record(inside)))
        else:
            fields.append((label, "f8", (int(length),)) if length else (label, "f8"))
    return np.dtype((np.record, fields))


def size_of(kind: np.dtype) -> int:
    """How many numbers a record has."""
    return kind.itemsize // WIDTH


def places(kind: np.dtype, before: str = "", first: int = 0) -> dict[str, slice]:
    """Where each number or array stands in a row of a record, by dotted name."""
    made: dict[str, slice] = {}
    for name, (inner, offset, *_) in (kind.fields or {}).items():
        at = first + offset // WIDTH
        if inner.fields is not None:
            made |= places(inner, f"{before}{name}.", at)
        else:
            made[f"{before}{name}"] = slice(at, at + size_of(inner))
    return made


_places = lru_cache(places)


def row_of(kind: np.dtype, values: Mapping[str, float | Sequence[float]]) -> np.ndarray:
    """A row (`size_of`,) of a record with these values by dotted name; every one of its fields has to be there."""
    row = np.empty(size_of(kind))
    for name, at in _places(kind).items():
        row[at] = values[name]
    return row
