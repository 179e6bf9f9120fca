"""Programs of the inner loop: what a coupling algorithm writes down once, and the compiled loop runs in every step."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from ...core.errors import CosimError, SimulationError
from . import loop
from .values import INTEGER, REAL, WIDTHS, ExchangeGroup

CALLBACK = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_double, ctypes.c_double)


class ValueBuffer:
    """Where all values lie: slots of 8 bytes seen as reals or integers, texts apart, and the staging areas."""

    def __init__(self, slots: int, texts: int, staged: dict[int, int]):
        self.reals = np.zeros(max(1, slots))
        self.integers = self.reals.view(np.int64)
        self.texts: list[str | bytes] = [""] * texts
        self.ended = np.zeros(2, np.int64)
        """Number + 1 of the instance that has asked to end the run, and its instance."""
        self.stages = {width: np.zeros(staged.get(width, 0) + 8, kind) for width, kind in WIDTHS.items()}

    def address(self, slot: int) -> int:
        """Address of a slot."""
        return int(self.reals.ctypes.data) + 8 * slot


@dataclass(frozen=True)
class Within:
    """An integer has to lie between two."""

    least: int
    greatest: int


@dataclass(frozen=True)
class Mapped:
    """An integer is replaced as a table says; one that it does not have is kept, or refused if `strict`."""

    entries: tuple[tuple[int, int], ...]
    strict: bool = False


@dataclass(frozen=True)
class SlotConversion:
    """One element's way from one slot to another: what happens to an integer, then factor and offset of a real."""

    factor: float = 1.0
    offset: float = 0.0
    whole: tuple[Within | Mapped, ...] = ()
    from_integer: bool = False
    """The source is an integer and the target a real."""

    @property
    def plain(self) -> bool:
        """Whether it copies."""
        return self.factor == 1.0 and self.offset == 0.0 and not self.whole and not self.from_integer

    def apply(self, value: float) -> float:
        """The value at the target; one that is refused on the way is kept."""
        for step in self.whole:
            if isinstance(step, Mapped):
                value = dict(step.entries).get(int(value), value)
        return value if self.factor == 1.0 and self.offset == 0.0 else self.factor * float(value) + self.offset

    def inverse(self, value: float) -> float | None:
        """The value at the source, of several the first; None where none leads to it."""
        if self.factor != 1.0 or self.offset != 0.0:
            if self.factor == 0.0:
                return None
            value = (value - self.offset) / self.factor
        if self.from_integer:
            value = round(value)
        for step in reversed(self.whole):
            if isinstance(step, Mapped):
                starts = [start for start, end in step.entries if end == value]
                if not starts and (step.strict or value in dict(step.entries)):
                    return None
                value = starts[0] if starts else value
            elif not step.least <= value <= step.greatest:
                return None
        return value


@dataclass(frozen=True)
class Memory:
    """Something that a program remembers from step to step, under a name of its own in the program."""

    name: str
    begin: Callable[[], None]
    """Gives it its state for a new run."""
    read: Callable[[], Mapping[str, np.ndarray]]
    """All of it, as arrays by name, for a run that is to go on from there."""
    restore: Callable[[Mapping[str, np.ndarray]], None]
    """Takes what `read` gave."""


class EngineInstance(Protocol):
    """What the engine needs of an FMU: it writes its own part of a program, and knows what its statuses mean."""

    name: str
    input_groups: list[ExchangeGroup]

    def write_inputs(self, program: Program) -> None:
        """Write down: the inputs in the buffer are handed to it."""

    def write_outputs(self, program: Program) -> None:
        """Write down: its outputs are read into the buffer."""

    def write_step(self, program: Program, may_be_restored: bool) -> None:
        """Write down: it steps; `may_be_restored`: a state from before the step may be set after it."""

    def write_input_derivatives(self, program: Program, references: Sequence[int], changes: int) -> None:
        """Write down: it is told the slopes of inputs."""

    def on_warning(self, doing: str) -> None:
        """Be told that a call ended with a warning."""

    def note_status(self, status: int | None) -> None:
        """Be told what a call returned, after which not all calls are allowed."""

    def failure(self, doing: str, status: int, t: float | None = None) -> SimulationError:
        """The error of a call that returned a status."""


