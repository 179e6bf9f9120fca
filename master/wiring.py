"""What a value meets on its way from one variable to another: units, transformations, enumerations, types.

The package says it hop by hop (`ssp.network`), the FMUs give types and units at the ends. Here both become one factor
and offset, or one table.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeVar

from ..core.errors import PackageError, ParameterError, UsageError
from ..core.units import Unit, alike, conversion
from ..ssp.model import FLOATS, Linear, Scalar, Table, Value
from ..ssp.network import Hop
from .engine.program import Cast
from .slaves.base import INTEGER, REAL, TEXT

T = TypeVar("T")

FAMILY = {"String": TEXT, "Binary": TEXT, **dict.fromkeys(FLOATS, REAL)}
"""Family of the types of SSP; all others are integers."""


@dataclass(frozen=True)
class Quantity:
    """What is known of a value at one end: its FMI or SSP type, unit and items."""

    type: str
    unit: Unit | None = None
    items: dict[str, int] | None = None
    shown: str = ""
    relative: bool = False
    """A difference: its unit's offset does not count (FMI `relativeQuantity`)."""

    @property
    def family(self) -> str:
        """real, integer or text."""
        return FAMILY.get(self.type, INTEGER)


@dataclass(frozen=True)
class Passage:
    """The way as steps that can be applied to a number: (factor, offset) or a table."""

    steps: tuple[tuple[float, float] | dict[int, int], ...] = ()
    remarks: tuple[str, ...] = ()

    def cast(self, source: Quantity, target: Quantity, where: str) -> Cast:
        """As one operation of the engine."""
        tables = [s for s in self.steps if isinstance(s, dict)]
        if not tables:
            factor, offset = self._line()
            from_integer = source.family == INTEGER and target.family == REAL
            if source.family == INTEGER and target.family == INTEGER and (factor, offset) != (1.0, 0.0):
                raise PackageError(f"{where}: {source.shown} is {source.type}: it cannot be scaled")
            return Cast(factor, offset, None, from_integer, (source.type == "UInt64") != (target.type == "UInt64"))
        if len(tables) < len(self.steps):
            raise PackageError(f"{where}: {source.shown} is {source.type}: it cannot be scaled and mapped")
        joined = {key: self.apply(key) for table in tables for key in table}
        return Cast(1.0, 0.0, tuple((int(k), int(v)) for k, v in joined.items()))

    def _line(self) -> tuple[float, float]:
        factor, offset = 1.0, 0.0
        for step in self.steps:
            assert not isinstance(step, dict)
            factor, offset = step[0] * factor, step[0] * offset + step[1]
        return factor, offset

    def apply(self, value: Scalar) -> Scalar:
        """The value at the end; a table keeps what it does not have."""
        for step in self.steps:
            if isinstance(step, dict):
                value = step.get(int(value), value)
            elif step != (1.0, 0.0):
                value = step[0] * float(value) + step[1]
        return value


def _ahead(hops: Sequence[Hop], told: Callable[[Hop], T | None], end: T | None) -> T | None:
    """What a connector that does not say it has from what it leads to, as long as the value passes on as it is."""
    for k, hop in enumerate(hops):
        if k > 0 and (hop.transformation is not None or hop.suppress_unit_conversion):
            return None
        if found := told(hop):
            return found
    return end


