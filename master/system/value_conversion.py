"""What a value meets on its way from one variable to another: units, transformations, enumerations, types.

The package says it hop by hop (`ssp.flatten`), the FMUs give types and units at the ends. Here both become one factor
and offset, or one table.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from math import isfinite
from typing import TypeVar

from ...core.errors import PackageError, ParameterError, UsageError
from ...core.plain_numbers import plain_number
from ...core.units import Unit, alike, conversion
from ...ssp.flat_system import Hop
from ...ssp.model import FLOATS, Linear, Scalar, Table, Value
from ..engine.program import Mapped, SlotConversion, Within
from ..engine.values import INTEGER, LIMITS, REAL, TEXT, in_slot
from .sizes import Extent, check_sizes

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


Step = tuple[float, float] | dict[int, int]
"""(factor, offset), or a table of whole numbers."""


@dataclass(frozen=True)
class Stage:
    """A part of the way: what happens to the value, and what takes it then."""

    steps: tuple[Step, ...] = ()
    reached: Quantity | None = None
    """A connector of a system or an entry of a signal dictionary, where its type is given."""


@dataclass(frozen=True)
class ValueConversion:
    """The way of a value, which can be applied to a number."""

    stages: tuple[Stage, ...] = ()
    remarks: tuple[str, ...] = ()

    def over_slots(self, source: Quantity, target: Quantity, where: str) -> SlotConversion:
        """As one operation of the engine."""
        factor, offset = 1.0, 0.0
        whole: list[Within | Mapped] = []
        current, have = source, values_of(source)
        for stage in (*self.stages, Stage(reached=target)):
            for step in stage.steps:
                if isinstance(step, dict):
                    whole.append(Mapped(tuple((in_slot(k), in_slot(v)) for k, v in step.items())))
                    have = _mapped(have, step)
                else:
                    factor, offset = step[0] * factor, step[0] * offset + step[1]
            at = stage.reached
            if at is None or current.family != INTEGER:
                continue
            if at.family == INTEGER and (factor, offset) != (1.0, 0.0):
                raise PackageError(f"{where}: {source.shown} is {source.type}: it cannot be scaled")
            whole += _guard(current, have, at, at is target)
            current, have = at, values_of(at)
        return SlotConversion(factor, offset, tuple(whole), source.family == INTEGER and target.family == REAL)

    def apply(self, value: Scalar, check: Callable[[Scalar, Quantity], None] = lambda _value, _at: None) -> Scalar:
        """The value at the end; a table keeps what it does not have. `check` is told of what takes it on the way."""
        for stage in self.stages:
            for step in stage.steps:
                if isinstance(step, dict):
                    value = step.get(int(value), value)
                elif step != (1.0, 0.0):
                    value = step[0] * float(value) + step[1]
            if stage.reached is not None:
                check(value, stage.reached)
        return value


def values_of(quantity: Quantity) -> range | frozenset[int]:
    """The whole numbers that are values of a quantity."""
    if quantity.type == "Boolean":
        return frozenset((0, 1))
    if quantity.items:
        return frozenset(quantity.items.values())
    low, high = LIMITS.get(quantity.type, LIMITS["Int64"])
    return range(low, high + 1)


def _mapped(have: range | frozenset[int], table: dict[int, int]) -> range | frozenset[int]:
    """What a table makes of values; of a range no less than the range."""
    if isinstance(have, frozenset):
        return frozenset(table.get(v, v) for v in have)
    targets = [int(v) for v in table.values()]
    return range(min(have.start, *targets), max(have.stop, *(v + 1 for v in targets)))


def _guard(current: Quantity, have: range | frozenset[int], at: Quantity, is_end: bool) -> Iterator[Within | Mapped]:
    """What keeps values away that are none of what takes them; at the end the FMI call does so for narrow types.

    UInt64 lies in the same 64 bits as the others, which agree where the first of them is 0.
    """
    may = values_of(at) if at.family == INTEGER else LIMITS_OF_SLOTS
    if (current.type == "UInt64") != (at.type == "UInt64"):
        may = may if isinstance(may, frozenset) else range(max(may.start, 0), min(may.stop, LIMITS_OF_SLOTS.stop))
        have = have if isinstance(have, frozenset) else LIMITS_OF_SLOTS
    elif is_end and isinstance(may, range) and at.type not in ("Int64", "UInt64"):
        return
    if isinstance(may, frozenset):
        if isinstance(have, range) or not have <= may:
            yield Mapped(tuple((v, v) for v in sorted(may)), strict=True)
    elif not all(v in may for v in (have if isinstance(have, frozenset) else (have.start, have.stop - 1))):
        yield Within(may.start, may.stop - 1)


LIMITS_OF_SLOTS = range(LIMITS["Int64"][0], LIMITS["Int64"][1] + 1)
"""What the engine keeps of whole numbers."""


def _ahead(hops: Sequence[Hop], of_hop: Callable[[Hop], T | None], end: T | None) -> T | None:
    """What a connector that does not say it has from what it leads to, as long as the value passes on as it is."""
    for k, hop in enumerate(hops):
        if k > 0 and (hop.transformation is not None or hop.suppress_unit_conversion):
            return None
        if stated := of_hop(hop):
            return stated
    return end


def value_conversion(
    source: Quantity, hops: Sequence[Hop], target: Quantity, where: str, strict: bool = True
) -> ValueConversion:
    """The way of a value. Raises `PackageError` for units or, if strict, types that do not fit."""
    stages: list[Stage] = []
    remarks: list[str] = []
    unit, current = source.unit, source
    for i, hop in enumerate(hops):
        last, place = i == len(hops) - 1, hop.where or where
        looks = last or hop.transformation is not None
        items = _ahead(hops[i:], lambda h: h.enumeration, target.items) if looks else hop.enumeration
        reached = _unit_reached(hops[i:], source, target)
        if last:
            remarks += _contradicted(hop, target, place)
        if _shifts_in_doubt(hop, unit, reached, target):
            assert unit is not None
            remarks.append(
                f"{place}: {hop.reached_name} does not say its unit, nor does what it leads to at once; the "
                f"transformation's offset is taken to be in {unit.name}"
            )
        steps: list[Step] = []
        if not hop.suppress_unit_conversion and unit is not None and reached is not None:
            shown = f"{place}: {source.shown} -> {target.shown}"
            steps += _between_units(unit, reached, source.relative or target.relative, shown)
            if unit.name == reached.name and not alike(unit, reached):
                remarks.append(f"{shown}: unit '{unit.name}' is defined in two ways; the value is passed on as it is")
        if reached is not None or hop.suppress_unit_conversion:
            unit = reached
        at = quantity_at(hop)
        takes = at or (target if last else replace(current, shown=target.shown))
        steps += _transformation(hop, current, replace(takes, items=items), target, place)
        current = _transformed(current, hop, items)
        if strict and at is not None:
            _check(current, at, place, named=not isinstance(hop.transformation, Table))
        if at is not None:
            kept_items = current.items if at.type == "Enumeration" else None
            at = current = replace(at, items=items or kept_items)
        elif not last:
            current = replace(current, items=items or current.items)
        stages.append(Stage(tuple(steps), at))
    if strict:
        named = not hops or not isinstance(hops[-1].transformation, Table)
        _check(current if current.family != TEXT or len(hops) > 1 else source, target, where, named)
    return ValueConversion(tuple(stages), tuple(remarks))


def _unit_reached(hops: Sequence[Hop], source: Quantity, target: Quantity) -> Unit | None:
    """The unit of what the first of the hops that are left reaches, if that is known."""
    hop = hops[0]
    looks = len(hops) == 1 or isinstance(hop.transformation, Linear)
    reached = _ahead(hops, lambda h: h.unit, target.unit) if looks else hop.unit
    if reached is not None and not reached.defined:  # a name only: as the ends define it
        reached = next((u for u in (target.unit, source.unit) if u is not None and u.name == reached.name), reached)
    return reached


def _contradicted(hop: Hop, target: Quantity, where: str) -> list[str]:
    """What to remark where package and FMU say different units of the end."""
    stated, fmu = hop.unit, target.unit
    if stated is None or fmu is None or stated.name == fmu.name or alike(stated, fmu):
        return []
    return [
        f"{where}: the package says {target.shown} is in {stated.name}, its FMU says {fmu.name}; the package's word "
        "counts"
    ]


def _between_units(unit: Unit, reached: Unit, relative: bool, shown: str) -> list[Step]:
    """The step from one unit to another, if it is one; of a relative quantity the offset does not count."""
    if unit.name == reached.name:
        return []
    try:
        factor, offset = conversion(unit, reached)
    except UsageError as error:
        raise PackageError(f"{shown}: {error}") from None
    line = factor, 0.0 if relative else offset
    return [line] if line != (1.0, 0.0) else []


def _transformed(current: Quantity, hop: Hop, items: dict[str, int] | None) -> Quantity:
    """What is known of a value behind a hop's transformation."""
    if isinstance(hop.transformation, Linear) and current.type != "Boolean":
        return replace(current, type="Real")
    if isinstance(hop.transformation, Table):
        return replace(current, items=items or current.items)
    return current


