"""What comes before the first step: start values and driven inputs, initialisation, the program of a macro step."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from ..algorithms.method import MEAN, Method
from ..coupling.feedthrough import detect_feedthrough
from ..coupling.initialisation import Initialiser
from ..engine.program import Program
from ..engine.values import Signal
from ..system.start_values import StartValue
from ..system.system import System


@dataclass(frozen=True)
class DrivenInput:
    """An input that has a column of what drives a run; element: which value of an array it is."""

    signal: Signal
    start: object
    """Its value at the start."""
    has_means: bool
    """Whether it has a column of means over the steps, too, behind those of all values."""
    element: int | None = None
    texts: tuple[str, ...] = ()
    """What its numbers stand for where it takes strings."""


def undriven(values: Iterable[StartValue], driven: Sequence[DrivenInput]) -> list[StartValue]:
    """Start values but for inputs that are driven: these have what drives them, whatever else is said of them."""
    taken = {(d.signal.component, d.signal.name) for d in driven}
    return [v for v in values if (v.component, v.variable) not in taken]


def initialise(
    initialiser: Initialiser, method: Method, values: Sequence[StartValue], driven: Sequence[DrivenInput],
    start: float, stop: float,
) -> list[str]:  # fmt: skip
    """Bring a system whose FMUs are as new to its start; what is worth telling of that."""
    system, values = initialiser.system, undriven(values, driven)
    of_system = {v.variable for v in values if not v.component}
    system.values.set_given_inputs(of_system | {d.signal.name for d in driven if not d.signal.component})
    for d in driven:
        system.values.set_driven(d.signal, d.start, d.element)
    initialiser(values, start, stop)
    return [*initialiser.remarks, *detect_feedthrough(system, loops_only=method.newest_values)]


def write_program(system: System, method: Method, driven: Sequence[DrivenInput]) -> Program:
    """What a macro step consists of; column k of what drives it is that of the input k."""
    program = system.writer.program()
    for column, d in enumerate(driven):
        place = d.signal.place + (d.element or 0)
        if d.texts:
            program.drive_text(place, column, d.texts, system.layout.scratch())
        else:
            mean = len(driven) + column if d.has_means and method.input_hold == MEAN else None
            program.drive(place, column, d.signal.family, mean)
    method.write(system, program)
    system.writer.show(program)
    return program