def passage(source: Quantity, hops: Sequence[Hop], target: Quantity, where: str, strict: bool = True) -> Passage:
    """The way of a value. Raises `PackageError` for units or, if strict, types that do not fit."""
    if strict:
        _check_types(source, target, where)
    steps: list[tuple[float, float] | dict[int, int]] = []
    remarks: list[str] = []
    unit, items = source.unit, source.items
    for i, hop in enumerate(hops):
        last = i == len(hops) - 1
        looks = last or isinstance(hop.transformation, Linear)
        reached = _ahead(hops[i:], lambda h: h.unit, target.unit) if looks else hop.unit
        if reached is not None and not reached.defined:  # a name only: as the ends define it
            reached = next((u for u in (target.unit, source.unit) if u is not None and u.name == reached.name), reached)
        looks = last or hop.transformation is not None
        there = _ahead(hops[i:], lambda h: h.enumeration, target.items) if looks else hop.enumeration
        told = hop.unit is not None and target.unit is not None and hop.unit.name != target.unit.name
        if last and told and not alike(hop.unit, target.unit):
            remarks.append(
                f"{hop.where or where}: the package says {target.shown} is in {hop.unit.name}, its FMU says "
                f"{target.unit.name}; the package's word counts"
            )
        if not hop.suppress_unit_conversion and unit is not None and reached is not None:
            shown = f"{hop.where or where}: {source.shown} -> {target.shown}"
            if unit.name != reached.name:
                try:
                    line = conversion(unit, reached)
                except UsageError as error:
                    raise PackageError(f"{shown}: {error}") from None
                if source.relative or target.relative:
                    line = line[0], 0.0
                if line != (1.0, 0.0):
                    steps.append(line)
            elif not alike(unit, reached):
                remarks.append(f"{shown}: unit '{unit.name}' is defined in two ways; the value is passed on as it is")
        if reached is not None or hop.suppress_unit_conversion:
            unit = reached
        steps += _transformation(hop, items, there, source, target, where)
        items = there or items
    if strict and not any(isinstance(s, dict) for s in steps):
        _check_items(source, target, where)
    return Passage(tuple(steps), tuple(remarks))


def _transformation(
    hop: Hop, items: dict[str, int] | None, there: dict[str, int] | None, source: Quantity, target: Quantity, where: str
) -> list[tuple[float, float] | dict[int, int]]:
    t = hop.transformation
    place = hop.where or where
    if t is None:
        return []
    if isinstance(t, Linear):
        if target.family != REAL:
            raise PackageError(f"{place}: a linear transformation needs real numbers; {target.shown} is {target.type}")
        return [(t.factor, t.offset)] if (t.factor, t.offset) != (1.0, 0.0) else []
    assert isinstance(t, Table)
    if source.family != INTEGER or target.family != INTEGER:
        raise PackageError(
            f"{place}: a mapping of {t.kind} values does not fit {source.shown} ({source.type}) -> {target.shown} "
            f"({target.type})"
        )
    if t.kind == "Boolean" and "Boolean" not in (source.type, target.type):
        raise PackageError(f"{place}: a boolean mapping needs a boolean; {source.shown} is {source.type}")
    if t.kind != "Enumeration":
        return [{int(k): int(v) for k, v in t.entries.items()}]
    made = {}
    for key, value in t.entries.items():
        for name, known, which in ((key, items, source), (value, there, target)):
            if known is None:
                raise PackageError(f"{place}: the items of {which.shown} are not known, so '{name}' cannot be mapped")
            if name not in known:
                raise PackageError(f"{place}: {which.shown} has no item '{name}'; it has {', '.join(known)}")
        assert items is not None
        assert there is not None
        made[items[str(key)]] = there[str(value)]
    for name, number in (items or {}).items():  # what is not mapped keeps its name
        if name not in t.entries:
            if there is None or name not in there:
                raise PackageError(f"{place}: {target.shown} has no item '{name}', which {source.shown} has unmapped")
            made[number] = there[name]
    return [made]


def _check_types(source: Quantity, target: Quantity, where: str) -> None:
    a, b = source, target
    fits = a.family == b.family or (a.family == INTEGER and b.family == REAL and a.type != "Boolean")
    if a.family == b.family == TEXT:
        fits = a.type == b.type
    if a.family == b.family == INTEGER:
        fits = (a.type == "Boolean") == (b.type == "Boolean")
    if not fits:
        raise PackageError(f"{where}: {a.shown} is {a.type}, {b.shown} is {b.type}: these types do not fit together")


