"""A run that somebody else drives: a few steps at a time, with inputs that are held meanwhile."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from ...core.errors import SimulationError, UsageError, did_you_mean
from ..engine.runner import Runner
from ..engine.values import REAL, Signal, of_slot
from .recording import rows_in_memory
from .stimuli_column import whole_numbers

ENDLESS = 2**40
"""Steps of a run without an end: more than anybody takes."""


class SteppedRun:
    """A run under way, from `Session.start`: `step` takes it on. It ends where the session starts another run."""

    def __init__(
        self, runner: Runner, signals: Sequence[Signal], driven: Mapping[str, tuple[Signal, Mapping[str, int]]],
        held: Mapping[str, float], has_means: bool, start: float, step: float, is_current: Callable[[object], bool],
    ):  # fmt: skip
        """driven: the inputs that may be, with the items of enumerations; held: what they begin with."""
        self._runner, self._signals, self._driven = runner, list(signals), dict(driven)
        self._held = {name: self._as_driven(name, held[name]) for name in driven}
        """Whole numbers as they lie in slots."""
        self._has_means, self._start, self.step_size = has_means, start, step
        self._is_current = is_current
        self._broken = ""
        """What ended it, after which its FMUs must not be stepped."""
        self.steps = 0
        """Steps taken."""

    @property
    def time(self) -> float:
        """Where it is [s]."""
        return self._start + self.steps * self.step_size

    def values(self) -> np.ndarray:
        """What is recorded (len(record),), as it is now."""
        buffer = self._runner.program.buffer
        values = [
            buffer.reals[s.place] if s.family == REAL else of_slot(int(buffer.integers[s.place]), s.type)
            for s in self._signals
        ]
        return np.array(values, float)

    def step(self, inputs: Mapping[str, float] | None = None, count: int = 1) -> np.ndarray:
        """Take `count` macro steps with these inputs, by address; one that is not named keeps its value.

        Returns what is recorded at the end. Raises `UsageError` for an input that was not named at the start or what is
        no value of its type, such as 2.7 for a whole number, and `SimulationError` when an FMU fails, asks to end, or
        gives what is not finite. After the first two the run is over.
        """
        if not self._is_current(self):
            raise UsageError("this run is over: its session has been closed, or has started another one")
        if self._broken:
            raise SimulationError(f"this run is over, start another one: {self._broken}", self.time)
        if isinstance(count, bool) or not isinstance(count, int | np.integer) or count < 0:
            raise UsageError(f"count = {count!r} has to be a whole number of steps")
        if inputs is not None and not isinstance(inputs, Mapping):
            raise UsageError("inputs have to be values by address, as {'arm.load_weight': 800.0}")
        for name, value in (inputs or {}).items():
            if name not in self._driven:
                hint = did_you_mean(name, list(self._driven))
                raise UsageError(f"'{name}' is not driven: name it as the run is started{hint}")
            self._held[name] = self._as_driven(name, value)
        block = rows_in_memory(self._runner.width)  # Ctrl-C is heard between two
        for left in range(int(count), 0, -block):
            try:
                self._take(min(left, block))
            except BaseException as error:  # after Ctrl-C nobody knows how many steps were taken
                self._broken = str(error) or type(error).__name__
                raise
        values = self.values()
        if not np.isfinite(values).all():
            wrong = self._signals[int(np.argmax(~np.isfinite(values)))].address
            raise SimulationError(f"'{wrong}' is not finite at t = {self.time:g} s", self.time)
        return values

    def _as_driven(self, name: str, value: float) -> float:
        """A value for an input, in its type."""
        signal, items = self._driven[name]
        if signal.family != REAL:
            return int(whole_numbers(name, [value], signal, items)[0])
        if not np.isfinite(value):
            raise UsageError(f"'{name}' = {value} is not finite")
        return float(value)

    def _take(self, count: int) -> None:
        rows = np.empty((count, self._runner.width))
        taken = self._runner.run(
            rows, self._start, self.step_size, self.steps, count, ENDLESS, np.inf, self._matrix(count)
        )
        self.steps += taken
        if (instance := self._runner.ended) is not None:
            why = f"component '{instance.name}' asks to end the simulation at t = {self.time:g} s"
            raise SimulationError(why, self.time)

    def _matrix(self, count: int) -> np.ndarray | None:
        """The inputs at each of the points (count + 1, columns), then, where the method holds these, their means."""
        if not self._driven:
            return None
        columns = [
            np.full(count + 1, value if self._driven[name][0].family == REAL else np.int64(value).view(np.float64))
            for name, value in self._held.items()
        ]
        return np.stack(columns * (1 + self._has_means), axis=1)  # a value that is held is its own mean