def _shifts_in_doubt(hop: Hop, unit: Unit | None, reached: Unit | None, target: Quantity) -> bool:
    """Whether an offset is added on the way from one unit to another where the one between them is not known."""
    if not isinstance(hop.transformation, Linear) or not hop.transformation.offset or hop.suppress_unit_conversion:
        return False
    if reached is not None or unit is None or target.unit is None:
        return False
    return unit.name != target.unit.name and not alike(unit, target.unit)


def quantity_at(hop: Hop) -> Quantity | None:
    """What a hop reaches, if that is a connector of a system or an entry of a dictionary and its type is given."""
    if not hop.reached_name or hop.type is None:
        return None
    return Quantity(hop.type.kind, hop.type.unit, hop.type.enumeration, hop.reached_name)


def _transformation(hop: Hop, source: Quantity, takes: Quantity, target: Quantity, where: str) -> list[Step]:
    """The steps of a hop's transformation from what lies before it to what takes the value; `target` is the end."""
    t = hop.transformation
    if t is None:
        return []
    if isinstance(t, Linear):
        whole = next((q for q in (takes, target) if q.family != REAL), None) if quantity_at(hop) else (
            target if target.family != REAL else None)  # fmt: skip
        if whole is not None:
            raise PackageError(f"{where}: a linear transformation needs real numbers; {whole.shown} is {whole.type}")
        return [(t.factor, t.offset)] if (t.factor, t.offset) != (1.0, 0.0) else []
    assert isinstance(t, Table)
    if source.family != INTEGER or takes.family != INTEGER:
        raise PackageError(
            f"{where}: a mapping of {t.kind} values does not fit {source.shown} ({source.type}) -> {takes.shown} "
            f"({takes.type})"
        )
    if t.kind == "Boolean" and "Boolean" not in (source.type, takes.type):
        raise PackageError(f"{where}: a boolean mapping needs a boolean; {source.shown} is {source.type}")
    if t.kind != "Enumeration":
        may, (low, high) = values_of(takes), LIMITS.get(source.type, LIMITS["Int64"])
        table = {int(k): int(v) for k, v in t.entries.items() if low <= int(k) <= high}  # others are ignored (SSP)
        if source.type != "UInt64" and (large := next((v for v in table.values() if v >= 2**63), None)):
            raise PackageError(f"{where}: {large} needs a UInt64, {source.shown} is {source.type}")
        if (wrong := next((v for v in table.values() if v not in may), None)) is not None:
            items_text = f"; it has {', '.join(f'{n} ({k})' for n, k in takes.items.items())}" if takes.items else ""
            raise PackageError(f"{where}: {wrong} is not a value of {takes.shown}, which is {takes.type}{items_text}")
        return [table] if table else []
    table = {}
    items, target_items = source.items, takes.items
    for key, value in t.entries.items():
        for name, known_items, side in ((key, items, source), (value, target_items, takes)):
            if known_items is None:
                raise PackageError(f"{where}: the items of {side.shown} are not known, so '{name!s}' cannot be mapped")
            if name not in known_items:
                raise PackageError(f"{where}: {side.shown} has no item '{name!s}'; it has {', '.join(known_items)}")
        assert items is not None
        assert target_items is not None
        table[items[str(key)]] = target_items[str(value)]
    for name, number in (items or {}).items():  # what is not mapped keeps its name
        if name not in t.entries:
            if target_items is None or name not in target_items:
                raise PackageError(f"{where}: {takes.shown} has no item '{name}', which {source.shown} has unmapped")
            table[number] = target_items[name]
    return [table]


