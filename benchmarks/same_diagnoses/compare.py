"""Two diagnoses field by field: what differs, to the last digit.

A field is named by its keys and places, joined by "/", for keys have dots in them: `gap/per_channel/arm.x_h/rms_after`,
`causes/0/probability`.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import zip_longest
from pathlib import Path
from typing import Any

Field = tuple[str, ...]

IGNORED: tuple[Field, ...] = (("timing", "wall_s"), ("timing", "first_budget_s"), ("timing", "stages"))
"""Fields, with all that is in them, that are wall times."""

MISSING = "(missing)"

NIL = 1e-9
"""What is smaller is a rest of rounding, such as a probability of 1e-38 or a sum that is 0."""


@dataclass(frozen=True)
class Difference:
    """A field with its two values as text."""

    field: str
    before: str
    after: str

    @property
    def size(self) -> float:
        """Relative to the larger value or to `NIL`; inf where these are no numbers."""
        try:
            a, b = float(self.before), float(self.after)
        except ValueError:
            return math.inf
        return abs(a - b) / max(abs(a), abs(b), NIL) if math.isfinite(a) and math.isfinite(b) and a != b else math.inf


def fields_of(value: Any, where: Field = ()) -> Iterator[tuple[Field, str]]:
    """(field, its value as text) of every value that is no table and no list, or is an empty one."""
    inner: list[tuple[str, Any]] = []
    if isinstance(value, dict):
        inner = [(str(key), v) for key, v in value.items()]
    elif isinstance(value, list):
        inner = [(str(place), v) for place, v in enumerate(value)]
    if not inner:
        yield where, repr(value)  # tells 1 from 1.0 and 0.0 from -0.0, and nan is nan
    for key, v in inner:
        yield from fields_of(v, (*where, key))


def renamed(field: Field, names: Mapping[str, str]) -> Field:
    """The field's name after renaming; `*` stands for one key or place, e.g. {"causes/*/gap_after": "causes/*/left"}.

    The first name that is the field or contains it counts.
    """
    for old, new in names.items():
        pattern = old.split("/")
        head, rest = field[: len(pattern)], field[len(pattern) :]
        if len(head) == len(pattern) and all(p in ("*", key) for p, key in zip(pattern, head, strict=True)):
            stars = iter([key for p, key in zip(pattern, head, strict=True) if p == "*"])
            return (*(next(stars) if p == "*" else p for p in new.split("/")), *rest)
    return field


def diagnosis_differences(before: Any, after: Any, names: Mapping[str, str] | None = None) -> list[Difference]:
    """What differs between the contents of two diagnosis.json; `names` renames fields of the first."""
    old = {renamed(f, names or {}): text for f, text in fields_of(before) if not _ignored(f)}
    new = {f: text for f, text in fields_of(after) if not _ignored(f)}
    return [
        Difference("/".join(f), old.get(f, MISSING), new.get(f, MISSING))
        for f in dict.fromkeys((*old, *new))
        if old.get(f, MISSING) != new.get(f, MISSING)
    ]


def _ignored(field: Field) -> bool:
    return any(field[: len(wall)] == wall for wall in IGNORED)


def text_differences(name: str, before: str, after: str) -> list[Difference]:
    """The lines that differ of a text file of that name."""
    pairs = zip_longest(before.splitlines(), after.splitlines(), fillvalue=MISSING)
    return [Difference(f"{name} line {k}", a, b) for k, (a, b) in enumerate(pairs, 1) if a != b]


def differences(before: Path, after: Path, names: Mapping[str, str] | None = None) -> list[Difference]:
    """What differs between two folders that `cosim-gap diagnose` has written."""
    one, two = (json.loads((side / "diagnosis.json").read_text(encoding="utf-8")) for side in (before, after))
    texts = [(side / "calibrated.ssv").read_text(encoding="utf-8") for side in (before, after)]
    return [*diagnosis_differences(one, two, names), *text_differences("calibrated.ssv", texts[0], texts[1])]
