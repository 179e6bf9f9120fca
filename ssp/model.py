"""What an SSP package says, as plain records: a tree of systems as written, nothing resolved, nothing simulated.

Names are those of the standard. `where` is the place for messages: file and line.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from math import prod
from pathlib import Path

from ..core.units import Unit

FLOATS = ("Real", "Float64", "Float32")
INTEGERS = ("Integer", "Int8", "UInt8", "Int16", "UInt16", "Int32", "UInt32", "Int64", "UInt64")
TYPE_KINDS = (*FLOATS, *INTEGERS, "Boolean", "String", "Enumeration", "Binary", "Clock")
"""Types of SSP 1.0 and 2.0."""

INTEGER_RANGES = {
    "Integer": (-(2**31), 2**31 - 1),
    **{f"Int{n}": (-(2 ** (n - 1)), 2 ** (n - 1) - 1) for n in (8, 16, 32, 64)},
    **{f"UInt{n}": (0, 2**n - 1) for n in (8, 16, 32, 64)},
}
"""Least and greatest value of the types of whole numbers."""

Scalar = float | int | bool | str | bytes
Value = Scalar | tuple[Scalar, ...]
"""A parameter's value; a tuple for an array, in row-major order."""


@dataclass(frozen=True)
class Type:
    """The type of a connector or parameter."""

    kind: str
    unit: Unit | None = None
    enumeration: dict[str, int] | None = None
    """Items of an Enumeration, where the package defines them."""
    dimensions: tuple[int | str | None, ...] = ()
    """Sizes of an array, the name of the connector that gives one, or None where it is not said."""

    @property
    def count(self) -> int | None:
        """Values of an array whose sizes are all stated; None for any other and for what is no array."""
        sizes = [d for d in self.dimensions if isinstance(d, int)]
        return prod(sizes) if sizes and len(sizes) == len(self.dimensions) else None

    @property
    def shape(self) -> str:
        """The dimensions, for people."""
        return " x ".join(map(str, self.dimensions))


@dataclass(frozen=True)
class Connector:
    """A connector; `kind` is input, output, parameter, calculatedParameter, structuralParameter, constant, local,
    inout or unspecified."""

    name: str
    kind: str
    type: Type | None = None
    where: str = ""
    clocked: bool = False
    """Whether it is a clock or belongs to one."""


@dataclass(frozen=True)
class Linear:
    """target = factor * source + offset, source in the target's unit."""

    factor: float = 1.0
    offset: float = 0.0


@dataclass(frozen=True)
class Table:
    """A mapping of values; `kind` is Boolean, Integer or Enumeration (item names)."""

    kind: str
    entries: dict[Scalar, Scalar]


Transformation = Linear | Table


@dataclass(frozen=True)
class Parameter:
    """A value of a parameter set; `name` as written there."""

    name: str
    type: Type
    value: Value
    where: str = ""
    again: str = ""
    """Where the name is given once more: then nobody knows which value is meant."""


@dataclass(frozen=True)
class MappingEntry:
    """One entry of a parameter mapping."""

    source: str
    target: str
    transformation: Transformation | None = None
    suppress_unit_conversion: bool = False
    where: str = ""


@dataclass(frozen=True)
class Binding:
    """A parameter set bound to an element. With a mapping only what it maps is applied."""

    parameters: tuple[Parameter, ...]
    prefix: str = ""
    mapping: tuple[MappingEntry, ...] | None = None
    where: str = ""


@dataclass(frozen=True)
class LinearFunction:
    """What a component without an FMU does: an output is `offset` + the sum of factor * input, for (input, factor)."""

    outputs: dict[str, tuple[tuple[str, float], ...]] = field(hash=False)  # a dict has no hash; equality looks at it
    offset: float = 0.0


@dataclass(frozen=True)
class Component:
    """A component that is an FMU, or a function: then `source` is the file that says so."""

    name: str
    source: Path
    implementation: str = "any"
    connectors: tuple[Connector, ...] = ()
    bindings: tuple[Binding, ...] = ()
    where: str = ""
    step_hint: float | None = None
    """The step of its own that the package asks for [s]."""
    function: LinearFunction | None = None


@dataclass(frozen=True)
class SignalDictionaryReference:
    """A place where a signal dictionary is used."""

    name: str
    dictionary: str
    connectors: tuple[Connector, ...] = ()
    where: str = ""