def _check(source: Quantity, target: Quantity, where: str, named: bool = True) -> None:
    """One end gives what the other one takes; `named`: its items mean the same."""
    _check_types(source, target, where)
    if named:
        _check_items(source, target, where)


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
    names = {v: k for k, v in target.items.items()}
    for name, value in source.items.items():
        if names.get(value) != name:
            raise PackageError(
                f"{where}: item '{name}' ({value}) of {source.shown} is "
                f"{repr(names[value]) if value in names else 'missing'} in {target.shown}; give an "
                "EnumerationMappingTransformation"
            )


def parsed(value: object, quantity: Quantity, shown: str, where: str) -> Scalar:
    """A value that a user gives, in the type of what takes it, or a `ParameterError`."""
    text = str(value).strip()
    try:
        if quantity.type == "Binary":
            return value if isinstance(value, bytes) else bytes.fromhex(text)
        if quantity.family == TEXT:
            return value if isinstance(value, str) else text
        if quantity.type == "Boolean":
            return {"true": 1, "1": 1, "1.0": 1, "false": 0, "0": 0, "0.0": 0}[text.lower()]
        if quantity.items and text in quantity.items:
            return quantity.items[text]
        number = plain_number(text)
        if not isfinite(number) or (quantity.family != REAL and number != int(number)):
            raise ValueError
        if quantity.family == REAL:
            return number
        whole = int(text) if text.lstrip("+-").isdigit() else int(number)
        low, high = LIMITS.get(quantity.type, (-(2**63), 2**63 - 1))
        if not low <= whole <= high or (quantity.items and whole not in quantity.items.values()):
            raise ValueError
        return whole
    except (KeyError, ValueError):
        kind = f"one {quantity.type}{', hexadecimal digits' if quantity.type == 'Binary' else ''}"
        raise ParameterError(f"{where}: {value!r} is not a value of {shown} ({kind})") from None


