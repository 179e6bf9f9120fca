"""One-shot interface Jacobian: inputs that agree with the outputs which they will cause, without iterating.

Held inputs u should be the mean of what drives them over the step, u = F (y_0 + y_1) / 2 + offset. The output at its
end is foretold from the last step and the inputs' change. An output is what the state gives, which a held input changes
by S until the end of the step, and what the inputs there give at once, T F y (feed-through):

    y_1 = 2 y_0 - y_-1 + D (u - u_-1),   D = (1 - T F)^-1 S

That is one linear system for u:

    (1 - F D / 2) u = F (1.5 y_0 - 0.5 y_-1) + offset - F D / 2 u_-1

For a mass against a spring it is the implicit midpoint rule: no numerical damping, stable for every step (compare
Sicklinger et al. 2014, who iterate). S is measured with steps that are taken back, at the start and every `EVERY`
steps; T is what the FMUs say (directional derivatives), else measured too.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...core.errors import SimulationError
from ..agreement import refresh, stale
from ..engine.program import Program
from ..nudge import nudged
from ..slaves.base import Slave
from ..system import System
from ._coupled import Coupling, Stepper

EVERY = 500
"""Macro steps after which D is measured anew."""

NUDGE = 1e-4
"""Change of an input to measure D, relative to 1 + its size."""


def takes_back(system: System) -> list[str]:
    """Components whose steps are taken back: those that take and give."""
    coupling = Coupling(system)
    return sorted(set(coupling.takers) & set(coupling.givers))


def write(system: System, program: Program) -> None:
    """Write the macro step."""
    coupling = Coupling(system)
    steppers = {n: Stepper(system, system.slaves[n]) for n in takes_back(system)}
    jacobian = _Jacobian(coupling, steppers, set(steppers) & set(stale(system)[0]))
    before = held = np.zeros(0)
    count, whole = 0, 0.0

    def begin() -> None:
        nonlocal before, held, count, whole
        before = coupling.outputs
        whole = 0.0
        held = coupling.given(coupling.outputs)
        count = 0

    program.at_start(begin)

    def solve(t: float, h: float) -> int:
        nonlocal before, held, count, whole
        y = coupling.outputs
        if count % EVERY == 0:
            system.board.reals[coupling.targets] = held
            jacobian.measure(t, h)
            system.board.reals[coupling.sources] = y
        count += 1
        whole = max(whole, h)  # the last step may be shorter
        now = coupling.given(y + 0.5 * (h / whole) * (y - before))
        u = jacobian.solve(now, held)
        before, held = y, u
        system.board.reals[coupling.targets] = u
        return 0

    coupling.pass_others(program)
    program.python(solve)
    program.advance([system.slaves[name] for name in system.order])
    refresh(system, program)


class _Jacobian:
    """D, and the linear system it makes."""

    def __init__(self, coupling: Coupling, steppers: dict[str, Stepper], at_once: set[str]):
        """at_once: slaves with feed-through."""
        self.coupling, self.steppers, self.at_once = coupling, steppers, at_once
        self._half = np.zeros((len(coupling), len(coupling)))
        self._inverse = np.eye(len(coupling))

    def measure(self, t: float, h: float) -> None:
        """Measure D over a step from t with the inputs that are on the board."""
        c = self.coupling
        S, T = np.zeros((2, len(c), len(c)))
        for name, stepper in self.steppers.items():
            state = stepper.save()
            try:
                stepper.step(t, h)
                outputs = [i for i, giver in enumerate(c.givers) if giver == name]
                base = c.outputs[outputs]
                inputs = [j for j, taker in enumerate(c.takers) if taker == name]
                for j in inputs if name in self.at_once else ():
                    told = self._told(stepper.slave, outputs, j)
                    if told is None:
                        if stepper.slave.has_failed:
                            stepper.restore(state)
                            stepper.step(t, h)
                        with nudged(c.system, c.ends[j][1], int(c.targets[j]), NUDGE) as nudge:
                            stepper.answer()
                        told = (c.outputs[outputs] - base) / (nudge or np.inf)
                    T[outputs, j] = told
                for j in inputs:
                    stepper.restore(state)
                    with nudged(c.system, c.ends[j][1], int(c.targets[j]), NUDGE) as nudge:
                        stepper.step(t, h)
                    if name in self.at_once:
                        stepper.answer()
                    S[outputs, j] = (c.outputs[outputs] - base) / (nudge or np.inf)
                stepper.restore(state)
            finally:
                stepper.slave.drop(state)
        one = np.eye(len(c))
        try:
            self._half = 0.5 * c.factors[:, None] * np.linalg.solve(one - T * c.factors, S)
            self._inverse = np.linalg.inv(one - self._half)
        except np.linalg.LinAlgError:
            raise SimulationError(
                f"--method interface-jacobian: inputs and outputs cannot be made to agree at t = {t:g} s; choose "
                "another method or step", t
            ) from None  # fmt: skip

    def _told(self, slave: Slave, outputs: Sequence[int], j: int) -> list[float] | None:
        """What an FMU says that its scalar outputs answer at once to an input."""
        signals = [self.coupling.ends[i][0] for i in outputs]
        if any(s.size > 1 or s.element is not None for s in (*signals, self.coupling.ends[j][1])):
            return None
        return slave.derivatives([s.reference for s in signals], self.coupling.ends[j][1].reference)

    def solve(self, now: np.ndarray, held: np.ndarray) -> np.ndarray:
        """The inputs that agree with the outputs they will cause."""
        return self._inverse @ (now - self._half @ held)

