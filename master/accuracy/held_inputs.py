"""How far the inputs of a run were off: what each held in a step against the mean of what its source did in that step.

That is all the error a coupling makes of itself; what becomes of it is the machine's doing. The mean of an output over
a step from y_1 to y_2 follows from its values there and a step further on either side,

    (y_1 + y_2) / 2 - (y_0' - y_1 - y_2 + y_3) / 24 with y_0' the value before, exact for cubics,

for the methods of second order hold the plain mean of both ends, and what that lacks is their error: so the record of a
run tells, too, how far an input would be off with such a method.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np

from ..results.columns import elements
from ..system.system import System

MIN_RANGE = 1e-3
"""Range of a signal, as a share of its largest value, below which how far an input is off is compared with that share
of the value: the pressure of a tank that changes by a few pascals is as good as constant."""

IN_A_ROW = 4
"""Steps in a row in which an input has to be off to count. A jump between two points is none of the coupling's error:
the mean above is wrong about it in three steps at most."""


@dataclass(frozen=True)
class HeldInput:
    """An input that a component held in its steps."""

    name: str
    """component.variable."""
    source: str
    """The output that drives it, likewise."""
    off: float
    """How far it was off at most, as a share of its source's range."""
    of_second_order: float
    """How far it would be off with a method that holds the mean of both ends of a step, where that was followed."""


class HeldInputs:
    """Follows every link that carries a continuous real which may be averaged (`ProgramWriter.is_averaged`)."""

    def __init__(
        self, system: System, outputs: Sequence[int], inputs: Sequence[int], interpolating: Collection[str] = (),
        second: bool = False,
    ):  # fmt: skip
        """outputs, inputs: slots of a row's columns, the outputs first.

        interpolating: components that carry their inputs on through a step, along the slope of the last change; second:
        how far inputs would be off with a method of second order is followed, too.
        """
        out = {place: i for i, place in enumerate(outputs)}
        into = {place: len(outputs) + i for i, place in enumerate(inputs)}
        spread = [
            (link, i) for link in system.links if system.writer.is_averaged(link) for i in range(link.source.size)
        ]
        self._sources = np.array([out[link.source.place + i] for link, i in spread], np.int64)
        self._targets = np.array([into[link.target.place + i] for link, i in spread], np.int64)
        self._factors = np.array([link.conversion.factor for link, _ in spread])
        self._offsets = np.array([link.conversion.offset for link, _ in spread])
        self._interpolating = np.array([link.target.component in interpolating for link, _ in spread], bool)
        self._starts = [elements(link.source)[i] for link, i in spread]
        self.names = [elements(link.target)[i] for link, i in spread]
        """Of the inputs, component.variable."""
        self._of: dict[str, list[int]] = {}
        for i, (link, _) in enumerate(spread):
            self._of.setdefault(link.target.component, []).append(i)
        count = len(spread)
        self._low, self._high = np.full(count, np.inf), np.full(count, -np.inf)
        self._most = np.zeros((1 + second, count))  # of the run, and of a method of second order
        self._rows = np.empty((2, 0, count))  # the last rows, of sources and inputs, whose steps wait for the next ones
        self._off = np.empty((0, 1 + second, count))  # and how far inputs were off in the last steps

    def add(self, rows: np.ndarray) -> None:
        """Take in rows (n, outputs + inputs): outputs at communication points, and inputs held from then on."""
        if self.names and len(rows):
            with np.errstate(all="ignore"):
                self._add(rows)

    def _add(self, rows: np.ndarray) -> None:
        sources = rows[:, self._sources] * self._factors + self._offsets  # in the units of the inputs
        self._low = np.minimum(self._low, sources.min(axis=0))
        self._high = np.maximum(self._high, sources.max(axis=0))
        y, u = self._rows = np.concatenate([self._rows, np.stack([sources, rows[:, self._targets]])], axis=1)
        self._rows = self._rows[:, -3:].copy()
        if len(y) < 4:
            return
        bend = (y[3:] - y[2:-1] - y[1:-2] + y[:-3]) / 24.0
        mean = 0.5 * (y[1:-2] + y[2:-1]) - bend
        held = u[1:-2] + np.where(self._interpolating, 0.5 * (u[1:-2] - u[:-3]), 0.0)
        errors = np.stack([held - mean, bend], axis=1) if len(self._most) > 1 else (held - mean)[:, None]
        off = np.concatenate([self._off, np.abs(errors)])
        self._off = off[len(off) - min(len(off), IN_A_ROW - 1) :].copy()
        if len(off) >= IN_A_ROW:
            count = len(off) - IN_A_ROW + 1
            least = np.min([off[k : k + count] for k in range(IN_A_ROW)], axis=0)
            self._most = np.maximum(self._most, least.max(axis=0))

    def worst(self, component: str) -> tuple[str, float] | None:
        """The input of a component that was furthest off in a step, and how far as a share of its source's range.

        None where no input of it was off, or numbers have grown beyond bounds.
        """
        inputs = np.array(self._of.get(component, ()), np.int64)
        if not len(inputs):
            return None
        share = self._shares()[0, inputs]
        worst = int(np.argmax(share))
        return (self.names[inputs[worst]], float(share[worst])) if 0.0 < share[worst] < np.inf else None

    def furthest_off(self) -> HeldInput | None:
        """The input of the whole system that was furthest off; None where none was, or numbers grew beyond bounds."""
        off, second = self._shares()[[0, -1]]
        worst = int(np.argmax(off)) if len(off) else 0
        if not len(off) or not 0.0 < off[worst] < np.inf:
            return None
        return HeldInput(self.names[worst], self._starts[worst], float(off[worst]), float(second[worst]))

    def off(self, name: str) -> float:
        """How far an input was off at most, as a share of its source's range."""
        return float(self._shares()[0, self.names.index(name)])

    def _shares(self) -> np.ndarray:
        """How far inputs were off, and would be with a method of second order, as shares of ranges (2, inputs)."""
        with np.errstate(all="ignore"):
            span = np.maximum(self._high - self._low, MIN_RANGE * np.maximum(np.abs(self._low), np.abs(self._high)))
            return np.where(self._most > 0.0, self._most / span, 0.0)