def converted(
    value: Value, source: Quantity, hops: Sequence[Hop], target: Quantity, where: str,
    remark: Callable[[str], None] = lambda _: None,
) -> Value:  # fmt: skip
    """A parameter's value as it reaches a variable; `remark` is told of units that are defined in two ways."""
    if source.type == "Enumeration" and isinstance(value, str):
        return _item(value, source, hops, target, where)
    _check_sizes(value, hops, where)
    if target.family == TEXT or source.family == TEXT:
        for at in filter(None, map(quantity_at, hops)):
            if at.type != source.type and not (at.type == "Enumeration" and target.type == "Enumeration"):
                raise ParameterError(f"{where}: the value is {source.type}, {at.shown} is {at.type}")
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
    way = value_conversion(source, hops or (Hop(where=where),), target, where, strict=False)
    for text in way.remarks:
        remark(text)

    def check(v: Scalar, at: Quantity) -> None:
        if at.family == TEXT or (source.type == "Boolean") != (at.type == "Boolean"):
            raise ParameterError(f"{where}: the value is {source.type}, {at.shown} is {at.type}")
        if at.family == INTEGER and (int(v) != v or int(v) not in values_of(at)):
            item_text = f"; it has {', '.join(at.items)}" if at.items else ""
            raise ParameterError(f"{where}: {float(v):g} is not a value of {at.shown}, which is {at.type}{item_text}")

    values = value if isinstance(value, tuple) else (value,)
    results = []
    for v in values:
        reached = way.apply(v, check)
        results.append(bool(reached) if isinstance(v, bool) else reached)
    return tuple(results) if isinstance(value, tuple) else results[0]


def _check_sizes(value: Value, hops: Sequence[Hop], where: str) -> None:
    """An array has as many values as the connectors on its way."""
    if isinstance(value, tuple):
        check_sizes(Extent("the value", len(value)), hops, None, where)


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
            verb = "scaled" if isinstance(t, Linear) else "mapped as a boolean"
            raise ParameterError(f"{place}: the item '{value}' for {target.shown} cannot be {verb}")
        if t.kind == "Enumeration":
            if number is not None:
                value = next((name for name, k in (items or {}).items() if k == number), value)
            value, number = str(t.entries.get(value, value)), None
        else:
            if number is None:
                if items is None or value not in items:
                    item_text = f"; known: {', '.join(items)}" if items else ""
                    raise ParameterError(f"{place}: the number of the item '{value}' is not known{item_text}")
                number = items[value]
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
    item_text = f"; it has {', '.join(target.items)}" if target.items else ""
    raise ParameterError(f"{where}: {target.shown} has no item '{value}'{item_text}")
