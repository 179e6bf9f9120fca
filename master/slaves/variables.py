"""What the model description of an FMU says of its variables."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from ...core.errors import PackageError, ParameterError, UnknownNameError, did_you_mean
from ...core.plain_numbers import TOO_LARGE, plain_number, plain_whole
from ...core.unit_names import named
from ...core.units import BASE, Unit
from ..engine.values import LIMITS, MAX_ARRAY_VALUES, REAL, TEXT, FmiType

ALWAYS, BEFORE_INPUTS, INITIALISED, AFTER_STEPS = range(4)
"""When an FMU lets itself be read: after its inputs are set as well, only before that, only before that once it is
initialised, only after a step. All do after a step."""


class FmuVariables:
    """The variables of an FMU, by name."""

    types: ClassVar[dict[str, FmiType]]
    version: ClassVar[str]
    limits: ClassVar[dict[str, tuple[int, int]]] = LIMITS
    """Least and greatest value of the types of whole numbers."""

    def __init__(self, name: str, folder: Path, description: Any):
        self.name, self.folder, self.description = name, folder, description
        self.variables = {v.name: v for v in description.modelVariables}
        self.ambiguous: frozenset[str] = frozenset()
        """Names of which the FMU has several internal variables."""
        self.detected_feedthrough: dict[str, list[str]] = {}
        """Inputs that outputs have been found to depend on at once (`coupling.feedthrough`)."""
        self.readable = ALWAYS
        """When the FMU lets itself be read, as far as it has been found out (`coupling.initialisation`)."""
        self._declared_feedthrough: dict[str, list[str]] | None = None
        """Inputs that outputs depend on at once, where the FMU says it."""
        self._names: dict[tuple[str, int], list[str]] | None = None
        """Names of variables by their references."""
        self._structural: dict[str, Any] = {}
        """Values of structural parameters, which sizes of arrays follow; only FMI 3.0 has some."""
        self._units = {u.name: _unit(u) for u in description.unitDefinitions}

    def configure(self, name: str, value: Any) -> None:
        """Give a structural parameter a value, before the FMU is loaded: sizes of arrays follow it."""
        self._structural[name] = value

    def suggested(self, name: str) -> float | None:
        """A time of the FMU's DefaultExperiment [s], by its name there; None where there is none that can be used."""
        try:
            value = float(getattr(self.description.defaultExperiment, name, None) or "nan")
        except ValueError:
            return None
        return value if np.isfinite(value) else None

    def variable(self, name: str, kinds: tuple[str, ...] = ()) -> Any:
        """The variable of that name, of one of the causalities `kinds`."""
        variable = self.variables.get(name)
        if name in self.ambiguous:
            raise PackageError(f"component '{self.name}': its FMU has two internal variables '{name}'")
        if variable is None or (kinds and variable.causality not in kinds):
            known = [n for n, v in self.variables.items() if not kinds or v.causality in kinds]
            what = kinds[0] if len(kinds) == 1 else "variable"
            raise UnknownNameError(f"component '{self.name}' has no {what} '{name}'{did_you_mean(name, known)}")
        return variable

    def fmi_type(self, name: str) -> FmiType | None:
        """How a variable's values are exchanged; None for a type that is not supported."""
        return self.types.get(self.variables[name].type)

    def unit_name(self, name: str) -> str | None:
        """Name of a variable's unit, its own or that of its declared type."""
        variable = self.variables[name]
        return variable.unit or (variable.declaredType.unit if variable.declaredType is not None else None)

    def unit(self, name: str) -> Unit | None:
        """Unit of a variable, as the FMU defines it, else the well-known one of that name."""
        own = self.unit_name(name)
        if own is None:
            return None
        return self._units.get(own) or named(own) or Unit(own, None)

    def relative(self, name: str) -> bool:
        """Whether a variable is a difference, whose unit's offset does not count."""
        variable = self.variables[name]
        if variable.relativeQuantity is not None:
            return bool(variable.relativeQuantity)
        return variable.declaredType is not None and bool(variable.declaredType.relativeQuantity)

    def meant(self, unit: Unit | None, name: str) -> Unit | None:
        """The unit of a variable: what a package says, by the FMU's definition of it where the package has none."""
        if unit is None:
            return self.unit(name)
        return unit if unit.defined else self._units.get(unit.name, unit)

    def items(self, name: str) -> dict[str, int] | None:
        """Items of an enumeration's variable."""
        variable = self.variables[name]
        if variable.type != "Enumeration" or variable.declaredType is None or not variable.declaredType.items:
            return None
        try:
            return {item.name: int(item.value) for item in variable.declaredType.items}
        except (TypeError, ValueError):
            kind = variable.declaredType.name
            raise PackageError(f"component '{self.name}': an item of the enumeration '{kind}' has no value") from None

    def shape(self, name: str) -> tuple[int, ...]:
        """Sizes of a variable; () for a scalar."""
        variable = self.variables[name]
        sizes = []
        for d in variable.dimensions or ():
            size = d.start if d.start is not None else self._structural.get(d.variable.name, d.variable.start)
            try:
                sizes.append(int(size))
            except (TypeError, ValueError):
                raise PackageError(f"component '{self.name}': '{name}' has a dimension of size {size!r}") from None
        count = 1
        for size in sizes:
            count *= size
            if not 0 <= size <= MAX_ARRAY_VALUES or count > MAX_ARRAY_VALUES:
                shown = " x ".join(map(str, sizes))
                raise PackageError(f"component '{self.name}': '{name}' has {shown} values; most are {MAX_ARRAY_VALUES}")
        return tuple(sizes)

    def size(self, name: str) -> int:
        """Number of values of a variable."""
        return int(np.prod(self.shape(name), dtype=int)) if self.variables[name].dimensions else 1

    def settable(self, name: str) -> bool:
        """Whether a value may be given before the initialisation."""
        v = self.variables.get(name)
        if v is None or v.variability == "constant" or v.type not in self.types:
            return False
        return v.causality in ("parameter", "input", "structuralParameter") or v.initial in ("exact", "approx")

    @property
    def clocks(self) -> list[Any]:
        """Its clocks, none of which is ticked from here; only FMI 3.0 has some."""
        return [v for v in self.variables.values() if v.type == "Clock"]

    @property
    def needs_event_mode(self) -> bool:
        """Whether it has clocks and says that they are handled in event mode, which it is not run with."""
        return bool(getattr(self.description.coSimulation, "hasEventMode", False)) and bool(self.clocks)

    def direct_feedthrough(self, output: str) -> list[str] | None:
        """Inputs that an output depends on at once (direct feedthrough): as the FMU says, else as was found, else None.

        None of them counts for an FMU that cannot be read before it has stepped.
        """
        return self._known_feedthrough(output) if self.readable == ALWAYS else []

    def _known_feedthrough(self, output: str) -> list[str] | None:
        """See `direct_feedthrough`."""
        if self._declared_feedthrough is None:
            dependencies = self.dependencies(self.description.outputs)
            self._declared_feedthrough = {
                name: [k for k in known if self.variables[k].causality == "input"]
                for name, known in dependencies.items()
            }
        if output in self._declared_feedthrough:
            return self._declared_feedthrough[output]
        return self.detected_feedthrough.get(output)

    def dependencies(self, unknowns: Iterable[Any]) -> dict[str, list[str]]:
        """Names of what unknowns of the model description depend on, by their names; what it does not say is left out.

        Aliases count like the variable that is named there.
        """
        told: dict[str, list[str]] = {}
        for unknown in unknowns:
            if unknown.variable is not None and unknown.dependencies is not None:
                told.setdefault(unknown.variable.name, [v.name for v in unknown.dependencies])
        return self._with_aliases(told)

    def _with_aliases(self, told: Mapping[str, Sequence[str]]) -> dict[str, list[str]]:
        """Dependencies by name, as the FMU tells them, for and on all names of the same variables."""
        expanded = {name: [n for k in known for n in self.names_of(k)] for name, known in told.items()}
        for name, known in list(expanded.items()):
            for other in self.names_of(name):
                expanded.setdefault(other, known)
        return expanded

    def names_of(self, name: str) -> list[str]:
        """All names of the variable of that name, which have one value reference; none where there is no such one."""
        if self._names is None:
            self._names = {}
            for v in self.variables.values():
                self._names.setdefault(self._reference(v), []).append(v.name)
        return self._names[self._reference(self.variables[name])] if name in self.variables else []

    def _reference(self, variable: Any) -> tuple[str, int]:
        """What tells variables apart: in FMI 1.0 and 2.0 each of the types has references of its own."""
        known = self.types.get(variable.type)
        return (known.call_suffix if known is not None else variable.type), variable.valueReference

    def checked(self, name: str, value: Any, where: str = "", limited: bool = True) -> Any:
        """`value` in the variable's type, or a `ParameterError` that names variable, value and range.

        limited: the range that the FMU states counts.
        """
        self.variable(name)
        size = self.size(name)
        family = self.types[self.variables[name].type].family
        if isinstance(value, str) and self.variables[name].dimensions and family != TEXT:
            value = tuple(value.replace(",", " ").split())
        elif isinstance(value, str) and self.variables[name].dimensions and value.startswith("["):
            value = _listed(value)
        if isinstance(value, (tuple, list)) or self.variables[name].dimensions:
            values = list(value) if isinstance(value, (tuple, list)) else [value] * size
            if len(values) != size:
                shown = f"{where}: " if where else ""
                raise ParameterError(f"{shown}{self.name}.{name} has {size} values, not {len(values)}")
            return tuple(self._scalar(name, v, where, limited) for v in values)
        return self._scalar(name, value, where, limited)

    def nominal(self, name: str, otherwise: float = 1.0) -> float:
        """Usual size of a real variable: what its FMU or its type declares, else 1 as FMI has it."""
        found = self._declared(name, "nominal")
        return abs(found) if found and np.isfinite(found) else otherwise

    def bounds(self, name: str) -> tuple[float, float]:
        """Least and greatest value that a variable's type and its FMU allow."""
        low, high = self.limits.get(self.variables[name].type, (-float("inf"), float("inf")))
        least, most = self._declared(name, "min"), self._declared(name, "max")
        return (low if least is None else max(low, least)), (high if most is None else min(high, most))

    def _declared(self, name: str, attribute: str) -> float | None:
        """A number that a variable or its type declares."""
        variable = self.variables[name]
        text = getattr(variable, attribute)
        if text in (None, "") and variable.declaredType is not None:
            text = getattr(variable.declaredType, attribute)
        try:
            return None if text in (None, "") else plain_number(text)
        except ValueError:
            raise PackageError(
                f"component '{self.name}', modelDescription.xml: {attribute}=\"{text}\" of '{name}' is not a number"
            ) from None

    def _scalar(self, name: str, value: Any, where: str, limited: bool = True) -> Any:
        variable = self.variables[name]
        shown = f"{where}: " if where else ""
        address = f"{self.name}.{name}"
        family = self.types[variable.type].family
        if variable.type == "Boolean":
            told = {"true": True, "1": True, "1.0": True, "false": False, "0": False, "0.0": False}
            try:
                return told[str(value).strip().lower()]
            except KeyError:
                raise ParameterError(f"{shown}{address} = {value!r} is neither true nor false") from None
        if family == TEXT:
            if variable.type == "Binary":
                return value if isinstance(value, bytes) else _bytes(value, f"{shown}{address}")
            return str(value)
        items = self.items(name)
        if items and isinstance(value, str) and value in items:
            value = items[value]
        try:
            number = _real(value) if family == REAL else _whole(value)
            if number != number or isinstance(value, (bool, np.bool_)):  # true is no depth
                raise ValueError
        except (TypeError, ValueError, OverflowError) as error:
            known = f"; known: {', '.join(items)}" if items else ""
            what = "is not a number" if family == REAL or not _is_number(value) else "is not an integer"
            what = TOO_LARGE if TOO_LARGE in str(error) else what
            value = f"{value:g}" if isinstance(value, float) else repr(value)
            raise ParameterError(f"{shown}{address} = {value} {what}{known}") from None
        low, high = self.bounds(name) if limited else self.limits.get(variable.type, (-float("inf"), float("inf")))
        if not low <= number <= high:
            unit = f" {self.unit_name(name)}" if self.unit_name(name) not in (None, "", "1") else ""
            raise ParameterError(
                f"{shown}{address} = {number:g}{unit} is out of range; allowed: {low:g} to {high:g}{unit}"
            )
        if limited and items and number not in items.values():
            raise ParameterError(f"{shown}{address} = {number:g} is none of its items; known: {', '.join(items)}")
        return number

    @property
    def has_structural_values(self) -> bool:
        """Whether structural parameters have been set, so that arrays may have another size than the FMU tells."""
        return bool(self._structural)

    def start(self, name: str) -> Any:
        """The start value of a variable in its type; None where only the FMU knows it.

        That is so where the model description has none, and for an array that a structural parameter has given another
        size than its start value has.
        """
        variable = self.variables[name]
        if variable.start is None or (variable.start == "" and self.types[variable.type].family != TEXT):
            return None
        text = variable.start
        if isinstance(text, (list, tuple)) and not variable.dimensions:
            text = text[0] if text else ""
        if variable.dimensions and self._structural and isinstance(text, (str, list, tuple)):
            given = len(text.split()) if isinstance(text, str) else len(text)
            if given not in (1, self.size(name)):
                return None
        return self.checked(name, text, "modelDescription.xml", limited=False)


