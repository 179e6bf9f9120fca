"""Reads a system structure of the Open Simulation Platform (OspSystemStructure.xml) into the records of `model`.

What it says is meant as libcosim carries it out: values are passed on as they are, whatever their units.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol, TypeVar
from urllib.parse import parse_qs, unquote, urlsplit

from lxml import etree

from ..core.errors import PackageError, did_you_mean
from ..core.units import Unit, alike
from .document import Document, local
from .model import Binding, Component, Connection, LinearFunction, Parameter, Scalar, System, SystemStructure, Type
from .osp_groups import VariableGroup, groups_of, paired

OSP_FILE = "OspSystemStructure.xml"
STEP = 0.1
"""What libcosim takes where the file tells no BaseStepSize [s]."""

MAX_SIGNALS = 100_000
"""Most inputs of a function."""

SECTIONS = (
    "StartTime", "EndTime", "BaseStepSize", "Algorithm", "Simulators", "Functions", "Connections", "EccoConfiguration",
)  # fmt: skip
ENDS = {
    "VariableConnection": ("Variable", "Variable"), "SignalConnection": ("Variable", "Signal"),
    "VariableGroupConnection": ("VariableGroup", "VariableGroup"),
    "SignalGroupConnection": ("VariableGroup", "SignalGroup"),
}  # fmt: skip
"""Kinds of connections, and what their two ends are."""

OSP_TYPES: dict[str, Callable[[str], Scalar]] = {"Real": float, "Integer": int, "Enumeration": int, "String": str}

T = TypeVar("T")

End = tuple[str, str]
"""(simulator or function, variable or signal, or a group of them)."""


class Fmus(Protocol):
    """What the FMUs of a structure say."""

    def model_name(self, source: Path) -> str | None:
        """The name of the model; None where it cannot be read."""

    def variable(self, source: Path, name: str) -> tuple[str | None, Unit | None] | None:
        """Causality and unit of a variable; None where there is none."""


def read_osp(path: Path, fmus: Fmus, errors: list[str] | None = None) -> SystemStructure:
    """Read the structure in a file.

    Raises `PackageError` naming line and remedy for what is not supported; with a list `errors`, what is wrong with a
    simulator or a connection goes there, and the others are read.
    """
    return _Reader(path, fmus, errors).read()


@dataclass(frozen=True)
class _Bonded:
    """A connection that belongs to a power bond: its output's address, once that is known."""

    bond: str
    output: str | None


