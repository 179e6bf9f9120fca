"""Types, units, enumerations, values and transformations, as they stand in the XML of all SSP formats."""

from __future__ import annotations

import binascii
from dataclasses import replace

from lxml import etree

from ..core.unit_names import named
from ..core.units import BASE, Unit
from .document import SSC, Document, local, truth
from .model import FLOATS, INTEGER_RANGES, INTEGERS, TYPE_KINDS, Linear, Scalar, Table, Transformation, Type, Value

MAPPED = "integer"
"""What a mapping of integers is between: those of all types."""

_RANGES = {**INTEGER_RANGES, MAPPED: (INTEGER_RANGES["Int64"][0], INTEGER_RANGES["UInt64"][1])}

TYPES = tuple(f"{SSC}{kind}" for kind in TYPE_KINDS)
TRANSFORMATIONS = tuple(
    f"{SSC}{name}Transformation" for name in ("Linear", "BooleanMapping", "IntegerMapping", "EnumerationMapping")
)


class Definitions:
    """Units and enumerations that a file defines."""

    def __init__(self, document: Document, root: etree._Element, space: str, outer: Definitions | None = None):
        self.document = document
        self.units: dict[str, Unit] = {}
        self.enumerations: dict[str, dict[str, int]] = {}
        self.outer = outer
        for section in root.findall(f"{space}Units"):
            for element in document.children(section, (f"{SSC}Unit",)):
                self._unit(element)
        for section in root.findall(f"{space}Enumerations"):
            for element in document.children(section, (f"{SSC}Enumeration",)):
                self._enumeration(element)

    def _unit(self, element: etree._Element) -> None:
        name = self.document.name(element)
        base = self.document.child(element, f"{SSC}BaseUnit")
        if base is None:
            raise self.document.error(element, f"unit '{name}' has no <BaseUnit>")
        exponents = {}
        for key in BASE:
            power = self.document.number(base, key, 0.0)
            if power != int(power or 0.0):
                raise self.document.error(base, f"unit '{name}': {key}=\"{base.get(key)}\" is not an integer")
            if power:
                exponents[key] = int(power)
        factor, offset = self.document.number(base, "factor", 1.0), self.document.number(base, "offset", 0.0)
        if not factor:
            raise self.document.error(base, f"unit '{name}' has the factor 0")
        unit = Unit(name, exponents, factor, offset or 0.0)
        if self.units.setdefault(name, unit) != unit:
            raise self.document.error(element, f"unit '{name}' is defined in two ways")

    def _enumeration(self, element: etree._Element) -> None:
        name = self.document.name(element)
        if name in self.enumerations:
            raise self.document.error(element, f"enumeration '{name}' is defined twice")
        items: dict[str, int] = {}
        for item in self.document.children(element, (f"{SSC}Item",)):
            key = self.document.attribute(item, "name")
            if key in items:
                raise self.document.error(item, f"enumeration '{name}' has the item '{key}' twice")
            items[key] = _integer(self.document, item, self.document.attribute(item, "value"), "Integer")
        self.enumerations[name] = items

    def unit(self, name: str | None) -> Unit | None:
        """The unit of that name: as defined in the file, else the well-known one, else one of no known dimension."""
        if name in (None, "", "None"):  # OMSimulator writes the last one for what has no unit
            return None
        if name in self.units:
            return self.units[name]
        if self.outer is not None:
            return self.outer.unit(name)
        usual = named(name) or Unit(name, None)
        return replace(usual, defined=False)

    def enumeration(self, name: str | None) -> dict[str, int] | None:
        """The items of an enumeration; None where no file defines it, as some tools leave to the FMUs."""
        if name in self.enumerations:
            return self.enumerations[name]
        return self.outer.enumeration(name) if self.outer is not None else None


def type_of(
    document: Document, owner: etree._Element, definitions: Definitions, required: bool = False, clocks: bool = False
) -> Type | None:
    """The type that stands in a connector, parameter or dictionary entry; None if none does.

    clocks: it may be a clock.
    """
    typed = [e for e in owner if e.tag in TYPES]
    if not typed:
        strange = [e for e in owner if etree.QName(e).namespace == SSC[1:-1] and local(e) not in ("Dimension",)]
        strange = [e for e in strange if local(e) not in ("Annotations", "MetaData", "Signature")]
        if strange:
            raise document.error(strange[0], f"type {local(strange[0])} is not supported")
        if required:
            raise document.error(owner, f"<{local(owner)}> has no type")
        return None
    if len(typed) > 1:
        raise document.error(typed[1], f"<{local(owner)}> has more than one type")
    return typed_as(document, owner, typed[0], definitions, clocks)


