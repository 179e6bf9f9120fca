"""Arrays on their way: everything that a value passes has as many values, in the same shape."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from ...core.errors import PackageError
from ...ssp.flat_system import Hop
from ...ssp.model import Type


@dataclass(frozen=True)
class Extent:
    """How large something is; its shape is None where only the number of values is known."""

    shown: str
    count: int
    shape: tuple[int, ...] | None = None


def fault(source: Extent, target: Extent) -> str | None:
    """Why a value does not pass from one to the other; sizes of 1 do not make a shape."""
    if source.count != target.count:
        return f"{source.shown} has {source.count} values and {target.shown} {target.count}"
    shapes = [None if x.shape is None else tuple(d for d in x.shape if d != 1) for x in (source, target)]
    if None in shapes or shapes[0] == shapes[1]:
        return None
    first, second = (" x ".join(map(str, x.shape or ())) for x in (source, target))
    return f"{source.shown} is {first} in shape and {target.shown} {second}"


def stated(type: Type | None, shown: str) -> Extent | None:
    """The extent of an array whose sizes the package states."""
    if type is None or type.count is None:
        return None
    return Extent(shown, type.count, tuple(d for d in type.dimensions if isinstance(d, int)))


def check_sizes(source: Extent, hops: Sequence[Hop], target: Extent | None, where: str) -> None:
    """Raise `PackageError` where something on the way, or its end, has another size."""

    def passed() -> Iterator[tuple[Extent | None, str]]:
        for hop in hops:
            yield (stated(hop.type, hop.reached_name) if hop.reached_name else None), hop.where or where
        yield target, where

    for extent, place in passed():
        if extent is not None and (mismatch := fault(source, extent)):
            raise PackageError(f"{place}: {mismatch}")
