"""What is there twice."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeVar

T = TypeVar("T")


def repeated(items: Sequence[T]) -> T | None:
    """The first of the items that is there more than once, or None."""
    return next((item for item in items if items.count(item) > 1), None)
