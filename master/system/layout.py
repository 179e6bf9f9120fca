"""Where signals lie: all in one buffer (`engine.program`), those of a component and a type in a row."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping

import numpy as np

from ...core.errors import PackageError
from ...ssp.flat_system import FlatSystem
from ..engine.loop import U8
from ..engine.program import ValueBuffer
from ..engine.values import MAX_ARRAY_VALUES, TEXT, ExchangeGroup, Signal
from ..slaves.base import FmuInstance
from .value_conversion import Quantity


class SignalLayout:
    """Gives signals their places, then makes the buffer that has them."""

    buffer: ValueBuffer

    def __init__(self) -> None:
        self._count = {"slots": 0, "texts": 0}
        self._staged: dict[int, int] = {}

    def place(self, family: str, size: int) -> int:
        """The first of so many places of a family."""
        key = "texts" if family == TEXT else "slots"
        self._count[key] += size
        return self._count[key] - size

    def lay_out(self, instance: FmuInstance, recorded: Collection[str]) -> None:
        """Give the inputs of an instance their places, and its outputs, with others that are `recorded`."""
        inputs = [v for v in instance.variables.values() if v.causality == "input" and v.type in instance.types]
        outputs = [
            v for v in instance.variables.values()
            if (v.causality == "output" or v.name in recorded) and v.type in instance.types
        ]  # fmt: skip
        places: dict[tuple[str, int], int] = {}  # aliases are one input
        for chosen, signals, groups in (
            (inputs, instance.inputs, instance.input_groups),
            (outputs, instance.outputs, instance.output_groups),
        ):
            for kind in instance.types:
                fmi_type = instance.types[kind]
                members = []
                for v in (v for v in chosen if v.type == kind):
                    size, key = instance.size(v.name), (fmi_type.call_suffix, v.valueReference)
                    is_alias = chosen is inputs and key in places
                    place = places[key] if is_alias else self.place(fmi_type.family, size)
                    signal = Signal(
                        instance.name, v.name, kind, fmi_type.family, v.valueReference, place, size, bool(v.dimensions)
                    )
                    signals.append(signal)
                    if not is_alias:
                        members.append(signal)
                        places[key] = place
                if not members:
                    continue
                count = sum(m.size for m in members)
                stage = 0
                if fmi_type.width is not None:
                    stage = self._staged.get(fmi_type.width, 0)
                    self._staged[fmi_type.width] = stage + count
                references = np.array([m.reference for m in members], np.uint32)
                groups.append(ExchangeGroup(fmi_type, references, members[0].place, count, stage, members))
        if instance.version != "1.0":
            begin = -(-self._staged.get(U8, 0) // 8) * 8
            instance.out_parameters = begin
            self._staged[U8] = begin + 16

    def system_input(
        self, name: str, quantity: Quantity, network: FlatSystem, instances: Mapping[str, FmuInstance]
    ) -> Signal:  # fmt: skip
        """An input of the whole system; the sizes of an array are the package's, else those of what it leads to."""
        type = network.inputs[name].type
        leads = network.from_inputs.get(name, [])
        parted = any(w.start_indices for w in leads)
        size = type.count if type is not None else None
        if size is not None:
            if size > MAX_ARRAY_VALUES:
                raise PackageError(f"{network.inputs[name].where}: '{name}' has {size:.1e} values; refused")
        else:
            ends = (w.end for w in leads if not w.end_indices)
            sizes = [instances[c].size(v) for c, v in ends if c in instances and v in instances[c].variables]
            size = sizes[0] if sizes else 1
        return Signal("", name, quantity.type, quantity.family, 0, self.place(quantity.family, size), size, parted)

    def make_buffer(self, ends: Iterable[Signal], other_inputs: Iterable[Signal]) -> None:
        """The buffer, with free slots for what algorithms remember of ends of connections and of other inputs."""
        spare = 8 * sum(s.size for s in ends) + 4 * sum(s.size for s in other_inputs if s.family != TEXT) + 64
        self._free = self._own_slots = self._count["slots"]
        self.buffer = ValueBuffer(self._count["slots"] + spare, self._count["texts"], self._staged)

    @property
    def signal_slots(self) -> int:
        """How many slots the signals have; free ones come after them."""
        return self._own_slots

    def scratch(self, size: int = 1) -> int:
        """First of so many free slots, for what an algorithm has to remember."""
        if self._free + size > len(self.buffer.reals):
            raise MemoryError("the buffer has no free slots left")
        self._free += size
        return self._free - size

    def release(self) -> None:
        """All scratch is free again; programs that use some must not be run any more."""
        self._free = self._own_slots
