"""The variable record: one table of these makes modelDescription.xml, the SSP connectors and the FMU's README."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from math import isfinite
from typing import Literal

from .errors import ParameterError, UnknownNameError, did_you_mean
from .units import unit

Causality = Literal["parameter", "input", "output"]
Kind = Literal["Real", "Integer", "Boolean"]


@dataclass(frozen=True)
class Variable:
    """One FMI variable. Real values are in `unit` (SI names of `core.units`); min and max are inclusive.

    `feedthrough` names the inputs on which an output depends without delay in a step, `initial` those on
    which its value at t = 0 depends beyond that, `rate_of` the variable whose time derivative this one is.
    """

    name: str
    causality: Causality
    kind: Kind
    start: float | int | bool | None
    description: str
    unit: str | None = None
    min: float | None = None
    max: float | None = None
    nominal: float | None = None
    feedthrough: tuple[str, ...] = ()
    initial: tuple[str, ...] = ()
    rate_of: str | None = None

    def __post_init__(self) -> None:
        if self.unit is not None:
            unit(self.unit)
        if self.start is not None and self.kind != "Boolean":
            self.check(self.start)

    def check(self, value: float) -> float:
        """Return `value`, or raise `ParameterError` naming the variable, the value and the range."""
        low = -float("inf") if self.min is None else self.min
        high = float("inf") if self.max is None else self.max
        if not (isfinite(value) and low <= value <= high):
            suffix = f" {self.unit}" if self.unit not in ("", "1", None) else ""
            fault = "is not finite" if not isfinite(value) else "is out of range"
            raise ParameterError(
                f"{self.causality} '{self.name}' = {value:g}{suffix} {fault}; allowed: {low:g} to {high:g}{suffix}"
            )
        return value


class VariableTable(tuple[Variable, ...]):
    """The variables of one FMU in the order of their value references."""

    _index: dict[str, int]

    def __new__(cls, variables: Iterable[Variable]) -> VariableTable:
        table = super().__new__(cls, tuple(variables))
        names = [v.name for v in table]
        doubles = {n for n in names if names.count(n) > 1}
        if doubles:
            raise ValueError(f"variables named twice: {sorted(doubles)}")
        lost = {v.name for v in table if v.rate_of is not None and v.rate_of not in names}
        if lost:
            raise ValueError(f"rates of what is not there: {sorted(lost)}")
        table._index = {n: i for i, n in enumerate(names)}
        return table

    def index(self, name: str) -> int:  # type: ignore[override]
        """Value reference of the variable called `name`."""
        try:
            return self._index[name]
        except KeyError:
            raise UnknownNameError(f"no variable '{name}'{did_you_mean(name, list(self._index))}") from None

    def __getitem__(self, key: int | str) -> Variable:  # type: ignore[override]
        return super().__getitem__(self.index(key) if isinstance(key, str) else key)

    def of(self, causality: Causality) -> list[Variable]:
        """All variables of one causality, in order."""
        return [v for v in self if v.causality == causality]

    def defaults(self) -> dict[str, float]:
        """Start value of every parameter."""
        return {v.name: v.start for v in self.of("parameter") if v.start is not None}

    def parameters(self, changed: Mapping[str, float] | None = None) -> dict[str, float]:
        """The parameters with `changed` applied; each is checked against its range."""
        values = self.defaults()
        for name, value in (changed or {}).items():
            variable = self[name]
            if variable.causality != "parameter":
                raise UnknownNameError(f"'{name}' is an {variable.causality}, not a parameter")
            values[name] = value if variable.kind == "Boolean" else variable.check(value)
        return values


def parameter(
    name: str, start: float, unit: str, low: float, high: float, description: str, nominal: float | None = None
) -> Variable:
    """A real parameter, fixed after initialisation."""
    return Variable(name, "parameter", "Real", start, description, unit, low, high, nominal)


def switch(name: str, start: bool, description: str) -> Variable:
    """A boolean parameter."""
    return Variable(name, "parameter", "Boolean", start, description)


def count(name: str, start: int, low: int, high: int, description: str) -> Variable:
    """An integer parameter."""
    return Variable(name, "parameter", "Integer", start, description, None, low, high)


def signal_in(
    name: str, start: float, unit: str, low: float, high: float, nominal: float, description: str,
    rate_of: str | None = None,
) -> Variable:  # fmt: skip
    """A continuous real input."""
    return Variable(name, "input", "Real", start, description, unit, low, high, nominal, rate_of=rate_of)


def signal_out(
    name: str,
    unit: str,
    nominal: float,
    description: str,
    feedthrough: tuple[str, ...] = (),
    initial: tuple[str, ...] = (),
    rate_of: str | None = None,
) -> Variable:
    """A continuous real output."""
    return Variable(
        name, "output", "Real", None, description, unit, None, None, nominal, feedthrough, initial, rate_of
    )
