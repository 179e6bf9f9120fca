"""One-shot interface Jacobian: inputs that agree with the outputs which they will cause, without iterating.

Held inputs u should be the mean of what drives them over the step, u = F (y_0 + y_1) / 2 + offset. The output at its
end is foretold from the last step and the inputs' change, y_1 = 2 y_0 - y_-1 + D (u - u_-1), where D is how an output
at the end of a step answers to an input that is held during it. That is one linear system for u:

    (1 - F D / 2) u = F (1.5 y_0 - 0.5 y_-1) + offset - F D / 2 u_-1

For a mass against a spring it is the implicit midpoint rule: no numerical damping, stable for every step (compare
Sicklinger et al. 2014, who iterate). D is measured with steps that are taken back, at the start and every `EVERY`
steps; directional derivatives of FMI tell what an output does at once, not after a step, and cannot stand in for it.
"""

from __future__ import annotations

import numpy as np

from ...core.errors import SimulationError, UsageError
from ..agreement import refresh, stale
from ..engine.program import Program
from ..system import System
from ._coupled import Coupling, Stepper

EVERY = 500
"""Macro steps after which D is measured anew."""

NUDGE = 1e-4
"""Change of an input to measure D, relative to 1 + its size."""


def write(system: System, program: Program) -> None:
    """Write the macro step."""
    coupling = Coupling(system)
    names = {name for name in coupling.takers if name in coupling.givers}
    jacobian = _Jacobian(coupling, {n: Stepper(system, system.slaves[n], "interface-jacobian") for n in sorted(names)})
    if stale(system)[1]:
        raise UsageError(
            "--method interface-jacobian: the system has an algebraic loop (cosim-master --check names it); choose "
            "another method, e.g. fixed-point"
        )
    before = held = np.zeros(0)
    answered = np.zeros(0)  # the outputs at the end of a step as they answer to the inputs that were held in it
    count, whole = 0, 0.0

    def begin() -> None:
        nonlocal before, held, answered, count, whole
        before = answered = coupling.outputs
        whole = 0.0
        held = coupling.given(coupling.outputs)
        count = 0

    program.at_start(begin)

    def solve(t: float, h: float) -> int:
        nonlocal before, held, count, whole
        y = answered
        if count % EVERY == 0:
            shown = coupling.outputs
            system.board.reals[coupling.targets] = held
            jacobian.measure(t, h)
            system.board.reals[coupling.sources] = shown
        count += 1
        whole = max(whole, h)  # the last step may be shorter
        now = coupling.given(y + 0.5 * (h / whole) * (y - before))
        u = jacobian.solve(now, held)
        before, held = y, u
        system.board.reals[coupling.targets] = u
        return 0

    def answer(_t: float, _h: float) -> int:
        nonlocal answered
        answered = coupling.outputs
        return 0

    coupling.pass_others(program)
    program.python(solve)
    program.advance([system.slaves[name] for name in system.order])
    program.python(answer)
    refresh(system, program)


class _Jacobian:
    """D, and the linear system it makes."""

    def __init__(self, coupling: Coupling, steppers: dict[str, Stepper]):
        self.coupling, self.steppers = coupling, steppers
        self._half = np.zeros((len(coupling), len(coupling)))
        self._inverse = np.eye(len(coupling))

    def measure(self, t: float, h: float) -> None:
        """Measure D over a step from t with the inputs that are on the board."""
        c = self.coupling
        reals = c.system.board.reals
        D = np.zeros((len(c), len(c)))
        for name, stepper in self.steppers.items():
            outputs = np.array([i for i, n in enumerate(c.givers) if n == name])
            state = stepper.save()
            try:
                stepper.step(t, h)
                base = reals[c.sources[outputs]].copy()
                for j, taker in enumerate(c.takers):
                    if taker != name:
                        continue
                    stepper.restore(state)
                    u = reals[c.targets[j]]
                    nudge = NUDGE * (1.0 + abs(u))
                    reals[c.targets[j]] = u + nudge
                    stepper.step(t, h)
                    D[outputs, j] = (reals[c.sources[outputs]] - base) / nudge
                    reals[c.targets[j]] = u
                stepper.restore(state)
            finally:
                stepper.slave.drop(state)
        self._half = 0.5 * c.factors[:, None] * D
        try:
            self._inverse = np.linalg.inv(np.eye(len(c)) - self._half)
        except np.linalg.LinAlgError:
            raise SimulationError(
                f"--method interface-jacobian: inputs and outputs cannot be made to agree at t = {t:g} s; choose "
                "another method or step", t
            ) from None  # fmt: skip

    def solve(self, now: np.ndarray, held: np.ndarray) -> np.ndarray:
        """The inputs that agree with the outputs they will cause."""
        return self._inverse @ (now - self._half @ held)