class _Reader:
    def __init__(self, path: Path, fmus: Fmus, errors: list[str] | None):
        self.path, self.fmus, self.errors = path, fmus, errors
        self.document = Document(path, path.name)
        self.space = self.document.root.tag.rpartition("}")[0] + "}" if "}" in self.document.root.tag else ""
        self.parts: dict[str, Component] = {}
        self.steps: dict[str, float] = {}
        self.groups: dict[str, dict[str, VariableGroup]] = {}
        self.notes: list[str] = []
        self.broken: set[str] = set()
        """Simulators and functions that could not be read, where what is wrong is collected."""
        self.bonded: list[_Bonded] = []

    def read(self) -> SystemStructure:
        document, root = self.document, self.document.root
        if local(root) != "OspSystemStructure":
            raise document.error(root, f"<{local(root)}> is no OspSystemStructure")
        tags = {local(e): e for e in document.children(root, [self.space + s for s in SECTIONS])}
        for kind, read in (("Simulators", self._simulator), ("Functions", self._function)):
            for element in tags.get(kind, ()):
                self._attempt(read, element)
        links: list[Connection] = []
        for element in tags.get("Connections", ()):
            links += self._attempt(self._connection, element) or []
        times = {k: self._time(tags[k]) for k in ("StartTime", "EndTime", "BaseStepSize") if k in tags}
        algorithm = (tags["Algorithm"].text or "").strip() if "Algorithm" in tags else "fixedStep"
        step = self._step(times.get("BaseStepSize", STEP))
        if algorithm != "fixedStep":
            where = document.where(tags["Algorithm"])
            self.notes.append(f"{where}: algorithm '{algorithm}' is not supported; the step is {step:g} s throughout")
        name = self.path.resolve().parent.name or self.path.stem
        system = System(name, (), tuple(self.parts.values()), tuple(links), where=document.where(root))
        return SystemStructure(
            name, "", self.path, system, times.get("StartTime", 0.0), times.get("EndTime"), step,
            bonds=self._bonds(), method="jacobi" if algorithm == "fixedStep" else None, notes=tuple(self.notes),
        )  # fmt: skip

    def _attempt(self, read: Callable[[etree._Element], T], element: etree._Element) -> T | None:
        try:
            return read(element)
        except PackageError as error:
            if self.errors is None:
                raise
            self.errors.append(str(error))
            self.broken.add(element.get("name", ""))
            return None

    def _time(self, element: etree._Element) -> float:
        try:
            value = float(element.text or "")
        except ValueError:
            value = float("nan")
        if not abs(value) < float("inf") or (local(element) == "BaseStepSize" and not value > 0.0):
            raise self.document.error(element, f"<{local(element)}>{element.text or ''} is no time")
        return value

    def _step(self, base: float) -> float:
        """The macro step [s]: the shortest that a simulator takes, which is a multiple of the base step."""
        steps = {name: base * max(1, int(self.steps.get(name, base) / base + 1e-9)) for name in self._simulators()}
        shortest = min(steps.values(), default=base)
        for name, step in steps.items():
            if step > shortest * (1 + 1e-9):
                text = (
                    f"simulator '{name}' would take steps of {step:g} s; it takes those of the others, {shortest:g} s"
                )
                self.notes.append(f"{self.parts[name].where}: {text}")
        return shortest

    def _simulators(self) -> list[str]:
        return [name for name, part in self.parts.items() if part.function is None]

    # simulators and functions

    def _add(self, element: etree._Element, part: Component) -> None:
        if part.name in self.parts:
            raise self.document.error(element, f"two simulators or functions are called '{part.name}'")
        self.parts[part.name] = part

    def _simulator(self, element: etree._Element) -> None:
        document = self.document
        self._check_name(element, "Simulator")
        name, source = document.name(element), self._source(element)
        values = []
        for section in document.children(element, [self.space + "InitialValues"]):
            values += [self._value(e) for e in document.children(section, [self.space + "InitialValue"])]
        where = document.where(element)
        bindings = (Binding(tuple(values), where=where),) if values else ()
        self._add(element, Component(name, source, bindings=bindings, where=where))
        step = document.number(element, "stepSize")
        if step is not None:
            self.steps[name] = step

    def _check_name(self, element: etree._Element, *names: str) -> None:
        if local(element) not in names:
            hint = did_you_mean(local(element), names)
            raise self.document.error(element, f"<{local(element)}> is not supported; known: {', '.join(names)}{hint}")

    def _source(self, element: etree._Element) -> Path:
        """The FMU's file: a path from the folder of the structure, or that of a proxyfmu URI of this machine."""
        source = self.document.name(element, "source")
        try:
            parts = urlsplit(source)
            host = parts.hostname
        except ValueError as error:
            raise self.document.error(element, f"source '{source}' is not a URI ({error})") from None
        path = unquote(parts.path)
        if parts.scheme == "proxyfmu" and host in ("localhost", "127.0.0.1"):
            path = parse_qs(parts.query).get("file", [""])[0].removeprefix("file://")
            self.notes.append(
                f"{self.document.where(element)}: '{source}' runs in this process; --isolate gives it one of its own"
            )
        elif parts.scheme not in ("", "file") or (parts.netloc and host != "localhost"):
            raise self.document.error(element, f"source '{source}' is not supported; only files of this machine are")
        file = self.path.parent / path
        try:
            is_file = file.is_file()
        except (OSError, ValueError):
            is_file = False
        if not is_file:
            raise self.document.error(element, f"simulator '{element.get('name')}' needs '{path}', which is missing")
        return file

    def _value(self, element: etree._Element) -> Parameter:
        name = self.document.name(element, "variable")
        typed = list(self.document.children(element, [self.space + kind for kind in (*OSP_TYPES, "Boolean")]))
        if len(typed) != 1:
            raise self.document.error(element, f"initial value of '{name}': one value is needed")
        kind, text = local(typed[0]), self.document.attribute(typed[0], "value")
        if kind == "Boolean":
            value: Scalar = self.document.truth(typed[0], "value")
        else:
            try:
                value = OSP_TYPES[kind](text)
            except ValueError:
                raise self.document.error(typed[0], f'value="{text}" of \'{name}\' is no {kind}') from None
        kind = "Integer" if kind == "Enumeration" else kind
        return Parameter(name, Type(kind), value, self.document.where(typed[0]))

    def _function(self, element: etree._Element) -> None:
        self._check_name(element, "LinearTransformation", "Sum", "VectorSum")
        document, name, kind = self.document, self.document.name(element), local(element)
        if kind == "LinearTransformation":
            factor, offset = document.number(element, "factor", 1.0), document.number(element, "offset", 0.0)
            function = LinearFunction({"out": (("in", factor or 0.0),)}, offset or 0.0)
        else:
            count = self._count(element, "inputCount")
            tails = [f"[{k}]" for k in range(self._count(element, "dimension"))] if kind == "VectorSum" else [""]
            if count * len(tails) > MAX_SIGNALS:
                raise document.error(element, f"'{name}' has {count * len(tails)} inputs; most are {MAX_SIGNALS}")
            function = LinearFunction({f"out{t}": tuple((f"in[{k}]{t}", 1.0) for k in range(count)) for t in tails})
            self.groups[name] = {
                group: VariableGroup(group, "", tuple((f"{group}{t}") for t in tails))
                for group in ("out", *(f"in[{k}]" for k in range(count)))
            }
        self._add(element, Component(name, self.path, where=document.where(element), function=function))

    def _count(self, element: etree._Element, name: str) -> int:
        text = self.document.attribute(element, name)
        if not (text.isascii() and text.isdigit() and int(text) > 0):
            raise self.document.error(element, f'{name}="{text}" is no number of at least 1')
        return int(text)

    # connections

    def _connection(self, element: etree._Element) -> list[Connection]:
        self._check_name(element, *ENDS)
        kinds, document = ENDS[local(element)], self.document
        ends = list(document.children(element, [self.space + kind for kind in set(kinds)]))
        if sorted(map(local, ends)) != sorted(kinds):
            raise document.error(element, f"<{local(element)}> needs one <{kinds[0]}> and one <{kinds[1]}>")
        if any(e.get("simulator", e.get("function")) in self.broken for e in ends):
            return []
        start, end = (self._end(e) for e in ends)
        where = document.where(element)
        pairs = [(start, end)]
        if kinds[0] == "VariableGroup":
            groups = self._group(ends[0], start), self._group(ends[1], end)
            pairs = [((start[0], a), (end[0], b)) for a, b in paired(*groups, where, self.notes)]
        for pair in pairs:
            self._look(pair, element.get("powerBond"), where)
        return [Connection(a, b, suppress_unit_conversion=True, where=where) for a, b in pairs]

    def _end(self, element: etree._Element) -> End:
        of = "function" if local(element).startswith("Signal") else "simulator"
        name = self.document.name(element, of)
        names = [n for n, part in self.parts.items() if (part.function is None) == (of == "simulator")]
        if name not in names:
            raise self.document.error(element, f"there is no {of} '{name}'{did_you_mean(name, names)}")
        return name, self.document.name(element)

    def _group(self, element: etree._Element, end: End) -> VariableGroup:
        """A group of variables: of a function, or as the FMU's OspModelDescription says."""
        name, group = end
        if name not in self.groups:
            source = self.parts[name].source
            model = self.fmus.model_name(source)
            self.groups[name] = groups_of(source, self.path.parent, model, element, self.document)
        groups = self.groups[name]
        if group not in groups:
            raise self.document.error(element, f"'{name}' has no group '{group}'{did_you_mean(group, list(groups))}")
        return groups[group]

    def _look(self, pair: tuple[End, End], bond: str | None, where: str) -> None:
        """Note units that differ, for no value is converted, and outputs that belong to a power bond."""
        variables = [
            None if (part := self.parts[name]).function is not None else self.fmus.variable(part.source, variable)
            for name, variable in pair
        ]
        (a, b), shown = variables, [f"{name}.{variable}" for name, variable in pair]
        if a and b and a[1] and b[1] and a[1].name != b[1].name and not alike(a[1], b[1]):
            text = f"'{shown[0]}' is in {a[1].name}, '{shown[1]}' in {b[1].name}"
            self.notes.append(f"{where}: {text}; the value is passed on as it is, as OSP does")
        if bond:
            gives = [
                s for s, v in zip(shown, variables, strict=True) if v and v[0] in ("output", "calculatedParameter")
            ]
            self.bonded.append(_Bonded(bond, gives[0] if len(gives) == 1 else None))

    def _bonds(self) -> tuple[tuple[str, str], ...]:
        """The power bonds that two connections make."""
        by_name: dict[str, list[str]] = {}
        for b in self.bonded:
            by_name.setdefault(b.bond, []).extend([b.output] if b.output else [])
        return tuple((outputs[0], outputs[1]) for outputs in by_name.values() if len(outputs) == 2)
