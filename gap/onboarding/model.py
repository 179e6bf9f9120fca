"""What a package has that measurements can belong to: connectors, parameters, and its run as delivered."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from math import ceil
from pathlib import Path
from typing import Any

import numpy as np

from ...core.errors import CosimError
from ...core.units import UNITS, Unit, unit
from ...master.engine.values import TEXT
from ...master.simulation.session import Session
from ..checks.shapes import Signal
from ..settings import ONBOARDING
from .headings import campaign_unit


@dataclass(frozen=True)
class Connector:
    """An output of the model, or an input that nothing in it drives."""

    address: str
    is_input: bool
    declared: str | None
    """Its unit, where the FMU declares one that is known; numbers of any other are taken as SI."""
    hint: str | None
    """The unit that its description names in brackets."""
    description: str

    @property
    def quantity(self) -> Unit | None:
        """What its numbers measure, or None where nothing says it."""
        known = self.declared or self.hint
        return unit(known) if known else None

    def takes(self, name: str | None) -> bool:
        """Whether a column in that unit can be it; None: a column that states none."""
        return name is None or self.quantity is None or unit(name).same_dimension(self.quantity)


@dataclass(frozen=True)
class Parameter:
    """A parameter: its address, the value in force, unit and description."""

    address: str
    value: Any
    unit: str | None
    description: str


class Model:
    """A package that is loaded; see `Session` for the errors of loading and running it."""

    def __init__(self, session: Session, path: Path):
        self.session, self.path = session, path
        system = session.system
        units = system.units()
        linked = {link.end for link in system.links if link.source.component}
        fed = {link.end for link in system.links if not link.source.component}
        self.outputs = [
            self._connector(f"{c}.{n}", c, n, units, False)
            for (c, n), signal in system.outputs.items() if signal.family != TEXT and signal.size == 1
        ]  # fmt: skip
        self.inputs = [
            self._connector(f"{c}.{n}", c, n, units, True)
            for (c, n), signal in system.inputs.items()
            if signal.family != TEXT and signal.size == 1 and (c, n) not in linked | fed
        ]  # fmt: skip
        ends = {link.source.name: link.end for link in system.links if not link.source.component}
        self.inputs += [
            self._connector(name, *ends.get(name, ("", name)), units, True)
            for name, signal in system.system_inputs.items() if signal.family != TEXT and signal.size == 1
        ]  # fmt: skip
        self.step, self.stop = session.structure.step_size, session.structure.stop_time
        taken = {f"{c}.{n}" for c, n in system.inputs} | {c.address for c in self.inputs}
        self.parameters = [self._parameter(a, v) for a, v in session.values().items() if a not in taken]

    def _connector(
        self, address: str, component: str, name: str, units: Mapping[str, str], is_input: bool
    ) -> Connector:
        instance = self.session.system.instances.get(component)
        description = ""
        if instance is not None and name in instance.variables:
            description = getattr(instance.variables[name], "description", None) or ""
        known = units.get(address) or units.get(f"{component}.{name}")
        return Connector(address, is_input, campaign_unit(known), hint_in(description), description)

    def _parameter(self, address: str, value: Any) -> Parameter:
        for component, instance in self.session.system.instances.items():
            name = address.removeprefix(f"{component}.")
            if name != address and name in instance.variables:
                text = getattr(instance.variables[name], "description", None) or ""
                return Parameter(address, value, campaign_unit(instance.unit_name(name)) or hint_in(text), text)
        return Parameter(address, value, None, "")

    def run(
        self, stop: float, interval: float, parameters: Mapping[str, Any], inputs: Mapping[str, Signal]
    ) -> dict[str, Signal] | str:
        """Signals of all outputs as delivered until `stop` [s] of a run with readings so far apart [s]; a text says
        why there are none."""
        step = self.step or max(interval / 10.0, min(interval, stop / ONBOARDING.most_steps))
        stop = min(ceil(stop / step) * step, ONBOARDING.most_steps * step)
        driven = {c: (s.t, in_unit_of(self.connector(c), s.y)) for c, s in inputs.items()}
        try:
            t, rows = self.session.run([c.address for c in self.outputs], stop, step, parameters, driven)
        except CosimError as error:
            return str(error)
        return {c.address: Signal(t, rows[:, k]) for k, c in enumerate(self.outputs)}

    def connector(self, address: str) -> Connector:
        """The output or input of that address."""
        return next(c for c in (*self.outputs, *self.inputs) if c.address == address)


def in_unit_of(connector: Connector, values: np.ndarray) -> np.ndarray:
    """Values in SI as the FMU counts them."""
    if connector.declared is None:
        return values
    u = unit(connector.declared)
    return np.asarray((values - u.offset) / u.factor)


def hint_in(description: str) -> str | None:
    """The unit in brackets that a description names, as `position [m]`; None for none that is known."""
    found = re.findall(r"[\[(]([^\[\]()]{1,20})[\])]", description.partition("@")[0])
    known = [name for text in reversed(found) if (name := campaign_unit(text)) is not None and name in UNITS]
    return known[0] if known else None