def typed_as(
    document: Document, owner: etree._Element, element: etree._Element, definitions: Definitions, clocks: bool = False
) -> Type:  # fmt: skip
    """The type that an element such as <Real unit="m"/> states, with the dimensions of its owner."""
    kind = local(element)
    if kind not in TYPE_KINDS:
        raise document.error(element, f"type {kind} is not supported")
    if kind == "Clock" and not clocks:
        raise document.error(element, "clocks are not supported")
    sizes: list[int | str | None] = []
    for dimension in owner.findall(f"{SSC}Dimension"):
        if dimension.get("size") is not None and dimension.get("sizeConnector") is not None:
            raise document.error(dimension, "a dimension has either a size or a sizeConnector, not both")
        if dimension.get("size") is not None:
            sizes.append(_integer(document, dimension, dimension.get("size"), "UInt64"))
        else:
            sizes.append(dimension.get("sizeConnector"))
    items = definitions.enumeration(element.get("name")) if kind == "Enumeration" else None
    return Type(kind, definitions.unit(element.get("unit")), items, tuple(sizes))


def _integer(document: Document, element: etree._Element, text: str | None, kind: str) -> int:
    try:
        plain = _plain(text or "")
        whole, point, zeros = plain.partition(".")
        value = int(whole if point and not zeros.strip("0") and zeros else plain)  # 5.0, which the schema tells, is 5
    except ValueError:
        raise document.error(element, f"'{text}' is not a value of type {kind}") from None
    low, high = _RANGES[kind]
    if not low <= value <= high:
        raise document.error(element, f"{value} is out of the range of {kind}")
    return value


def _plain(text: str) -> str:
    """The text of a number; underlines between digits are Python's, not XML's."""
    if "_" in text:
        raise ValueError
    return text.strip()


def _scalar(document: Document, element: etree._Element, kind: str, text: str) -> Scalar:
    if kind in FLOATS:
        try:
            return float(_plain(text))
        except ValueError:
            raise document.error(element, f"'{text}' is not a value of type {kind}") from None
    if kind in INTEGERS:
        return _integer(document, element, text, kind)
    if kind == "Boolean":
        value = truth(text)
        if value is None:
            raise document.error(element, f"'{text}' is not a value of type Boolean")
        return value
    if kind == "Binary":
        try:
            return binascii.unhexlify(text.strip())
        except (binascii.Error, ValueError):
            raise document.error(element, "the value of a Binary is not hexadecimal") from None
    return text


def value_of(document: Document, element: etree._Element, type: Type) -> Value:
    """The value of a parameter's typed element; a tuple for an array."""
    value = _value_of(document, element, type)
    count = len(value) if isinstance(value, tuple) else 1
    if type.count not in (None, count):
        raise document.error(element, f"{count} values do not fill the dimensions of {type.shape}")
    return value


def _value_of(document: Document, element: etree._Element, type: Type) -> Value:
    entries = [e for e in element if local(e) == "Value"]
    if entries and element.get("value") is not None:
        raise document.error(element, f"<{local(element)}> has a value and <Value> elements: which one is meant?")
    if entries:
        return tuple(_scalar(document, e, type.kind, document.attribute(e, "value")) for e in entries)
    text = document.attribute(element, "value")
    if type.kind in (*FLOATS, *INTEGERS, "Boolean"):
        parts = text.split()
        if len(parts) != 1 or type.dimensions:
            if not parts:
                raise document.error(element, f"'{text}' is not a value of type {type.kind}")
            return tuple(_scalar(document, element, type.kind, part) for part in parts)
    return _scalar(document, element, type.kind, text)


def transformation_of(document: Document, owner: etree._Element) -> Transformation | None:
    """The transformation of a connection or mapping entry."""
    elements = [e for e in owner if e.tag in TRANSFORMATIONS]
    if not elements:
        return None
    if len(elements) > 1:
        raise document.error(elements[1], f"<{local(owner)}> has more than one transformation")
    element = elements[0]
    if local(element) == "LinearTransformation":
        factor, offset = document.number(element, "factor", 1.0), document.number(element, "offset", 0.0)
        return Linear(1.0 if factor is None else factor, offset or 0.0)
    kind = local(element).removesuffix("MappingTransformation")
    entries: dict[Scalar, Scalar] = {}
    for entry in document.children(element, (f"{SSC}MapEntry",)):
        pair = []
        for side in ("source", "target"):
            text = document.attribute(entry, side)
            whole = kind == "Integer"
            pair.append(_integer(document, entry, text, MAPPED) if whole else _scalar(document, entry, kind, text))
        if pair[0] in entries:
            raise document.error(entry, f"the value {entry.get('source')} is mapped twice")
        entries[pair[0]] = pair[1]
    if not entries:
        raise document.error(element, f"<{local(element)}> has no <MapEntry>")
    return Table(kind, entries)
