"""A component that is no FMU but a linear function of its inputs: part of the step program, without a state."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ...ssp.model import LinearFunction
from ..engine.program import Program, SlotConversion
from ..engine.values import REAL, FmiType
from .base import FmuInstance, Log

TYPES = {"Real": FmiType("Real", REAL)}


class FunctionInstance(FmuInstance):
    """Its outputs answer to its inputs at once, and it says so, as an FMU would in its model description."""

    types = TYPES
    version = "2.0"  # it has an initialisation mode
    is_foreign = False

    def __init__(self, name: str, function: LinearFunction, source: Path):
        super().__init__(name, source.parent, _description(function))
        self.function = function

    def load(self, log: Log) -> None:
        self._log, self._state = log, "instantiated"

    def set_start(self, name: str, value: Any) -> None:
        """Inputs lie in the buffer; there is nothing else to set."""

    def get(self, name: str) -> Any:
        return self.start(name)

    def enter_initialisation(self, start: float, stop: float) -> None:
        self._state = "initialising"

    def exit_initialisation(self) -> None:
        self.begin()

    def reset(self) -> None:
        self._state = "instantiated"

    def free(self) -> None:
        self._state = "freed"

    def write_inputs(self, program: Program) -> None:
        """The inputs are where they are needed."""

    def write_step(self, program: Program, may_be_restored: bool) -> None:
        """It has no time."""

    def write_outputs(self, program: Program) -> None:
        places = {s.name: s.place for s in (*self.inputs, *self.outputs)}
        for output, terms in self.function.outputs.items():
            program.mix(places[output], [(factor, places[name]) for name, factor in terms])
            if self.function.offset != 0.0:
                program.convert(places[output], places[output], 1, SlotConversion(1.0, self.function.offset))

    def directional_derivatives(self, outputs: Sequence[int], input: int) -> list[float] | None:
        names = {v.valueReference: v.name for v in self.description.modelVariables}
        return [dict(self.function.outputs[names[reference]]).get(names[input], 0.0) for reference in outputs]

    def save(self) -> Any:
        return None

    def restore(self, state: Any) -> None:
        """There is no state."""

    def serialise(self, state: Any) -> bytes:
        return b""

    def deserialise(self, content: bytes) -> Any:
        return None


def _description(function: LinearFunction) -> Any:
    """What a model description would say of it, as fmpy's record."""
    from fmpy.model_description import CoSimulation, ModelDescription, ModelVariable, Unknown

    names = list(dict.fromkeys(name for terms in function.outputs.values() for name, _ in terms))
    inputs = {
        name: ModelVariable(name, k, "Real", causality="input", variability="continuous", start="0")
        for k, name in enumerate(names)
    }
    outputs = [
        ModelVariable(name, len(inputs) + k, "Real", causality="output", variability="continuous")
        for k, name in enumerate(function.outputs)
    ]
    depends = [Unknown(0, v, [inputs[name] for name, _ in function.outputs[v.name]]) for v in outputs]
    able = CoSimulation(
        "function", canGetAndSetFMUstate=True, canSerializeFMUstate=True, canHandleVariableCommunicationStepSize=True
    )
    return ModelDescription(
        "2.0", "function", coSimulation=able, modelVariables=[*inputs.values(), *outputs], outputs=depends,
        initialUnknowns=depends,
    )  # fmt: skip
