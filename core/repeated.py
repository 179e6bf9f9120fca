"""What is there twice."""

from __future__ import annotations

from collections import Counter
from collections.abc import Hashable, Sequence
from typing import TypeVar

T = TypeVar("T", bound=Hashable)


def repeated(items: Sequence[T]) -> T | None:
    """The first of the items that is there more than once, or None."""
    counts = Counter(items)
    return next((item for item in items if counts[item] > 1), None)