class Program:
    """A list of operations in the making. Each has a label for messages: (instance, what it does)."""

    def __init__(self, buffer: ValueBuffer, instances: Sequence[EngineInstance], forks: bool = False):
        """forks: threads may take steps that do not depend on each other."""
        self.buffer, self.forks = buffer, forks
        self.instances = instances  # thousands of programs of a large system share it
        self.numbered = 0
        """How many of the instances, from the first on, the program has to do with by their number."""
        self.rows: list[tuple[int, ...]] = []
        self.labels: list[tuple[EngineInstance | None, str]] = []
        self.constants: list[float] = []
        self.table: list[tuple[int, int]] = []
        self._keep: list[object] = []
        self.memories: list[Memory] = []
        """All that is remembered from one step to the next, besides the values of signals."""
        self.drives: list[tuple[int, int, str]] = []
        """(slot, column, family) of what is driven."""
        self.error: CosimError | None = None
        """Why a Python function of the program has failed."""

    def __len__(self) -> int:
        return len(self.rows)

    def add(self, instance: EngineInstance | None, doing: str, *operation: int) -> None:
        """An operation of `loop`, and who does what in it, for messages."""
        self.rows.append(operation)
        self.labels.append((instance, doing))

    # values

    def convert(self, target: int, source: int, size: int, conversion: SlotConversion, doing: str = "") -> None:
        """target = conversion(source), `size` slots from each."""
        for step in conversion.whole:
            if isinstance(step, Within):
                self.add(None, doing, loop.WITHIN, source, size, step.least, step.greatest)
                continue
            first = self._table(step.entries)
            for k in range(size):
                self.add(None, doing, loop.TABLE, target + k, source + k, first, len(step.entries), int(step.strict))
            source = target
        if conversion.factor == 1.0 and conversion.offset == 0.0 and not conversion.from_integer:
            if source == target:
                return
            if self.rows and self.rows[-1][0] == loop.COPY and self._continues(target, source):
                _, a, b, count = self.rows[-1]
                self.rows[-1] = (loop.COPY, a, b, count + size)
            else:
                self.add(None, doing, loop.COPY, target, source, size)
        else:
            code = loop.INTEGER_TO_REAL if conversion.from_integer else loop.LINEAR
            self.add(None, doing, code, target, source, size, self.constant(conversion.factor, conversion.offset))

    def _continues(self, target: int, source: int) -> bool:
        _, a, b, count = self.rows[-1]
        return a + count == target and b + count == source

    def mix(self, target: int, terms: Sequence[tuple[float, int]]) -> None:
        """The real in slot target = sum of factor * the real in slot, for (factor, slot) in terms."""
        constant = self.constant(*(factor for factor, _ in terms))
        first = self._table([(slot, 0) for _, slot in terms])
        self.add(None, "", loop.MIX, target, constant, first, len(terms))

    def line(self, target: int, newest: int, before: int, ahead: float) -> None:
        """The real in slot target = the straight line through two values, so many steps ahead of the newest."""
        self.add(None, "", loop.LINE, target, newest, before, self.constant(ahead))

    def remember(self, memory: Memory) -> None:
        """Have a memory begin anew, now and before every further run."""
        self.memories.append(memory)
        memory.begin()

    def remember_slots(self, name: str, first: int, sources: Sequence[int]) -> None:
        """Have the slots from `first` on remembered, where a step leaves what it found in other slots; as a run begins
        that is what is there then."""
        reals, held = self.buffer.reals, slice(first, first + len(sources))

        def begin() -> None:
            reals[held] = reals[sources]

        def restore(kept: Mapping[str, np.ndarray]) -> None:
            reals[held] = kept["last"]

        self.remember(Memory(name, begin, lambda: {"last": reals[held].copy()}, restore))

    def begin(self) -> None:
        """A new run has been initialised."""
        for memory in self.memories:
            memory.begin()

    def drive(self, target: int, column: int, family: str, mean: int | None = None) -> None:
        """The slot gets a column of the driven values at the step's start, or column `mean`, their means over steps."""
        self.drives.append((target, column, family))
        self._drive(target, column if mean is None else mean, family, loop.START)

    def drive_text(self, target: int, column: int, texts: Sequence[str], slot: int) -> None:
        """The text at place target is the one whose number is driven, which goes through a free slot."""
        self.drive(slot, column, INTEGER)
        buffer = self.buffer

        def take(_t: float, _h: float) -> int:
            buffer.texts[target] = texts[buffer.integers[slot]]
            return 0

        self.python(take)

    def drive_at_end(self, target: int, column: int, family: str) -> None:
        """The slot gets a column of the driven values at the step's end."""
        self._drive(target, column, family, loop.END)

    def _drive(self, target: int, column: int, family: str, when: int) -> None:
        self.add(None, "", loop.DRIVE if family == REAL else loop.DRIVE_INTEGER, target, column, when)

    def python(
        self, function: Callable[[float, float], int], instance: EngineInstance | None = None, doing: str = ""
    ) -> None:
        """Call a Python function (t, h) that returns a status; what it raises ends the run."""

        def guarded(t: float, h: float) -> int:
            try:
                return function(t, h)
            except CosimError as error:
                self.error = error
            except Exception as error:
                self.error = SimulationError(f"{doing or 'the coupling'}: {type(error).__name__}: {error}")
            return 3

        callback = CALLBACK(guarded)
        self._keep.append(callback)
        self.add(instance, doing, loop.PYTHON, int(ctypes.cast(callback, ctypes.c_void_p).value or 0))

    def constant(self, *values: float) -> int:
        """Number of the first of these among the constants."""
        self.constants += values
        return len(self.constants) - len(values)

    def keep(self, referenced: object) -> None:
        """Let something live as long as the program."""
        self._keep.append(referenced)

    def number(self, instance: EngineInstance) -> int:
        """Which of the instances it is."""
        number = self.instances.index(instance)
        self.numbered = max(self.numbered, number + 1)
        return number

    def _table(self, entries: Sequence[tuple[int, int]]) -> int:
        self.table += entries
        return len(self.table) - len(entries)

    # FMUs

    def set_inputs(self, instance: EngineInstance) -> None:
        """Hand the inputs in the buffer to the FMU."""
        instance.write_inputs(self)

    def get_outputs(self, instance: EngineInstance) -> None:
        """Read the outputs of the FMU into the buffer."""
        instance.write_outputs(self)

    def copy_text(self, target: int, source: int) -> None:
        """A text from one place to another."""
        texts = self.buffer.texts

        def copy(_t: float, _h: float) -> int:
            texts[target] = texts[source]
            return 0

        self.python(copy)

    def do_step(self, instance: EngineInstance, may_be_restored: bool = False) -> None:
        """Advance the FMU over the macro step; `may_be_restored`: a state from before the step may be set after it."""
        instance.write_step(self, may_be_restored)

    def set_input_derivatives(self, instance: EngineInstance, references: Sequence[int], changes: int) -> None:
        """Hand the slopes of inputs to the FMU; their changes over the last step lie from the slot `changes` on."""
        instance.write_input_derivatives(self, references, changes)

    def advance(self, instances: Sequence[EngineInstance]) -> None:
        """Hand all of them their inputs, have all step, read all outputs."""
        for instance in instances:
            self.set_inputs(instance)
        self.step_all(instances)

    def step_all(self, instances: Sequence[EngineInstance]) -> None:
        """Have all of them step, read all outputs."""
        begin = len(self.rows)
        for instance in instances:
            self.do_step(instance)
        if self.forks:
            self._fork(begin)
        for instance in instances:
            self.get_outputs(instance)

    def _fork(self, begin: int) -> None:
        """Let threads take the steps that have been written from there on; what FMUs in processes are told comes first,
        for they step meanwhile."""
        steps = (loop.STEP_1, loop.STEP_2, loop.STEP_3)
        written = sorted(zip(self.rows[begin:], self.labels[begin:], strict=True), key=lambda one: one[0][0] in steps)
        del self.rows[begin:], self.labels[begin:]
        count = sum(row[0] in steps for row, _ in written)
        for k, (row, label) in enumerate(written):
            if count > 1 and k == len(written) - count:
                self.add(None, "", loop.FORK, count)
            self.add(*label, *row)

    # the arrays

    def compiled(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """(operations, constants, tables) for the loop."""
        operations = np.zeros((len(self.rows), loop.OPERANDS), np.int64)
        for i, row in enumerate(self.rows):
            operations[i, : len(row)] = row
        return (
            operations, np.array([*self.constants, 0.0]), np.array([*self.table, (0, 0)], np.int64).reshape(-1, 2),
        )  # fmt: skip