@dataclass(frozen=True)
class Connection:
    """A connection as written: (element or None for the system itself, connector) at both ends."""

    start: tuple[str | None, str]
    end: tuple[str | None, str]
    start_indices: tuple[int, ...] = ()
    end_indices: tuple[int, ...] = ()
    transformation: Transformation | None = None
    suppress_unit_conversion: bool = False
    where: str = ""


@dataclass(frozen=True)
class System:
    """A system with its elements; the top-level one of a package that is used as a component included."""

    name: str
    connectors: tuple[Connector, ...] = ()
    elements: tuple[Component | SignalDictionaryReference | System, ...] = ()
    connections: tuple[Connection, ...] = ()
    bindings: tuple[Binding, ...] = ()
    dictionaries: dict[str, dict[str, Type]] = field(default_factory=dict)
    """Entries of the signal dictionaries by dictionary name."""
    where: str = ""
    outer: dict[str, Type] = field(default_factory=dict)
    """Types of its connectors as the component says that stands for it; other units than its own are converted."""
    broken: frozenset[str] = frozenset()
    """Names of elements that could not be read, where what is wrong is collected."""

    def components(self, path: str = "") -> Iterator[tuple[str, Component]]:
        """All components below with their dotted paths, in the order of the file."""
        for element in self.elements:
            name = f"{path}{element.name}"
            if isinstance(element, Component):
                yield name, element
            elif isinstance(element, System):
                yield from element.components(f"{name}.")


@dataclass(frozen=True)
class Metadata:
    """Something that a package tells beside what is simulated: a file of SSP Traceability, meta data."""

    place: str
    """Its file in the package, or file and line."""
    kind: str
    title: str
    lines: tuple[str, ...] = ()
    """What it holds, for people."""


@dataclass(frozen=True)
class AnswerValue:
    """A number that a package wants computed after a run: a formula of its signals and parameters."""

    name: str
    formula: str
    unit: str
    """Of the number; empty where it has none."""
    where: str


@dataclass(frozen=True)
class AnswerSentence:
    """What it wants said: a text with {names of values}, told where its condition, a formula, holds."""

    text: str
    condition: str
    """Empty: always."""
    where: str


@dataclass(frozen=True)
class AnswersAsked:
    """What a package wants said after a run of it."""

    values: tuple[AnswerValue, ...] = ()
    sentences: tuple[AnswerSentence, ...] = ()
    signals: tuple[str, ...] = ()
    """What plots show at first, in that order."""


@dataclass(frozen=True)
class ReplayScale:
    """A range of values that colours stand for in a replay; least and greatest are formulas of measures and parameters,
    empty: those of the signals that it colours."""

    name: str
    text: str
    unit: str
    """Of the values; empty where they have none."""
    least: str
    greatest: str
    where: str


@dataclass(frozen=True)
class ReplayColour:
    """A part of a component's scene that is coloured by a formula of signals."""

    component: str
    geom: str
    scale: str
    """Name of the scale."""
    formula: str
    where: str


@dataclass(frozen=True)
class ReplayLabel:
    """A text at a place of a component's scene, with the value of a formula in the place of {}."""

    component: str
    at: str
    """A site, geom or body of the scene."""
    text: str
    formula: str
    """Empty: the text has no value in it."""
    unit: str
    where: str


@dataclass(frozen=True)
class ReplayAsked:
    """What a package adds to the scenes of its FMUs when a run of it is replayed."""

    scales: tuple[ReplayScale, ...] = ()
    colours: tuple[ReplayColour, ...] = ()
    labels: tuple[ReplayLabel, ...] = ()


@dataclass(frozen=True)
class SystemStructure:
    """A system structure description: the root system and how it is meant to be run."""

    name: str
    version: str
    """Of SSP; empty for an FMU on its own and for other formats."""
    file: Path
    system: System
    start_time: float = 0.0
    stop_time: float | None = None
    step_size: float | None = None
    variants: tuple[str, ...] = ()
    """The system structure descriptions of the package, by file name."""
    bonds: tuple[tuple[str, str], ...] = ()
    """Power bonds declared in the annotation: addresses of two outputs whose product is a power."""
    remarks: tuple[str, ...] = ()
    """What deviates from the schema without a doubt about the meaning."""
    method: str | None = None
    """The coupling that the package suggests, by its name in the master."""
    unused: tuple[str, ...] = ()
    """Annotations of other tools that mean nothing here: type, elements and place."""
    metadata: tuple[Metadata, ...] = ()
    notes: tuple[str, ...] = ()
    """What it asks for that is done in another way than it says."""
    answers: AnswersAsked = field(default_factory=AnswersAsked)
    replay: ReplayAsked = field(default_factory=ReplayAsked)
