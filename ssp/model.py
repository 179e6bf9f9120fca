"""What an SSP package says, as plain records. Names are those of the standard."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Connector:
    """A connector of a component: `kind` is input, output, parameter, calculatedParameter or inout."""

    name: str
    kind: str
    type: str | None = None
    unit: str | None = None


@dataclass(frozen=True)
class Parameter:
    """A value of a parameter set; `name` is relative to the element the set is bound to."""

    name: str
    value: float | int | bool | str
    unit: str | None = None
    where: str = ""


@dataclass(frozen=True)
class Component:
    """A component that is an FMU; `source` is relative to the package."""

    name: str
    source: str
    connectors: tuple[Connector, ...] = ()
    parameters: tuple[Parameter, ...] = ()
    line: int = 0


@dataclass(frozen=True)
class Connection:
    """A connection from an output to an input, both named (component, connector)."""

    start: tuple[str, str]
    end: tuple[str, str]
    line: int = 0


@dataclass(frozen=True)
class SystemStructure:
    """The system of a package. Later entries of `parameters` win; they are addressed component.parameter."""

    name: str
    folder: Path
    components: tuple[Component, ...]
    connections: tuple[Connection, ...]
    parameters: tuple[Parameter, ...] = ()
    start_time: float = 0.0
    stop_time: float | None = None
    step_size: float | None = None

    def component(self, name: str) -> Component | None:
        """The component of that name, or None."""
        return next((c for c in self.components if c.name == name), None)
