"""The parameters that are in force: what each is set to, and what gave it that value."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

from ...core.display_units import DisplayUnits
from ...core.errors import CosimError
from ...ssp.flat_system import End
from ..slaves.base import FmuInstance
from .start_values import StartValue
from .system import System

FMU, CONNECTION = "FMU", "connection"
SHOWN_CAUSALITIES = ("parameter", "structuralParameter")


@dataclass(frozen=True)
class ParameterInForce:
    """A parameter, or another variable that has been given a start value; component '' is the whole system."""

    component: str
    variable: str
    value: Any
    """In the variable's type and unit; None where only the FMU knows it, or a connection brings it later."""
    unit: str | None
    by: str
    """What gives the value: FMU, package, mapping, command line or connection."""
    where: str
    """The place: a file and a line, the option, or the output that a connection comes from; empty for the FMU."""
    text: str = ""
    """What the FMU says of it."""

    @property
    def address(self) -> str:
        """component.variable, or the name of an input of the system."""
        return f"{self.component}.{self.variable}" if self.component else self.variable

    def summary(self) -> dict[str, Any]:
        """For summary.json; bytes are hexadecimal there."""
        told = {"value": _plain(self.value), "unit": self.unit, "from": self.by, "where": self.where or None}
        return {**told, "description": self.text} if self.text else told


def _plain(value: Any) -> Any:
    if isinstance(value, tuple):
        return [_plain(v) for v in value]
    return value.hex() if isinstance(value, bytes) else value


def parameters_in_force(
    system: System, values: Iterable[StartValue], brought: Mapping[End, Any] | None = None
) -> list[ParameterInForce]:
    """All parameters of a system's components, in their order, and what else has been given a start value.

    values: in the order in which they are set; brought: what connections have brought to parameters. An input that is
    connected has no value of its own.
    """
    by_end = {(v.component, v.variable): v for v in values}
    links = {flat_connection.end: flat_connection.start for flat_connection in system.connections.parameter_connections}
    parameters = [_stated(system, v) for v in by_end.values() if not v.component]
    names: dict[str, set[str]] = {}
    for component, name in by_end:
        names.setdefault(component, set()).add(name)
    of_fmus: dict[int, dict[str, tuple[Any, str | None, str]]] = {}
    for component, instance in system.instances.items():
        own = of_fmus.setdefault(id(instance.description), {}) if not instance.has_structural_values else {}
        for name in _listed(instance, names.get(component, set())):
            end = component, name
            if end in links:
                source = ".".join(links[end])
                value = (brought or {}).get(end)
                parameters.append(ParameterInForce(*end, value, system.quantities.unit_name(*end), CONNECTION, source))
            elif end in by_end and system.connections.driver(end) is None:
                parameters.append(_stated(system, by_end[end]))
            elif end not in by_end:
                if name not in own:
                    own[name] = _start(instance, name), instance.unit_name(name), _text_of(instance, name)
                value, unit, text = own[name]
                parameters.append(ParameterInForce(component, name, value, unit, FMU, "", text))
                continue
            else:
                continue
            parameters[-1] = replace(parameters[-1], text=_text_of(instance, name))
    return parameters


def _text_of(instance: FmuInstance, name: str) -> str:
    return " ".join(str(getattr(instance.variables.get(name), "description", None) or "").split())


def _listed(instance: FmuInstance, with_values: set[str]) -> Iterator[str]:
    """Names of what is a parameter or has been given a value, in the order of the model description."""
    for name, v in instance.variables.items():
        if name in with_values or (v.causality in SHOWN_CAUSALITIES and v.type in instance.types):
            yield name


def _stated(system: System, v: StartValue) -> ParameterInForce:
    if v.component:
        unit = system.quantities.unit_name(v.component, v.variable)
    else:
        stated_unit = system.quantities.input_quantity(v.variable).unit
        unit = stated_unit.name if stated_unit is not None else None
    where = f"{v.where}; mapped in {v.mapped}" if v.mapped else v.where
    return ParameterInForce(v.component, v.variable, v.value, unit, v.by, where)


def _start(instance: FmuInstance, name: str) -> Any:
    """What the FMU starts with; as it stands there where it is no value of the variable's type."""
    try:
        return instance.start(name)
    except CosimError:
        return str(instance.variables[name].start)


def parameter_table(system: System, parameters: Iterable[ParameterInForce], display: DisplayUnits) -> str:
    """A table for people: value, unit, least and greatest value, where it is from, and what it is."""
    rows = [("parameter", "value", "unit", "min", "max", "from", "")]
    for p in parameters:
        instance = system.instances.get(p.component)
        low, high = (None, None) if instance is None else _limits(instance, p.variable)
        source = p.by if not p.where else f"{p.by}: {p.where}" if p.by != "package" else p.where
        value, unit, factor, offset = _shown(instance, p), p.unit or "", 1.0, 0.0
        if isinstance(p.value, float) and unit:
            unit, factor, offset = display.of(unit, abs(p.value))
            value = _text(_rounded(factor * p.value + offset) if unit != p.unit else p.value)
        least, most = ("" if end is None else f"{factor * end + offset:g}" for end in (low, high))
        rows.append((p.address, value, "" if unit == "1" else unit, least, most, source, p.text))
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = []
    for name, value, unit, low_text, high_text, source, text in rows:
        numbers = f"{value:>{widths[1]}}  {unit:<{widths[2]}}  {low_text:>{widths[3]}}  {high_text:>{widths[4]}}"
        lines.append(f"  {name:<{widths[0]}}  {numbers}  {source:<{widths[5]}}  {text}".rstrip())
    return "\n".join(lines)


def _rounded(value: float) -> float:
    """Without the last digits of a conversion."""
    return float(f"{value:.12g}")


def _limits(instance: FmuInstance, name: str) -> tuple[float | None, float | None]:
    """What the FMU and its types allow, where they say it."""
    if instance.variables[name].type in ("Boolean", "String", "Binary"):
        return None, None
    try:
        low, high = instance.bounds(name)
    except CosimError:  # told where the value is checked
        return None, None
    natural = instance.limits.get(instance.variables[name].type, (-float("inf"), float("inf")))
    return (None if low == natural[0] else low), (None if high == natural[1] else high)


def _shown(instance: FmuInstance | None, p: ParameterInForce) -> str:
    """A value in a few characters, an item with its name."""
    if p.value is None:
        return "?"
    if isinstance(p.value, tuple):
        return " ".join(_text(v) for v in p.value[:4]) + (f" ... ({len(p.value)})" if len(p.value) > 4 else "")
    items = instance.items(p.variable) if instance is not None else None
    item = next((name for name, number in (items or {}).items() if number == p.value), None)
    return _text(p.value) if item is None else f"{p.value} ({item})"


def _text(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float):
        return f"{value:.12g}"
    return value.hex() if isinstance(value, bytes) else str(value)