def _unit(unit: Any) -> Unit:
    base = unit.baseUnit
    if base is None:
        return named(unit.name) or Unit(unit.name, None)
    exponents = {key: int(getattr(base, key, 0) or 0) for key in BASE}
    exponents = {key: power for key, power in exponents.items() if power}
    return Unit(unit.name, exponents, float(base.factor or 1.0), float(base.offset or 0.0))


def _is_number(value: Any) -> bool:
    try:
        _real(value)
    except (TypeError, ValueError):
        return False
    return True


def _real(value: Any) -> float:
    return plain_number(value) if isinstance(value, str) else float(value)


def _listed(text: str) -> Any:
    """The texts of a list such as ["a", "b"] in JSON; what is none is one text."""
    try:
        found = json.loads(text)
    except (ValueError, RecursionError):
        return text
    return tuple(found) if all(isinstance(v, str) for v in found) else text


def _whole(value: Any) -> int:
    if isinstance(value, (int, np.integer)):
        return int(value)
    try:
        return plain_whole(str(value))
    except ValueError:
        number = _real(value)
        if number != int(number):
            raise
        return int(number)


def _bytes(value: Any, where: str) -> bytes:
    try:
        return bytes.fromhex(str(value))
    except ValueError:
        raise ParameterError(f"{where} = {value!r} is not hexadecimal") from None
