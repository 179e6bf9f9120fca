"""What inputs have before something drives them, and what is put in the buffer by hand."""

from __future__ import annotations

from collections.abc import Mapping

from ...core.errors import ParameterError
from ..engine.program import ValueBuffer
from ..engine.values import REAL, TEXT, Signal, in_slot
from ..slaves.base import FmuInstance
from .connections import Connections, SignalConnection
from .quantities import Quantities
from .value_conversion import parsed


class InputValues:
    """Values of inputs that are set by the master: start values, stimuli, `--set`."""

    def __init__(
        self, instances: Mapping[str, FmuInstance], connections: Connections, quantities: Quantities,
        buffer: ValueBuffer,
    ):  # fmt: skip
        self._instances, self._connections, self._quantities, self.buffer = instances, connections, quantities, buffer
        self.inputs, self.system_inputs = connections.inputs, connections.system_inputs
        self.inputs_without_value: set[str] = set()
        """Inputs of the whole system that nobody gives a value: what they are connected to keeps its start value."""
        self.reset_inputs()

    def reset_inputs(self) -> None:
        """Give every input its start value from the model description; `inputs_without_start` have none there."""
        self.inputs_without_start = {signal.home: signal for signal in self.inputs.values()}
        for component, name in self.inputs:
            value = self._instances[component].start(name)
            if value is not None:
                self.set_input(component, name, value)
                self.inputs_without_start.pop(self.inputs[component, name].home, None)
        for signal in self.system_inputs.values():
            self.put(signal, ("" if signal.family == TEXT else 0,) * signal.size)

    def set_driven(self, signal: Signal, value: object, element: int | None = None) -> None:
        """Give an input, or one element of it, the value of what drives it; it needs no start value then."""
        self.put(signal, value, element)
        self.inputs_without_start.pop(signal.home, None)

    def set_input(self, component: str, name: str, value: object) -> None:
        """Set the value that an input has until a connection overwrites it; '' is the whole system."""
        self.put(self.inputs[component, name] if component else self.system_inputs[name], value)

    def put(self, signal: Signal, value: object, element: int | None = None) -> None:
        """Write a value, or a tuple of an array's, to a signal's place; or one element of an array."""
        values = value if isinstance(value, tuple) else (value,)
        if len(values) != (signal.size if element is None else 1):
            raise ParameterError(f"'{signal.address}' has {signal.size} values, not {len(values)}")
        for place, v in enumerate(values, signal.place + (element or 0)):
            if signal.family == TEXT:
                self.buffer.texts[place] = v
            elif signal.family == REAL:
                self.buffer.reals[place] = float(v)
            else:
                self.buffer.integers[place] = in_slot(int(v))

    def set_given_inputs(self, with_values: set[str]) -> None:
        """Only these inputs of the whole system have a value."""
        self.inputs_without_value = set(self.system_inputs) - with_values

    def has_value(self, link: SignalConnection) -> bool:
        """Whether somebody gives the value that a link carries."""
        return bool(link.source.component) or link.source.name not in self.inputs_without_value

    def show_start_values(self) -> None:
        """Show the start value of what they are connected to at inputs of the system that nobody gives a value."""
        reals, integers = self.buffer.reals, self.buffer.integers
        for link in reversed(self._connections.links):
            if self.has_value(link):
                continue
            target_slots, source_slots = (slice(s.place, s.place + s.size) for s in (link.target, link.source))
            if link.target.family == TEXT:
                self.buffer.texts[source_slots] = self.buffer.texts[target_slots]
            elif link.conversion.plain:
                integers[source_slots] = integers[target_slots]
            else:
                values = reals if link.target.family == REAL else integers
                for i, value in enumerate(values[target_slots].tolist(), source_slots.start):
                    if (start := link.conversion.inverse(value)) is not None:
                        (reals if link.source.family == REAL else integers)[i] = start

    def checked_input(self, name: str, value: object, where: str) -> object:
        """A value for an input of the whole system in its type, a tuple for an array, or a `ParameterError`."""
        quantity, size = self._quantities.input_quantity(name), self.system_inputs[name].size
        shown = f"the system's input '{name}'"
        if size > 1 or isinstance(value, tuple):
            parts = value.replace(",", " ").split() if isinstance(value, str) else value
            values = list(parts) if isinstance(parts, (tuple, list)) else [parts] * size
            if len(values) != size:
                raise ParameterError(f"{where}: {shown} has {size} values, not {len(values)}")
            return tuple(parsed(v, quantity, shown, where) for v in values)
        return parsed(value, quantity, shown, where)

    def check_reached(self, name: str, value: object, where: str) -> None:
        """Raise `ParameterError` where a value of a system's input is none that the variables behind it may take."""
        source = self.system_inputs[name]
        for link in self._connections.of_input(name) if source.family != TEXT else ():
            values = value if isinstance(value, tuple) else (value,)
            for element in values if link.source.element is None else (values[link.source.element],):
                reached = link.conversion.apply(element)
                self._instances[link.target.component]._scalar(link.target.name, reached, where)