def _check_items(source: Quantity, target: Quantity, where: str) -> None:
    if source.items is None or target.items is None or source.items == target.items:
        return
    there = {v: k for k, v in target.items.items()}
    for name, value in source.items.items():
        if there.get(value) != name:
            raise PackageError(
                f"{where}: item '{name}' ({value}) of {source.shown} is "
                f"{repr(there[value]) if value in there else 'missing'} in {target.shown}; give an "
                "EnumerationMappingTransformation"
            )


def converted(
    value: Value, source: Quantity, hops: Sequence[Hop], target: Quantity, where: str,
    remark: Callable[[str], None] = lambda _: None,
) -> Value:  # fmt: skip
    """A parameter's value as it reaches a variable; `remark` is told of units that are defined in two ways."""
    if source.type == "Enumeration" and isinstance(value, str):
        return _item(value, source, hops, target, where)
    if target.family == TEXT or source.family == TEXT:
        if any(h.transformation is not None for h in hops):
            raise ParameterError(f"{where}: the value of {target.shown} cannot be transformed: it is {target.type}")
        if source.family != target.family:
            if target.items is not None and value in target.items:
                return target.items[value]
            raise ParameterError(f"{where}: the value is {source.type}, {target.shown} is {target.type}")
        return value
    if isinstance(value, tuple) and any(isinstance(v, str) for v in value) and source.type == "Enumeration":
        return tuple(_item(v, source, hops, target, where) if isinstance(v, str) else v for v in value)
    if source.type == "Boolean" and any(isinstance(h.transformation, Linear) for h in hops):
        raise ParameterError(f"{where}: the value of {target.shown} is a boolean and cannot be scaled")
    if (source.type == "Boolean") != (target.type == "Boolean"):
        raise ParameterError(f"{where}: the value is {source.type}, {target.shown} is {target.type}")
    way = passage(source, hops or (Hop(where=where),), target, where, strict=False)
    for text in way.remarks:
        remark(text)
    values = value if isinstance(value, tuple) else (value,)
    made = []
    for v in values:
        reached = way.apply(v)
        made.append(bool(reached) if isinstance(v, bool) else reached)
    return tuple(made) if isinstance(value, tuple) else made[0]


def _item(value: str, source: Quantity, hops: Sequence[Hop], target: Quantity, where: str) -> Scalar:
    """An enumeration's item by name: mapped by name or number where a mapping is given, else the target's of that name.

    Which number a name has is what the parameter says, else the connectors on the way, else the target.
    """
    items, number = source.items, None
    for i, hop in enumerate(hops):
        t, place = hop.transformation, hop.where or where
        items = items or _ahead(hops[i:], lambda h: h.enumeration, target.items)
        if t is None:
            if number is None and hop.enumeration and value in hop.enumeration:
                items = hop.enumeration
            continue
        if not isinstance(t, Table) or t.kind == "Boolean":
            what = "scaled" if isinstance(t, Linear) else "mapped as a boolean"
            raise ParameterError(f"{place}: the item '{value}' for {target.shown} cannot be {what}")
        if t.kind == "Enumeration":
            if number is not None:
                value = next((name for name, k in (items or {}).items() if k == number), value)
            value, number = str(t.entries.get(value, value)), None
        else:
            if number is None and (items is None or value not in items):
                known = f"; known: {', '.join(items)}" if items else ""
                raise ParameterError(f"{place}: the number of the item '{value}' is not known{known}")
            number = items[value] if number is None else number  # type: ignore[index]
            number = int(t.entries.get(number, number))
        items = hop.enumeration
    if number is not None:
        return number
    if target.items is not None and value in target.items:
        return target.items[value]
    if target.family == TEXT:
        return value
    if target.items is None and source.items and value in source.items:
        return source.items[value]
    known = f"; it has {', '.join(target.items)}" if target.items else ""
    raise ParameterError(f"{where}: {target.shown} has no item '{value}'{known}")
